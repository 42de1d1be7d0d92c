"""The bench follows a node to another node-ID or bit rate and brings it back, whatever happens."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.node.reach import Astray, Place
from conformance.bench.session import Bench
from conformance.errors import NodeTimeout
from conformance.spec.load import load_spec

DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")
RATES = {"siko_ims360": 500_000, "baumer_gim140r": 2, "danfoss_dst_x730": 2}


@pytest.fixture(params=DEVICES)
def bench(request: pytest.FixtureRequest) -> Iterator[Bench]:
    bench = open_bench(request.param)
    yield bench
    bench.close()


def open_bench(device: str, **options: object) -> Bench:
    path: Path = resources.find("device_specs", device, "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    return Bench.open(
        definition, load_spec(path).resolve(), {"channel": str(path), **options}, None
    )


def move(bench: Bench, node: Node, *, node_id: int | None = None, rate: int | None = None) -> Place:
    """Give the node another place as all three manuals have it, and go there."""
    services = bench.spec.services
    bench.reach.begin(node)
    for service, value in ((services.node_id, node_id), (services.bitrate, rate)):
        if service is not None and value is not None:
            entry = bench.spec.entries[service.object, 0]
            keys = bench.spec.companions(entry.key)
            bench.reach.write(node, keys, entry.type.encode(value))
            node.save({service.object})
    place = Place(
        bench.reach.home.node_id if node_id is None else node_id,
        bench.reach.home.bitrate if rate is None else 500_000,
    )
    assert bench.reach.reset(node, place) == place
    return place


def test_a_node_is_followed_to_another_node_id_and_back(bench: Bench) -> None:
    node = bench.node()

    move(bench, node, node_id=0x21)
    away = node.node_id, node.link.since(0, node.is_boot_up)
    bench.reach.bring_home(node)

    assert away[0] == 0x21
    assert len(away[1]) == 1
    assert bench.reach.here == bench.reach.home
    assert node.node_id == bench.spec.node_id
    assert node.answers()


def test_a_node_is_followed_to_another_bit_rate_and_back(bench: Bench) -> None:
    node = bench.node()

    place = move(bench, node, node_id=0x21, rate=RATES[bench.spec.name])
    bench.reach.bring_home(node)
    node.power_cycle()

    assert place == Place(0x21, 500_000)
    assert bench.reach.here == bench.reach.home
    assert node.answers()


def test_a_node_that_was_lost_half_way_is_found(bench: Bench) -> None:
    node = bench.node()

    place = move(bench, node, node_id=0x21)
    bench.reach.go(bench.reach.home)
    assert not node.answers()
    bench.reach.bring_home(node)

    assert place != bench.reach.here == bench.reach.home
    assert node.answers()


def test_a_node_that_did_not_move_costs_no_write(bench: Bench) -> None:
    node = bench.node()
    bench.reach.begin(node)

    found = bench.reach.reset(node, Place(0x21, bench.reach.home.bitrate), bench.reach.home)
    bench.reach.bring_home(node)

    assert found == bench.reach.home
    assert node.non_volatile_writes == 0


def test_a_node_that_is_nowhere_is_told_of() -> None:
    bench = open_bench("siko_ims360", faults=["silent"])
    node = bench.node()
    bench.reach.go(Place(0x21, 125_000))

    with pytest.raises(NodeTimeout, match="node-ID 33 at 125 kbit/s nor as node-ID 50"):
        bench.reach.bring_home(node)

    assert bench.reach.here == bench.reach.home
    bench.close()


@pytest.mark.parametrize(
    ("fault", "place"),
    [
        ("store-skips-defaults", Place(0x21, 250_000)),
        ("objects/0x2101/ranges=[[2, 127]]", Place(2, 250_000)),
    ],
)
def test_a_node_that_does_not_come_home_is_told_of_by_its_place(fault: str, place: Place) -> None:
    bench = open_bench("baumer_gim140r", faults=[fault])
    node = bench.node()

    move(bench, node, node_id=0x21)
    with pytest.raises(Astray) as astray:
        bench.reach.bring_home(node)

    assert astray.value.place == place
    assert bench.reach.here == bench.reach.home
    bench.close()
