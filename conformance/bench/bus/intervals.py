"""Times between frames that come again and again, on a bus that others use as well.

A frame is stamped when it has been sent. On a loaded bus it may have waited before, and nobody but its
node knows how long: what is judged is the time nearest to the expected one that the waits allow.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from conformance.bench.bus.link import Link, Stamped


def gaps_ms(link: Link, seen: Sequence[Stamped], near_ms: float) -> list[float]:
    """Return the times from one frame to the next, in ms, as near to a figure as waits allow."""
    return [apart_ms(link, first, second, near_ms) for first, second in pairwise(seen)]


def mean_ms(link: Link, seen: Sequence[Stamped], near_ms: float) -> list[float]:
    """Return the mean time from one frame to the next as a list of one; empty for fewer than two."""
    count = len(seen) - 1
    if count < 1:
        return []
    return [apart_ms(link, seen[0], seen[-1], near_ms * count) / count]


def apart_ms(link: Link, first: Stamped, second: Stamped, near_ms: float) -> float:
    """Return the time between two frames, in ms, as near to a figure as waits allow."""
    between_ms = (second.time_s - first.time_s) * 1000
    low_ms = between_ms - link.longest_wait_s(second) * 1000
    high_ms = between_ms + link.longest_wait_s(first) * 1000
    return min(max(near_ms, low_ms), high_ms)
