"""What is put in force by a store and a restart, and what the node keeps of it afterwards: nothing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.bench.settings.in_force import InForce
from conformance.bench.settings.settings import Settings
from conformance.errors import SetupRefused
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import load_spec

DST, GIM = ("danfoss_dst_x730", {"DST-122": 2}), ("baumer_gim140r", {"GIM-35": 2, "GIM-50": 2})
EVENT_TIMER, DIFFERENTIAL, RESOLUTION = (0x1800, 5), (0x6014, 0), (0x6000, 0)
PRESET, OFFSET = (0x6012, 0), (0x6013, 0)
OWN_MS, TRIED_MS, LATER_MS = 250, 40, 60


def open_bench(device: str, readings: dict[str, int], **options: Any) -> Bench:
    path = resources.find("device_specs", device, "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    channel = {"channel": str(path), "readings": readings, **options}
    bench = Bench.open(definition, load_spec(path).resolve(), channel, None)
    bench.find_node()
    return bench


@pytest.fixture
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    """A bench whose node has an event timer stored that is not the default."""
    device, readings = getattr(request, "param", DST)
    bench = open_bench(device, readings)
    settings = Settings(bench.node())
    settings.begin()
    settings.write({EVENT_TIMER: OWN_MS.to_bytes(2, "little")})
    settings.save()
    bench.node().reset()
    yield bench
    bench.close()


def of(bench: Bench) -> Any:
    rig = bench.link.rig
    assert isinstance(rig, SimulatorBus)
    with rig.present() as bus:
        return bus.nodes[0]


def memory(bench: Bench) -> dict[Any, Any]:
    return dict(of(bench).memory.values)


def acts_on(bench: Bench, key: tuple[int, int]) -> int:
    number: int = of(bench)._firmware.node.dictionary.number(*key)
    return number


def in_force_of(node: Node, *, allowed: bool = True, by_supply: bool = True) -> InForce:
    return InForce(node, allowed=allowed, by_supply=by_supply)


@pytest.mark.parametrize("by_supply", [True, False])
def test_what_was_written_acts_and_what_was_stored_comes_back(
    by_supply: bool, bench: Bench
) -> None:
    before, node = memory(bench), bench.node()
    in_force = in_force_of(node, by_supply=by_supply)
    node.download(*EVENT_TIMER, TRIED_MS)
    node.download(*DIFFERENTIAL, 7)
    assert acts_on(bench, EVENT_TIMER) == OWN_MS

    lost = in_force.put("1800h:05")

    assert lost == frozenset()
    assert acts_on(bench, EVENT_TIMER) == TRIED_MS
    assert node.number(*DIFFERENTIAL) == 7, "no store keeps it, so it is written again"
    in_force.leave()
    bench.done(node, doubtful=False)
    assert memory(bench) == before
    assert acts_on(bench, EVENT_TIMER) == node.number(*EVENT_TIMER) == OWN_MS
    assert node.number(*DIFFERENTIAL) == 0
    assert bench.non_volatile_writes == 2


def test_it_is_repeated_only_where_it_was_needed(bench: Bench) -> None:
    before, node = memory(bench), bench.node()
    in_force = in_force_of(node)
    node.download(*EVENT_TIMER, TRIED_MS)
    assert not in_force.repeat()
    in_force.put("1800h:05")
    node.download(*EVENT_TIMER, LATER_MS)

    assert in_force.repeat()

    assert acts_on(bench, EVENT_TIMER) == LATER_MS
    in_force.leave()
    bench.done(node, doubtful=False)
    assert memory(bench) == before
    assert bench.non_volatile_writes == 3


def test_nothing_is_done_where_the_bench_does_not_allow_it(bench: Bench) -> None:
    before, node = memory(bench), bench.node()
    in_force = in_force_of(node, allowed=False)
    node.download(*EVENT_TIMER, TRIED_MS)

    with pytest.raises(SetupRefused, match="1800h:05 may act only after a store and a restart"):
        in_force.put("1800h:05")

    in_force.leave()
    assert (node.was_reset, node.non_volatile_writes) == (False, 0)
    bench.done(node, doubtful=False)
    assert memory(bench) == before


def test_it_leaves_a_node_alone_that_it_was_not_needed_for(bench: Bench) -> None:
    node = bench.node()

    in_force_of(node).leave()

    assert (node.was_reset, node.non_volatile_writes) == (False, 0)


def test_what_was_stored_comes_back_when_the_restart_fails(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, node = memory(bench), bench.node()
    in_force = in_force_of(node)
    node.download(*EVENT_TIMER, TRIED_MS)

    def fail() -> None:
        raise SetupRefused("no supply")

    with monkeypatch.context() as patch:
        patch.setattr(node, "power_cycle", fail)
        with pytest.raises(SetupRefused):
            in_force.put("1800h:05")
    assert memory(bench) != before

    in_force.leave()

    bench.done(node, doubtful=True)
    assert memory(bench) == before


def test_a_node_that_forgets_what_it_stored_is_found_out() -> None:
    device, readings = DST
    bench = open_bench(device, readings, faults=["store-forgets"])
    node = bench.node()
    in_force = in_force_of(node)
    node.download(*EVENT_TIMER, TRIED_MS)

    lost = in_force.put("1800h:05")

    assert EVENT_TIMER in lost
    in_force.leave()
    bench.close()


@pytest.mark.parametrize("bench", [GIM], indirect=True)
def test_an_offset_that_only_presets_bring_back_is_stored_and_taken_back(bench: Bench) -> None:
    before, node = memory(bench), bench.node()
    in_force = in_force_of(node)
    node.download(*PRESET, 123)
    offset = node.number(*OFFSET)
    node.download(*RESOLUTION, 10)
    assert offset

    in_force.put("6000h")

    assert acts_on(bench, RESOLUTION) == 10
    assert node.number(*OFFSET) == offset
    in_force.leave()
    bench.done(node, doubtful=False)
    assert memory(bench) == before
    assert node.number(*OFFSET) == 0
