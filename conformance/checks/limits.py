"""How far a period may be off.

Neither the manuals nor CiA 301 give a tolerance. These are the suite's own, wide enough for the
timer tick of a small controller and a frame that waits for the bus, and narrow enough to show a
timer that is ten per cent slow.
"""

from __future__ import annotations

from collections.abc import Sequence

_MEAN = 0.05
_GAP = 0.05
_TICK_MS = 2.0


def gap_tolerance_ms(period_ms: float) -> float:
    """Return how far one interval may be from the period: 5 % and 2 ms."""
    return period_ms * _GAP + _TICK_MS


def mean_tolerance_ms(period_ms: float) -> float:
    """Return how far the mean of many intervals may be from the period: 5 %."""
    return period_ms * _MEAN


def mean(values: Sequence[float]) -> list[float]:
    """Return the mean as a list of one, empty for no values."""
    return [sum(values) / len(values)] if values else []
