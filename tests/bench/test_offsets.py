"""A preset or a new resolution is undone: the offsets of every slope are what they were."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import pytest

from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.errors import NodeTimeout
from conformance.resources import data
from conformance.spec.fields import key_of
from conformance.spec.load import load_spec

Open: TypeAlias = Callable[..., tuple[Bench, Node]]

OBJECTS = {
    "danfoss_dst_x730": ("0x6000", "0x6013", "0x6014", "0x6023", "0x6024"),
    "baumer_gim140r": ("0x6000", "0x6012", "0x6013", "0x6014", "0x6113", "0x6114", "0x6023"),
    "siko_ims360": ("0x3210", "0x3220"),
}
USED = {
    "danfoss_dst_x730": {"0x6012": 30, "0x6014": 7},
    "baumer_gim140r": {"0x6112": 30, "0x6114": 7},
    "siko_ims360": {"0x3210": 123},
}
"""What a user has set before, so that the zero point is not the factory's."""

CHANGES = [
    ("danfoss_dst_x730", None, {"0x6012": -40}),
    ("danfoss_dst_x730", None, {"0x6000": 10, "0x6012": 5}),
    ("danfoss_dst_x730", "DST-117=2", {"0x6014": 0, "0x6012": 5, "0x6000": 1000}),
    ("danfoss_dst_x730", "DST-109=2", {"0x6000": 10}),
    ("baumer_gim140r", None, {"0x6012": -40}),
    ("baumer_gim140r", None, {"0x6112": 5, "0x6014": 1}),
    ("baumer_gim140r", "GIM-36=2", {"0x6000": 1000}),
    ("baumer_gim140r", "GIM-43=2", {"0x6012": 5}),
    ("siko_ims360", None, {"0x3200": 3}),
]


@pytest.fixture
def open_bench() -> Iterator[Open]:
    opened: list[Bench] = []

    def open_it(device: str, reading: str | None = None, **options: object) -> tuple[Bench, Node]:
        spec = load_spec(data("device_specs") / f"{device}.yaml")
        variant = {"danfoss_dst_x730": "xy-30", "baumer_gim140r": "two-dimensional"}.get(
            device, "two-axis"
        )
        simulation = {"channel": device, "variant": variant, "readings": reading or "", **options}
        definition = load_bench(Path(data("fixtures/benches")) / "simulator.yaml")
        bench = Bench.open(definition, spec.resolve(variant), simulation, None)
        opened.append(bench)
        bench.find_node()
        return bench, bench.node()

    yield open_it
    for bench in opened:
        bench.close()


def write(node: Node, values: dict[str, int], *, undone: bool) -> None:
    for address, value in values.items():
        key = key_of(address)
        if undone:
            node.download(*key, value)
        else:
            node.write(*key, node.spec.entries[key].type.encode(value))


def held(node: Node, device: str) -> dict[str, int]:
    return {address: node.number(*key_of(address)) for address in OBJECTS[device]}


@pytest.mark.parametrize(("device", "reading", "changes"), CHANGES)
def test_what_a_check_writes_leaves_a_zero_point_as_it_was(
    open_bench: Open, device: str, reading: str | None, changes: dict[str, int]
) -> None:
    bench, node = open_bench(device, reading)
    write(node, USED[device], undone=False)
    before = held(node, device)

    write(node, changes, undone=True)
    assert held(node, device) != before
    bench.done(node, doubtful=False)

    assert held(bench.node(), device) == before
    assert any(before.values())


def test_an_offset_that_does_not_come_back_is_left_to_a_reset(open_bench: Open) -> None:
    bench, node = open_bench("danfoss_dst_x730", faults=("preset-ignored",))
    write(node, {"0x6000": 10}, undone=True)
    try:
        bench.done(node, doubtful=False)
    except NodeTimeout:
        pytest.fail("the node is there")
    assert bench.node().number(0x6013) == 0
