"""Writes of the node's non-volatile memory: a bench bounds them, the record counts them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.bench.definition import MOST_WRITES, BenchDefinition

BENCH = """format: 1
what: The simulated device, spared.
interface: canopen_simulator
options: {{clock: virtual}}
power: simulator
allow: [reads, writes, resets, restores, power, non-volatile]
non_volatile_writes: {most}
"""


@pytest.fixture
def judged(judge: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    def run(most: int, select: str, device: str = "danfoss_dst_x730") -> Any:
        path = tmp_path / "bench.yaml"
        path.write_text(BENCH.format(most=most))
        return judge("--bench", path, "--select", select, device=device)

    return run


def test_no_check_begins_after_the_writes_a_bench_allows(judged: Callable[..., Any]) -> None:
    done = judged(1, "STO-01 or STO-02 or RST-01 or OD-15")

    writes = done.record["run"]["non_volatile_writes"]
    assert writes >= 1
    reason = (
        f"{writes} writes of the non-volatile memory were made, and the bench allows 1 in a run"
    )
    skipped = [it for it in done.record["items"] if it["verdict"] == "skipped"]
    assert {it["reason"] for it in skipped} == {reason}
    assert reason in done.out
    assert "OD-15" in done.requirements("pass"), "what writes nothing goes on"
    assert done.code == 0


def test_a_bench_may_allow_none(judged: Callable[..., Any]) -> None:
    done = judged(0, "STO-01 or DEV-10")
    assert done.record["run"]["non_volatile_writes"] == 0
    assert done.requirements("skipped") == {"STO-01"}
    assert "non-volatile memory of the node" not in done.out


def test_writes_are_counted_against_what_the_manual_gives(judged: Callable[..., Any]) -> None:
    done = judged(500, "STO-01")
    writes = done.record["run"]["non_volatile_writes"]
    assert done.record["run"]["wear_cycles"] == 100_000
    said = (
        f"non-volatile memory of the node: {writes} writes of the 100,000 that its manual gives it"
    )
    assert said in done.out
    assert not done.items("skipped")


def test_a_manual_that_says_nothing_is_not_quoted(judged: Callable[..., Any]) -> None:
    done = judged(500, "STO-01", device="siko_ims360")
    assert done.record["run"]["wear_cycles"] is None
    assert "non-volatile memory of the node: " in done.out
    assert "that its manual gives it" not in done.out


@pytest.mark.parametrize(
    ("interface", "given", "most"),
    [
        ("canopen_simulator", None, None),
        ("canopen_simulator", 3, 3),
        ("socketcan", None, MOST_WRITES),
        ("socketcan", 0, 0),
    ],
)
def test_a_real_bench_has_a_bound(interface: str, given: int | None, most: int | None) -> None:
    bench = BenchDefinition(
        format=1, what="A bench.", interface=interface, non_volatile_writes=given
    )
    assert bench.most_writes == most
