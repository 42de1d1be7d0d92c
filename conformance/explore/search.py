"""The search: random sequences of steps until one shows a difference."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Final

from conformance.explore.choices import Choices
from conformance.explore.laboratory import Laboratory
from conformance.explore.pair import Difference
from conformance.explore.shortest import Finding
from conformance.explore.steps import Step
from conformance.explore.themes import course

LONGEST: Final = 60
"""Steps of one sequence at most."""


@dataclass(slots=True)
class Searched:
    """How far a search has come.

    Attributes:
        steps: Taken until a difference was found, or all of them.
        sequences: As many were begun.
        finding: A sequence that shows a difference.
    """

    steps: int = 0
    sequences: int = 0
    finding: Finding | None = None


def search(
    laboratory: Laboratory,
    choices: Choices,
    readings: Mapping[str, int],
    budget: int,
    number: int,
) -> Searched:
    """Take a device and its model through random steps.

    Args:
        laboratory: Where they are.
        choices: What steps there are.
        readings: What the model follows, where not as judged.
        budget: How many steps to take at most.
        number: Seed of the choice.
    """
    searched = Searched()
    chance = random.Random(number)  # noqa: S311 - sequences that can be repeated, no secrets
    while searched.steps < budget and searched.finding is None:
        searched.sequences += 1
        taken: list[Step] = []
        planned = islice(course(choices, chance), min(LONGEST, budget - searched.steps))
        found = _difference(laboratory, readings, planned, taken)
        searched.steps += len(taken)
        if found is not None:
            searched.finding = Finding(tuple(taken), found)
    return searched


def _difference(
    laboratory: Laboratory, readings: Mapping[str, int], planned: Iterator[Step], taken: list[Step]
) -> Difference | None:
    """Take a device and its model through steps until they differ or part."""
    with laboratory.pair(readings) as pair:
        for step in planned:
            taken.append(step)
            found = pair.take(step)
            if found is not None or pair.parted:
                return found
        return pair.end()
