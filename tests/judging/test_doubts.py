"""Recordings written by hand, each with one thing that a recorder did and a device did not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from recorded_by_hand import verdict_of

READ = "632#4018100100000000"
VALUE = "5B2#4318100107010000"
WRITE = "632#2318100101000000"
ABORT = "5B2#8018100102000106"
HEARTBEAT_100 = ("632#2B17100064000000", "5B2#6017100000000000")
MISSING = (4, 8, 12)


def _beats(period_s: float, left_out: Sequence[int] = ()) -> list[tuple[float, str]]:
    return [(0.002 + n * period_s, "732#7F") for n in range(1, 16) if n not in left_out]


def _set_up() -> list[tuple[float, str]]:
    return [(0.0, HEARTBEAT_100[0]), (0.002, HEARTBEAT_100[1])]


@pytest.mark.parametrize(("times", "verdict"), [(1, "inconclusive"), (2, "fail")])
def test_what_one_gap_can_make_is_told_from_what_it_cannot(
    times: int, verdict: str, tmp_path: Path
) -> None:
    # the response to the first request and the second request may both be lost
    frames = [(n + part, it) for n in range(times) for part, it in ((0.0, READ), (0.002, ABORT))]

    assert verdict_of(frames, "OD-02/1018h:01", tmp_path) == verdict


def test_responses_written_before_their_requests_decide_nothing(tmp_path: Path) -> None:
    order = (VALUE, READ, ABORT, WRITE)
    frames = [(n + place / 1000, it) for n in range(3) for place, it in enumerate(order)]

    assert verdict_of(frames, "OD-02/1018h:01", tmp_path) == "inconclusive"


def test_heartbeats_that_the_recorder_lost_decide_nothing(tmp_path: Path) -> None:
    frames = [*_set_up(), *_beats(0.1, MISSING)]

    assert verdict_of(frames, "HB-01/1017h/100ms", tmp_path) == "inconclusive"


def test_a_slow_heartbeat_fails_with_heartbeats_lost(tmp_path: Path) -> None:
    frames = [*_set_up(), *_beats(0.12, MISSING)]

    assert verdict_of(frames, "HB-01/1017h/100ms", tmp_path) == "fail"


def test_a_period_fails_in_no_recording_that_shows_losses_elsewhere(tmp_path: Path) -> None:
    frames = [*_set_up(), *_beats(0.12), (9.0, VALUE)]

    assert verdict_of(frames, "HB-01/1017h/100ms", tmp_path) == "inconclusive"


def test_a_period_that_nothing_tells_decides_nothing(tmp_path: Path) -> None:
    frames = [(0.001, "000#0101"), *((0.01 + n * 0.13, "181#00000000") for n in range(15))]

    assert verdict_of(frames, "TPDO-02/1800h/100ms", tmp_path, "baumer_gim140r") == "inconclusive"


def test_what_was_told_in_another_recording_of_the_file_decides_nothing(tmp_path: Path) -> None:
    earlier = [(50 + time_s, frame) for time_s, frame in _set_up()]

    assert verdict_of([*earlier, *_beats(0.12)], "HB-01/1017h/100ms", tmp_path) != "fail"
    assert verdict_of([*_set_up(), *_beats(0.12)], "HB-01/1017h/100ms", tmp_path) == "fail"


POLL = "632#4000100000000000"
POLLED = "5B2#4300100019010307"
BOOT_UP = "732#00"


def _slow_after_start(start: Sequence[tuple[float, str]]) -> list[tuple[float, str]]:
    """Return a recording that begins so, and shows a heartbeat that is 20 % slow later on."""
    later = [*_set_up(), *_beats(0.12)]
    return [*start, *((2 + time_s, frame) for time_s, frame in later)]


@pytest.mark.parametrize("every_s", [0.05, 0.15, 0.5])
@pytest.mark.parametrize("before", [[], [(0.0, POLL), (0.002, POLLED)]])
def test_a_master_that_asks_before_the_node_is_up_makes_nothing_doubtful(
    before: Sequence[tuple[float, str]], every_s: float, tmp_path: Path
) -> None:
    asked = [(0.01 + n * every_s, POLL) for n in range(3)]
    start = [*before, *asked, (1.2, BOOT_UP), (1.21, POLL), (1.212, POLLED)]

    assert verdict_of(_slow_after_start(start), "HB-01/1017h/100ms", tmp_path) == "fail"


@pytest.mark.parametrize(
    "start",
    [
        pytest.param([(0.01, POLL), (0.5, POLL), (0.502, POLLED)], id="it was up"),
        pytest.param([(0.01, POLL), (0.5, "181#00"), (0.6, "1B2#00"), (1.2, BOOT_UP)], id="alive"),
        pytest.param([(0.01, WRITE), (1.2, BOOT_UP)], id="it may have been told something"),
    ],
)
def test_requests_that_are_not_answered_otherwise_make_times_doubtful(
    start: Sequence[tuple[float, str]], tmp_path: Path
) -> None:
    assert verdict_of(_slow_after_start(start), "HB-01/1017h/100ms", tmp_path) == "inconclusive"
