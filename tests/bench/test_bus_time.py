"""What a run needs of the bus' time: each moment of waits and frames once, and nothing of its own."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

from conformance.bench.bus.bus_time import BusTime
from conformance.wire.frame import Frame, bit_length

FRAME = Frame(0x632, bytes.fromhex("4018100100000000"))
BITRATE = 125_000
LENGTH_S = bit_length(FRAME) / BITRATE


@pytest.fixture
def bus_time() -> BusTime:
    return BusTime(BITRATE)


def test_waits_that_overlap_count_once(bus_time: BusTime) -> None:
    for start_s, end_s in ((1.0, 2.0), (1.5, 2.5), (2.0, 2.2), (4.0, 5.0), (4.5, 4.5)):
        bus_time.awaited(start_s, end_s)

    assert bus_time.needed_s == pytest.approx(2.5)
    assert bus_time.frames_s == 0


def test_a_frame_counts_where_nothing_was_awaited(bus_time: BusTime) -> None:
    bus_time.awaited(1.0, 2.0)
    bus_time.received(FRAME, 1.0, 2.0)
    assert bus_time.needed_s == pytest.approx(1.0)

    bus_time.received(FRAME, 3.0, 3.0)
    assert bus_time.needed_s == pytest.approx(1.0 + LENGTH_S)
    assert bus_time.frames_s == pytest.approx(2 * LENGTH_S)


def test_frames_handed_over_together_follow_each_other(bus_time: BusTime) -> None:
    for _ in range(3):
        bus_time.sent(FRAME, 1.0)
    bus_time.awaited(1.0, 1.0 + LENGTH_S)

    assert bus_time.needed_s == pytest.approx(3 * LENGTH_S)


def test_a_frame_is_as_long_as_the_bit_rate_makes_it(bus_time: BusTime) -> None:
    bus_time.sent(FRAME, 1.0)
    bus_time.bitrate = 2 * BITRATE
    bus_time.sent(FRAME, 2.0)

    assert bus_time.frames_s == pytest.approx(1.5 * LENGTH_S)


def test_a_run_that_takes_no_time_of_its_own_needs_what_it_takes(
    judge: Callable[..., Any],
) -> None:
    finished = judge("--select", "BOOT-01 or HB-01 or OD-03 or NMT-01 or BIT-01")

    run = finished.record["run"]
    assert run["clock"] == "virtual"
    assert run["bus_time"]["taken_s"] == run["simulated_s"]
    assert run["bus_time"]["needed_s"] == pytest.approx(run["simulated_s"], abs=0.01)
    assert 0 < run["bus_time"]["frames_s"] < run["bus_time"]["needed_s"]
    assert "times as fast as real" in finished.out


def test_in_real_time_what_was_needed_stands_beside_what_was_taken(
    judge: Callable[..., Any],
) -> None:
    finished = judge(
        "--bench", "simulator-real-time", "--select", "HB-01/1017h/10ms or OD-03/1000h"
    )

    run = finished.record["run"]
    needed_s, taken_s = run["bus_time"]["needed_s"], run["bus_time"]["taken_s"]
    assert run["clock"] == "real"
    assert 0.2 < needed_s <= taken_s
    words = f"bus time needed {needed_s:.1f} s, taken {taken_s:.1f} s"
    assert re.search(rf"{re.escape(words)} \(\d+\.\d\d\)$", finished.out, re.MULTILINE)
