"""Simulated devices on a bus that is none: what they send goes out at once, and its medium arbitrates."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from conformance.simulator.segment import SECOND, Segment, Station
from conformance.wire import cob_id
from conformance.wire.frame import Frame, bit_length


class LiveSegment(Segment):
    """The simulated devices of a segment that others are on as well.

    Args:
        send: Hands a frame to the adapter.
        bitrate: In bit/s, for the bus load.
    """

    def __init__(self, send: Callable[[Frame], None], bitrate: int) -> None:
        super().__init__()
        self._send = send
        self._bitrate = bitrate
        self._spoken: deque[tuple[Station, Frame]] = deque()

    def hear(self, frame: Frame) -> None:
        """Hand a frame from the adapter to every device."""
        self._count(frame)
        for station in self._stations:
            self._step(station, (frame,))
        self._spread()

    def run_until(self, limit_ns: int) -> None:
        """Let time pass."""
        self._spread()
        while (wake_ns := self._next_wake_ns()) is not None and wake_ns <= limit_ns:
            self.now_ns = max(self.now_ns, wake_ns)
            self._step_the_woken()
            self._spread()
        self.now_ns = max(self.now_ns, limit_ns)

    def next_event_ns(self) -> int | None:
        """Return when a device next wants to be stepped."""
        return self.now_ns if self._spoken else self._next_wake_ns()

    def _enqueue(self, station: Station, frames: Sequence[Frame]) -> None:
        self._spoken.extend((station, frame) for frame in frames)

    def _discard(self, station: Station) -> None:
        self._spoken = deque(it for it in self._spoken if it[0] is not station)

    def _spread(self) -> None:
        """Send what devices have to send, and let the others among them hear it."""
        while self._spoken:
            sender, frame = self._spoken.popleft()
            self._send(frame)
            self._count(frame)
            if frame.can_id > cob_id.SYNC:
                continue  # what slaves send means nothing to other slaves
            for station in self._stations:
                if station is not sender:
                    self._step(station, (frame,))

    def _count(self, frame: Frame) -> None:
        self.frame_count += 1
        self._busy.append((self.now_ns, bit_length(frame) * SECOND // self._bitrate))
