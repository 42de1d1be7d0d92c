"""Mapping a TPDO step by step: what is told of each step, and that the node is left as it was."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.services.mapping import MappingPort, word_of
from conformance.bench.session import Bench
from conformance.bench.settings.second_values import can_be_set, second_values
from conformance.spec.load import load_spec

WORDS = [0x6110_0020, 0x3000_0108]


@pytest.fixture
def bench() -> Iterator[Bench]:
    path: Path = resources.find("device_specs", "siko_ims360", "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    spec = load_spec(path).resolve("two-axis")
    opened = Bench.open(definition, spec, {"channel": str(path), "variant": "two-axis"}, None)
    opened.find_node()
    yield opened
    opened.close()


@pytest.fixture
def node(bench: Bench) -> Node:
    return bench.node()


def port_of(node: Node, number: int) -> MappingPort:
    tpdo = node.spec.services.tpdo
    assert tpdo is not None
    return MappingPort(node, tpdo, number)


def parameters(node: Node) -> list[int]:
    keys = [(0x1801, 1), *((0x1A01, place) for place in range(9))]
    return [node.number(*key) for key in keys]


def test_the_word_of_an_entry_has_its_place_and_its_bits(node: Node) -> None:
    assert word_of(node.spec.entries[0x3010, 2]) == 0x3010_0210


def test_the_whole_procedure_is_told_and_undone(node: Node) -> None:
    before = parameters(node)
    port = port_of(node, 2)

    steps = port.remap(WORDS)

    assert [step.what for step in steps] == [
        "download of 800002B2h to 1801h:01",
        "download of 0 to 1A01h:00",
        "download of 61100020h to 1A01h:01",
        "download of 30000108h to 1A01h:02",
        "download of 2 to 1A01h:00",
        "download of 000002B2h to 1801h:01",
    ]
    assert all(step.answer.confirmed for step in steps)
    assert port.words() == WORDS
    node.restore()
    assert parameters(node) == before


def test_a_mapping_ends_with_the_step_that_is_refused(node: Node) -> None:
    before = parameters(node)
    port = port_of(node, 2)
    port.open()

    unknown = port.offer([WORDS[0], 0xC000_0008, WORDS[1]])
    port.open()
    too_many = port.offer(WORDS, 9)

    assert [step.answer.confirmed for step in unknown] == [True, False]
    assert not unknown[-1].counts
    assert [step.answer.confirmed for step in too_many] == [True, True, False]
    assert too_many[-1].counts
    node.restore()
    assert parameters(node) == before


def test_the_second_number_of_mapped_objects_is_no_default(node: Node) -> None:
    number = node.spec.entries[0x1A00, 0]
    found = {(0x1A00, place): bytes(4) for place in range(1, 5)} | {number.key: b"\x04"}

    chosen = second_values(node.spec, found, default_will_do=True)[number.key]

    assert can_be_set(number, node.spec)
    assert chosen[0] not in {reading.default for reading in number.readings} | {4}
