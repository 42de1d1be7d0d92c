"""A device that behaves as a built-in spec says conforms to it, in every variant, and is left as it was."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from conformance.bench.session import Bench
from conformance.options import RunOptions
from conformance.resources import data, names
from conformance.run import Run
from conformance.runner import run
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import load_spec

VARIANTS = [
    (name, variant)
    for name in names("device_specs")
    for variant in load_spec(data("device_specs") / f"{name}.yaml").variants
]


@pytest.fixture
def memories(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """The device's non-volatile memory when a bench was opened, and when it was closed."""
    seen: list[dict[str, Any]] = []

    def look(bench: Bench) -> None:
        assert isinstance(bench.link.rig, SimulatorBus)
        with bench.link.rig.present() as bus:
            seen.append(asdict(bus.nodes[0].memory))

    find_node, close = Bench.find_node, Bench.close

    def looking_first(bench: Bench) -> None:
        look(bench)
        find_node(bench)

    def looking_last(bench: Bench) -> None:
        look(bench)
        close(bench)

    monkeypatch.setattr(Bench, "find_node", looking_first)
    monkeypatch.setattr(Bench, "close", looking_last)
    return seen


@pytest.mark.parametrize(("device", "variant"), VARIANTS)
def test_a_simulated_device_conforms_and_keeps_its_memory(
    device: str, variant: str, tmp_path: Path, memories: list[dict[str, Any]]
) -> None:
    code = run(Run(RunOptions(device, variant=variant, report_dir=tmp_path)))

    record = json.loads((tmp_path / "results.json").read_text("utf-8"))
    verdicts = {item["id"]: item["verdict"] for item in record["items"]}
    assert [i for i, word in verdicts.items() if word in ("fail", "inconclusive")] == []
    assert code == 0
    before, after = memories
    assert after == before
    assert record["run"]["as_found"]["differences"] == []
