"""From a sequence of steps that shows a difference to the shortest one that does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Final, TypeAlias

from conformance.explore.pair import Difference
from conformance.explore.steps import Step, Wait

Steps: TypeAlias = tuple[Step, ...]
Shows: TypeAlias = Callable[[Steps], Difference | None]
"""Takes a device and its model through steps from the beginning; returns what differs."""

FEW: Final = 10
"""Steps of which every two are left out in turn."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A sequence that shows a difference.

    Args:
        steps: The sequence.
        difference: What its last step, or waiting after it, shows.
    """

    steps: Steps
    difference: Difference


def shortest(finding: Finding, shows: Shows) -> Finding | None:
    """Return a sequence without a step, or two, that it could do without; None if it shows nothing.

    Args:
        finding: A sequence that has shown a difference.
        shows: Tries a sequence.
    """
    difference = shows(finding.steps)
    if difference is None:
        return None
    found = Finding(finding.steps, difference)
    size = len(finding.steps) // 2
    while size > 1:
        found = _without_runs(found, shows, size)
        size //= 2
    found = _until_none(found, lambda it: _without_runs(it, shows, 1))
    if len(found.steps) <= FEW:
        found = _until_none(found, lambda it: _first(it, shows, _without_two(it.steps)))
    return _until_none(found, lambda it: _first(it, shows, _waiting_less(it.steps)))


def _until_none(found: Finding, shorten: Callable[[Finding], Finding]) -> Finding:
    """Shorten until that changes nothing."""
    while (shorter := shorten(found)) is not found:
        found = shorter
    return found


def _without_runs(found: Finding, shows: Shows, size: int) -> Finding:
    """Leave out one run of steps after the other, where the rest still shows a difference."""
    start = 0
    while start < len(found.steps):
        steps = found.steps[:start] + found.steps[start + size :]
        difference = shows(steps)
        if difference is None:
            start += size
        else:
            found = Finding(steps, difference)
    return found


def _first(found: Finding, shows: Shows, candidates: Iterator[Steps]) -> Finding:
    """Return the first candidate that shows a difference, else what was found before."""
    for steps in candidates:
        difference = shows(steps)
        if difference is not None:
            return Finding(steps, difference)
    return found


def _without_two(steps: Steps) -> Iterator[Steps]:
    for first, second in combinations(range(len(steps)), 2):
        yield steps[:first] + steps[first + 1 : second] + steps[second + 1 :]


def _waiting_less(steps: Steps) -> Iterator[Steps]:
    for place, step in enumerate(steps):
        if isinstance(step, Wait) and step.ms > 1:
            yield (*steps[:place], Wait(step.ms // 2), *steps[place + 1 :])
