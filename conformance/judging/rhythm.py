"""Frames that come again and again, in a recording that may lack some of them.

An interval is explained by the period, or by several of them where the recording lacks frames between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from conformance.checks.limits import gap_tolerance_ms, mean_tolerance_ms
from conformance.judging.recording import Seen
from conformance.judging.timeline import Timeline
from conformance.verdict import Verdict

FEWEST = 5
"""Intervals from which a period is told."""

UNEXPLAINED = 3
"""So many intervals that no lost frame explains no step of the recorder's clock brings about either."""

TWICE_MS = 0.1
"""What is nearer than that is one frame that was recorded twice."""


@dataclass(frozen=True, slots=True)
class Rhythm:
    """Frames that should keep a period.

    Args:
        gaps_ms: Between one and the next, as near to the period as waits for the bus allow.
        period_ms: What they should be.
        doubt: Why the recording does not decide, where it does not; empty if it does.
    """

    gaps_ms: tuple[float, ...]
    period_ms: int
    doubt: str

    def judge(self, verdict: Verdict, what: str) -> None:
        """Judge the intervals and their mean."""
        period_ms, count = self.period_ms, len(self.gaps_ms)
        mean_ms = sum(self.gaps_ms) / count
        tolerance_ms = gap_tolerance_ms(period_ms)
        verdict.within(f"{what} period", self.gaps_ms, period_ms, tolerance_ms, unit="ms")
        tolerance_ms = mean_tolerance_ms(period_ms)
        verdict.within(
            f"mean {what} period", [mean_ms], period_ms, tolerance_ms, unit="ms", over=count
        )


def rhythm(
    timeline: Timeline, frames: Sequence[Seen], period_ms: int, *, faster: str = ""
) -> Rhythm | None:
    """Return how some frames keep a period; None where they are too few to tell.

    Args:
        timeline: The recording they are from.
        frames: In their order, with nothing between that may change the period.
        period_ms: What it should be.
        faster: What may make them come earlier without a deviation, empty if nothing may.
    """
    gaps_ms = tuple(
        _gap_ms(timeline, first, second, period_ms) for first, second in pairwise(frames)
    )
    if len(gaps_ms) < FEWEST or period_ms <= 0:
        return None
    around_ms = gap_tolerance_ms(period_ms) + timeline.jitter_ms
    doubt = ""
    strange = [gap for gap in gaps_ms if not _explained(gap, period_ms, around_ms)]
    missing = sum(gap > period_ms + around_ms for gap in gaps_ms) - sum(
        gap > period_ms for gap in strange
    )
    if any(gap < TWICE_MS for gap in gaps_ms):
        doubt = "the recording has frames twice"
    elif strange and faster and all(gap < period_ms for gap in strange):
        doubt = faster
    elif strange and len(strange) < UNEXPLAINED:
        doubt = f"only {len(strange)} of {len(gaps_ms)} intervals are so"
    elif not strange and missing:
        doubt = f"{missing} of {len(gaps_ms)} intervals are multiples of it, as if frames were lost"
    return Rhythm(gaps_ms, period_ms, doubt)


def _explained(gap_ms: float, period_ms: int, around_ms: float) -> bool:
    periods = max(1, round(gap_ms / period_ms))
    return abs(gap_ms - periods * period_ms) <= around_ms * periods


def _gap_ms(timeline: Timeline, first: Seen, second: Seen, near_ms: float) -> float:
    """Return the time between two frames, as near to a figure as waits for the bus allow."""
    recording, jitter_s = timeline.recording, timeline.jitter_ms / 1000
    between_ms = (second.time_s - first.time_s) * 1000
    low_ms = between_ms - recording.waited_s(second, timeline.bitrate, jitter_s) * 1000
    high_ms = between_ms + recording.waited_s(first, timeline.bitrate, jitter_s) * 1000
    return min(max(near_ms, low_ms), high_ms)
