"""A device whose manual gives a supply range, as that of no built-in device does, works at its ends."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROTA = Path(__file__).with_name("fourth_device.yaml")
ENDS = ["DEV-41/10V", "DEV-41/30V"]


@pytest.mark.parametrize("variant", ["multi-turn", "basic"])
def test_it_works_at_both_ends(judge: Callable[..., Any], variant: str) -> None:
    finished = judge("--variant", variant, "--select", "DEV-41", device=ROTA)

    assert finished.items("pass") == ENDS


@pytest.mark.parametrize(
    ("fault", "variant", "words"),
    [
        ("supply-error-early", "multi-turn", "3100h"),
        ("supply-restarts-early", "multi-turn", "1"),
        ("supply-restarts-early", "basic", "1"),
    ],
)
def test_a_supply_found_too_low_too_early_is_seen(
    judge: Callable[..., Any], fault: str, variant: str, words: str
) -> None:
    finished = judge("--fault", fault, "--variant", variant, "--select", "DEV-41", device=ROTA)

    assert finished.items("fail") == ENDS[:1]
    assert [it["actual"] for it in finished.record["items"] if it["verdict"] == "fail"] == [words]


def test_a_bench_without_a_supply_to_change_skips_it(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    bench = tmp_path / "bench.yaml"
    bench.write_text(
        "format: 1\nwhat: No stimulus.\ninterface: canopen_simulator\nallow: [reads, writes, resets]\n",
        encoding="utf-8",
    )

    finished = judge("--bench", bench, "--select", "DEV-41", device=ROTA)

    assert finished.items("skipped") == ENDS


def test_no_built_in_device_documents_a_range(judge: Callable[..., Any]) -> None:
    assert judge("--select", "DEV-41").items("pass") == []
