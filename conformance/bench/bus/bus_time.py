"""How long a run must take: what it waits for and the frames on the bus, without its own time."""

from __future__ import annotations

from conformance.wire.frame import Frame, bit_length


class BusTime:
    """The time on the bus that a run needs, each moment counted once.

    Needed is what is awaited, to the frame that ends a wait or to the end of its time, and frames
    that come or go while nothing is awaited. The rest of what a run takes is its own doing.

    Args:
        bitrate: In bit/s.

    Attributes:
        bitrate: In bit/s, from now on.
        needed_s: Seconds needed so far.
        frames_s: Seconds of frames so far.
    """

    def __init__(self, bitrate: int) -> None:
        self.bitrate = bitrate
        self.needed_s = 0.0
        self.frames_s = 0.0
        self._until_s = 0.0

    def awaited(self, start_s: float, end_s: float) -> None:
        """Note a wait, on the clock of the bench."""
        start_s = max(start_s, self._until_s)
        if end_s > start_s:
            self.needed_s += end_s - start_s
            self._until_s = end_s

    def sent(self, frame: Frame, time_s: float) -> None:
        """Note a frame handed over at a time; it follows those handed over before."""
        duration_s = self._duration_s(frame)
        start_s = max(time_s, self._until_s)
        self.awaited(start_s, start_s + duration_s)

    def received(self, frame: Frame, start_s: float, end_s: float) -> None:
        """Note a frame, the start of the wait for it and its end, which may have been earlier."""
        duration_s = self._duration_s(frame)
        self.awaited(start_s if start_s < end_s else end_s - duration_s, end_s)

    def _duration_s(self, frame: Frame) -> float:
        duration_s = bit_length(frame) / self.bitrate
        self.frames_s += duration_s
        return duration_s
