"""Bus-off without recovery: what is seen, and what the node has stored and in its history afterwards."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import pytest

from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.sensor.recovery import Stayed, observe_without_recovery
from conformance.bench.sensor.settling import Settling
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.emcy import errors_to_come
from conformance.bench.session import Bench
from conformance.errors import SetupRefused
from conformance.resources import data
from conformance.spec.load import load_spec

Open: TypeAlias = Callable[..., tuple[Node, Stimulus]]
RECOVERY = (0x3100, 2)


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Open]:
    benches: list[Bench] = []

    def open_one(device: str = "siko_ims360", faults: str = "") -> tuple[Node, Stimulus]:
        path = data("device_specs") / f"{device}.yaml"
        definition = load_bench(data("fixtures/benches") / "simulator.yaml")
        options = {"channel": str(path), "faults": faults}
        bench = Bench.open(definition, load_spec(path).resolve(), options, tmp_path / "trace.log")
        benches.append(bench)
        bench.find_node()
        node = bench.node()
        return node, Stimulus(bench.link, Settling(node))

    yield open_one
    for bench in benches:
        bench.close()


@pytest.mark.parametrize(
    ("faults", "seen"), [("", Stayed(False, True)), ("bus-off-always-left", Stayed(True, True))]
)
def test_the_setting_is_put_back(opened: Open, faults: str, seen: Stayed) -> None:
    node, stimulus = opened(faults=faults)

    assert observe_without_recovery(node, stimulus, RECOVERY, 0, wait_s=0.5) == seen

    node.power_cycle()
    assert node.number(*RECOVERY) == 1


def test_a_setting_that_is_not_taken_tells_nothing(opened: Open) -> None:
    node, stimulus = opened(faults="readback-stale")
    with pytest.raises(SetupRefused, match="does not take 0"):
        observe_without_recovery(node, stimulus, RECOVERY, 0, wait_s=0.5)
    assert node.answers()


def test_a_history_that_was_empty_is_empty_again(opened: Open) -> None:
    node, stimulus = opened()
    with errors_to_come(node, stimulus):
        with stimulus.bus_error("error-passive"):
            assert node.number(0x1001) == 0x11
        assert node.number(0x1003) == 1
    assert node.number(0x1003) == 0


def test_a_node_without_history_needs_none_emptied(opened: Open) -> None:
    node, stimulus = opened("danfoss_dst_x730")
    with errors_to_come(node, stimulus), stimulus.bus_error("warning-limit"):
        assert node.answers()
    assert node.answers()
