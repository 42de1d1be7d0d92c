"""Timestamps of frames: who makes them, and how late each may be.

An interval between two frames is known no better than their timestamps. A bus' own clock is exact. An
adapter or a kernel stamps a frame when it is there; how far its stamps may be off is a figure of the
bench. Where nobody stamps, the suite does when it takes a frame over: then it came no earlier than when
nothing was there yet, and no earlier than the end of the frame before it and its own length.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from conformance.errors import BenchError

Stamper: TypeAlias = Literal["bus", "adapter", "kernel", "host"]

_STAMPERS: Final[Mapping[str, Stamper]] = {
    "canopen_simulator": "bus",
    "socketcan": "kernel",
    "socketcand": "kernel",
    "pcan": "adapter",
    "kvaser": "adapter",
    "vector": "adapter",
    "ixxat": "adapter",
}
"""Who stamps frames by python-can's interface; the suite itself where none is named."""

_JITTER_MS: Final[Mapping[Stamper, float]] = {
    "bus": 0.0,
    "adapter": 0.1,
    "kernel": 1.0,
    "host": 1.0,
}
"""By how much stamps may be off where the bench's file gives no figure: steps of adapters' clocks; what
users of SocketCAN have seen under load; a frame of USB."""

SLICE_S: Final = 1e-3
"""Where the suite stamps, it looks at least so often whether a frame is there."""

_AT_ONCE_S: Final = 0.005
_STEP_S: Final = 0.05
_DRIFT: Final = 1e-3
"""What the computer's two clocks may differ by from one look to the next, and in proportion to the time."""


def stamper_of(interface: str) -> Stamper:
    """Return who stamps the frames of a python-can interface."""
    return _STAMPERS.get(interface, "host")


def usual_jitter_ms(stamper: Stamper) -> float:
    """Return by how much timestamps may be off where nothing else is known."""
    return _JITTER_MS[stamper]


@dataclass(slots=True)
class Stamps:
    """What is known about the times of frames.

    Args:
        stamper: Who stamps frames.
        jitter_ms: By how much a stamp may be late for what the suite cannot see.
        worst_ms: By how much any stamp may have been late so far, in ms.
    """

    stamper: Stamper
    jitter_ms: float
    worst_ms: float = 0.0
    _empty_s: float = -math.inf
    _earliest_s: float = -math.inf

    @property
    def by_host(self) -> bool:
        """The suite stamps frames itself."""
        return self.stamper == "host"

    def nothing(self, until_s: float) -> None:
        """Note that no frame had come until then."""
        self._empty_s = max(self._empty_s, until_s)

    def late_ms(self, taken_s: float, duration_s: float) -> float:
        """Return by how much the stamp of a frame may be late, in ms.

        Args:
            taken_s: When it was taken over, on the clock of the bench.
            duration_s: Its length on the bus.
        """
        late_ms = self.jitter_ms
        if self.by_host:
            self._earliest_s = max(self._empty_s, self._earliest_s + duration_s)
            late_ms += max(0.0, taken_s - self._earliest_s) * 1000
        self.worst_ms = max(self.worst_ms, late_ms)
        return late_ms

    def summary(self) -> dict[str, str | float]:
        """Return who stamped frames, and by how much stamps may have been late at most, in ms."""
        return {"by": self.stamper, "late_ms": round(self.worst_ms, 3)}


class WallClock:
    """Notices when the computer slept, or when its clock was set.

    Args:
        now: The clock of the bench, in seconds.
        wall: The clock of timestamps, in seconds.
    """

    def __init__(
        self, now: Callable[[], float] = time.monotonic, wall: Callable[[], float] = time.time
    ) -> None:
        self._now, self._wall = now, wall
        self._seen = self._read()

    def look(self) -> None:
        """Compare the clocks.

        Raises:
            BenchError: They went apart since the last look.
        """
        (now_s, wall_s), seen = self._read(), self._seen
        self._seen = now_s, wall_s
        step_s = wall_s - seen[1] - (now_s - seen[0])
        if abs(step_s) > _STEP_S + _DRIFT * (now_s - seen[0]):
            raise BenchError(
                f"the computer slept or its clock was set, by {step_s:.1f} s: "
                "keep it awake and its clock alone, then run again"
            )

    def _read(self) -> tuple[float, float]:
        """Return both clocks at one moment: read again where something came between."""
        while True:
            before_s, wall_s, after_s = self._now(), self._wall(), self._now()
            if after_s - before_s < _AT_ONCE_S:
                return before_s, wall_s
