"""A heartbeat known to be off, on benches whose timestamps are known to be off: where the verdict turns."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance import resources

ITEM = "siko_ims360/HB-01/1017h/100ms"
"""Each interval is 100 ms ± 7 ms, and their mean, over 20 of them, 100 ms ± 5 ms."""


def fault(folder: Path, key: str, value: float) -> str:
    path = folder / "off.yaml"
    text = (
        f"format: 1\nwhat: Off by a known amount.\nseen_by: [HB-01]\ninject: {{{key}: {value}}}\n"
    )
    path.write_text(text, encoding="ascii")
    return str(path)


def bench(folder: Path, jitter_ms: float) -> str:
    path = folder / "bench.yaml"
    text = resources.find("fixtures/benches", "simulator", "--bench").read_text("utf-8")
    path.write_text(f"{text}timestamp_jitter_ms: {jitter_ms}\n", encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("jitter_ms", "words"),
    [
        (0, "pass pass pass pass fail fail"),
        (1, "pass pass pass inconclusive fail fail"),
        (3, "pass pass pass inconclusive fail fail"),
        (5, "pass pass inconclusive inconclusive fail fail"),
        (10, "inconclusive inconclusive inconclusive inconclusive fail fail"),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_period_that_is_off(
    judge: Callable[..., Any], tmp_path: Path, jitter_ms: float, words: str, sign: int
) -> None:
    seen = []
    for percent in (0, 1, 2, 5, 10, 20):
        off = fault(tmp_path, "heartbeat_period_factor", 1 + sign * percent / 100)
        done = judge(
            *("--bench", bench(tmp_path, jitter_ms)),
            *("--fault", off, "--select", ITEM),
        )
        (item,) = done.record["items"]
        seen.append(item["verdict"])
    assert " ".join(seen) == words


@pytest.mark.parametrize(
    ("jitter_ms", "words"),
    [
        (0, "pass pass pass pass pass fail"),
        (3, "pass pass pass pass inconclusive fail"),
    ],
)
def test_intervals_that_are_off_at_random(
    judge: Callable[..., Any], tmp_path: Path, jitter_ms: float, words: str
) -> None:
    """Each heartbeat is late by up to some per cent of its period, at random.

    With 10 per cent the worst of these intervals is a little less than 7 ms off.
    """
    seen = []
    for percent in (0, 1, 2, 5, 10, 20):
        off = fault(tmp_path, "heartbeat_jitter_ms", percent)
        done = judge(
            *("--bench", bench(tmp_path, jitter_ms)),
            *("--fault", off, "--select", ITEM),
        )
        (item,) = done.record["items"]
        seen.append(item["verdict"])
    assert " ".join(seen) == words


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        ((), "pass pass inconclusive inconclusive"),
        (("--fault", "tpdo-inhibit-time-ignored"), "fail fail fail inconclusive"),
    ],
)
def test_tpdos_apart_by_an_inhibit_time(
    judge: Callable[..., Any], tmp_path: Path, faults: tuple[str, ...], words: str
) -> None:
    seen = []
    for jitter_ms in (0, 1, 30, 400):
        given = ("--bench", bench(tmp_path, jitter_ms), "--select", "TPDO-11", *faults)
        done = judge(*given, device="baumer_gim140r")
        seen.append(done.record["items"][0]["verdict"])
    assert " ".join(seen) == words
