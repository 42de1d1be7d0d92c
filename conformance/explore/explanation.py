"""Readings of the manual that explain what a device does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TypeAlias

from conformance.errors import SpecError
from conformance.explore.laboratory import Laboratory
from conformance.explore.pair import Difference
from conformance.explore.shortest import Finding, Steps
from conformance.spec.resolve import chosen_readings

Readings: TypeAlias = Mapping[str, int]


def explained(
    laboratory: Laboratory, known: Readings, before: Sequence[Steps], finding: Finding
) -> Readings | None:
    """Return readings under which no sequence shows a difference any more, None if there are none.

    One reading may not be enough: to one that changes what differs another one is added.

    Args:
        laboratory: The device and its model.
        known: The readings that explain the sequences before.
        before: Sequences that have shown a difference.
        finding: The shortest sequence that still shows one.
    """
    helpful: list[Readings] = []
    for readings in _others(laboratory, known):
        difference = _difference(laboratory, finding.steps, readings)
        if difference is None and _explains(laboratory, before, readings):
            return readings
        if difference != finding.difference:
            helpful.append(readings)
    for first in helpful:
        for readings in _others(laboratory, first):
            if _explains(laboratory, (finding.steps, *before), readings):
                return readings
    return None


def _explains(laboratory: Laboratory, shown: Sequence[Steps], readings: Readings) -> bool:
    return all(_difference(laboratory, steps, readings) is None for steps in shown)


def _difference(laboratory: Laboratory, steps: Steps, readings: Readings) -> Difference | None:
    try:
        return laboratory.replay(steps, readings)
    except SpecError as error:
        return Difference("readings", "some that do not exclude each other", str(error))


def _others(laboratory: Laboratory, known: Readings) -> Iterator[Readings]:
    """Return readings of which one open ambiguity is read in another way."""
    ambiguities = laboratory.file.document.ambiguities
    present = chosen_readings(ambiguities, known)
    for it in ambiguities:
        if it.judged_by == "either" and any(reading.changes for reading in it.readings):
            for number in range(1, len(it.readings) + 1):
                if number != present[it.id]:
                    yield {**known, it.id: number}
