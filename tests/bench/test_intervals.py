"""Times between frames, on a bus where they may have waited for others."""

from __future__ import annotations

from collections import deque
from typing import Any

import pytest

from conformance.bench.bus.intervals import gaps_ms, mean_ms
from conformance.bench.bus.link import Link
from conformance.bench.bus.trace import Trace
from conformance.wire.frame import Frame, bit_length

BITRATE = 125_000
HEARTBEAT = Frame(0x732, b"\x05")
PDO = Frame(0x181, bytes(8))
LOW = Frame(0x77F, b"\x05")


class Recorded:
    """A bus on which frames come that were recorded."""

    def __init__(self, *frames: tuple[float, Frame]) -> None:
        self._frames = deque(frames)

    def recv(self, timeout: float | None) -> Any:
        del timeout
        if not self._frames:
            return None
        time_s, frame = self._frames.popleft()
        return Message(time_s, frame)


class Message:
    is_error_frame = is_fd = is_remote_frame = is_extended_id = False
    is_rx = True

    def __init__(self, time_s: float, frame: Frame) -> None:
        self.timestamp = time_s
        self.arbitration_id = frame.can_id
        self.data = frame.data
        self.dlc = frame.dlc


def link_of(*frames: tuple[float, Frame]) -> Link:
    link = Link(Recorded(*frames), Trace(), BITRATE)  # type: ignore[arg-type]  # it has the shape
    link.drain()
    return link


def in_a_row(start_s: float, *frames: Frame) -> list[tuple[float, Frame]]:
    """Return frames without a break between them, the first one begun at a time."""
    ends = []
    for frame in frames:
        start_s += bit_length(frame) / BITRATE
        ends.append((start_s, frame))
    return ends


def beats(link: Link) -> list[Any]:
    return link.since(0, lambda frame: frame == HEARTBEAT)


def duration_ms(frame: Frame) -> float:
    return 1000 * bit_length(frame) / BITRATE


def test_on_an_idle_bus_nothing_is_allowed_for() -> None:
    link = link_of((0.1, HEARTBEAT), (0.15, PDO), (0.213, HEARTBEAT))

    assert gaps_ms(link, beats(link), 100) == pytest.approx([113])
    assert mean_ms(link, beats(link), 100) == pytest.approx([113])


def test_a_frame_may_have_waited_while_others_were_sent_without_a_break() -> None:
    link = link_of((0.1, HEARTBEAT), *in_a_row(0.2, PDO, PDO, PDO, HEARTBEAT))
    late_ms = 100 + 3 * duration_ms(PDO) + duration_ms(HEARTBEAT)

    assert gaps_ms(link, beats(link), 102) == pytest.approx([102])
    assert gaps_ms(link, beats(link), 90) == pytest.approx([late_ms - 3 * duration_ms(PDO)])
    assert gaps_ms(link, beats(link), 120) == pytest.approx([late_ms])


def test_a_frame_that_would_have_lost_shows_that_it_did_not_wait() -> None:
    link = link_of((0.1, HEARTBEAT), *in_a_row(0.2, PDO, LOW, PDO, HEARTBEAT))
    least_ms = 100 + duration_ms(PDO) + duration_ms(HEARTBEAT)

    assert gaps_ms(link, beats(link), 90) == pytest.approx([least_ms])


def test_a_node_may_send_its_frames_in_order() -> None:
    own = Frame(0x7B2, b"\x05")
    link = link_of((0.1, HEARTBEAT), *in_a_row(0.2, PDO, own, HEARTBEAT))

    assert gaps_ms(link, beats(link), 90) == pytest.approx([100 + duration_ms(HEARTBEAT)])


def test_the_mean_allows_for_the_first_and_the_last_frame_alone() -> None:
    late = in_a_row(0.2, PDO, PDO, PDO, HEARTBEAT)
    link = link_of((0.1, HEARTBEAT), *late, (0.32, HEARTBEAT))

    assert mean_ms(link, beats(link), 100) == pytest.approx([110])
    assert mean_ms(link, [], 100) == mean_ms(link, beats(link)[:1], 100) == []
