"""A check of LSS that breaks off at any point leaves the node, its memory included, as it was."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from pathlib import Path

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.node.reach import Place
from conformance.bench.services.lss import LssPort, index_of
from conformance.bench.services.lss_address import LssAddress
from conformance.bench.session import Bench
from conformance.errors import NodeTimeout, SetupRefused
from conformance.simulator.interface import SimulatorBus
from conformance.simulator.memory import NonVolatileMemory
from conformance.spec.load import load_spec
from conformance.wire import lss
from conformance.wire.lss import LssCommand
from conformance.wire.nmt import NmtCommand

OTHER_ID, OTHER_RATE = 0x21, 500_000
DEVICES = ("siko_ims360", "baumer_gim140r")


@pytest.fixture(params=DEVICES)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    bench = open_bench(request.param)
    yield bench
    bench.close()


def open_bench(device: str, **options: object) -> Bench:
    path: Path = resources.find("device_specs", device, "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    spec = load_spec(path).resolve()
    return Bench.open(definition, spec, {"channel": str(path), **options}, None)


def port_of(bench: Bench) -> LssPort:
    bench.find_node()
    return LssPort(bench.node(), bench.reach, bench.spec.services.lss)


def memory_of(bench: Bench) -> NonVolatileMemory:
    assert isinstance(bench.link.rig, SimulatorBus)
    with bench.link.rig.present() as bus:
        return deepcopy(bus.nodes[0].memory)


def configured(port: LssPort) -> None:
    port.enter()
    port.configure()
    port.node_id(OTHER_ID)


def moved(port: LssPort) -> None:
    configured(port)
    place = Place(OTHER_ID, port.reach.home.bitrate)
    assert port.reach.reset(port.node, place, command=NmtCommand.RESET_COMMUNICATION) == place


def moved_unseen(port: LssPort) -> None:
    configured(port)
    port.node.nmt(NmtCommand.RESET_COMMUNICATION)


def kept(port: LssPort) -> None:
    configured(port)
    port.store()
    place = Place(OTHER_ID, port.reach.home.bitrate)
    assert port.reach.power_cycle(port.node, place) == place


def stored_unseen(port: LssPort) -> None:
    configured(port)
    port.store()


def faster(port: LssPort) -> None:
    port.enter()
    port.configure()
    index = index_of(OTHER_RATE)
    assert index is not None
    assert port.bit_timing(0, index).error_code == 0
    port.activate(OTHER_RATE)
    assert port.locate(Place(port.reach.home.node_id, OTHER_RATE)) is not None


def faster_unseen(port: LssPort) -> None:
    port.enter()
    port.configure()
    port.bit_timing(0, 2)
    port.tell(lss.ActivateBitTiming(1))
    port.settle()


def both_kept(port: LssPort) -> None:
    configured(port)
    port.bit_timing(0, 2)
    port.store()
    place = Place(OTHER_ID, OTHER_RATE)
    assert port.reach.power_cycle(port.node, place) == place


@pytest.mark.parametrize(
    "get_away",
    [configured, moved, moved_unseen, kept, stored_unseen, faster, faster_unseen, both_kept],
)
def test_the_node_is_brought_back_from_everywhere(
    bench: Bench, get_away: Callable[[LssPort], None]
) -> None:
    before = memory_of(bench)
    port = port_of(bench)
    get_away(port)

    port.leave()
    bench.done(port.node, doubtful=True)

    assert memory_of(bench) == before
    assert bench.reach.here == bench.reach.home
    assert port.node.answers()
    port.node.power_cycle()
    assert port.node.answers()
    port.enter()
    assert not port.configuring


def test_a_node_that_cannot_be_brought_back_is_told() -> None:
    bench = open_bench("siko_ims360")
    port = port_of(bench)
    moved(port)
    assert isinstance(bench.link.rig, SimulatorBus)
    with bench.link.rig.present() as bus:
        bus.remove_node(bus.nodes[0])

    with pytest.raises(NodeTimeout, match="node-ID 33 at 125 kbit/s"):
        port.leave()

    bench.close()


def test_a_node_that_never_waits_is_reset(bench: Bench) -> None:
    bench.close()
    deaf = open_bench(bench.spec.name, faults=["lss-never-waits"])
    port = port_of(deaf)
    port.enter()
    port.configure()

    port.leave()

    assert not port.configuring
    deaf.close()


def test_a_manual_without_lss_has_no_port() -> None:
    bench = open_bench("danfoss_dst_x730")

    with pytest.raises(SetupRefused, match="documents no LSS"):
        port_of(bench)

    bench.close()


def test_a_search_excludes_a_node_by_one_limit() -> None:
    address = LssAddress(1, 2, 0, 0xFFFF_FFFF)

    def numbers(**options: object) -> list[int]:
        found = address.search(**options)  # type: ignore[arg-type]  # as the cases name them
        return [it.value for it in found if isinstance(it, lss.IdentifyRemoteSlave)]

    most = 0xFFFF_FFFF
    assert numbers() == [1, 2, 0, most, 0, most]
    assert numbers(exact=True) == [1, 2, 0, 0, most, most]
    assert numbers(excluded_by=LssCommand.IDENTIFY_REVISION_LOW) == [1, 2, 1, most, 0, most]
    assert numbers(excluded_by=LssCommand.IDENTIFY_SERIAL_HIGH) == [1, 2, 0, most, 0, most - 1]
    for beyond in (LssCommand.IDENTIFY_REVISION_HIGH, LssCommand.IDENTIFY_SERIAL_LOW):
        with pytest.raises(SetupRefused, match="no number beyond"):
            address.search(excluded_by=beyond)
