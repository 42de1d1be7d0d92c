"""Which reading of an ambiguous manual a device was seen to follow."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from conformance.report.record import Ambiguity, Record


@dataclass(frozen=True, slots=True)
class Followed:
    """A place of the manual that can be read in several ways.

    Args:
        place: What the manual says there.
        shown_by: Number of a reading, from 1, to the items that show it; empty if none does.
    """

    place: Ambiguity
    shown_by: dict[int, Sequence[str]]


def followed(record: Record) -> list[Followed]:
    """Return every ambiguity that is open: first those of which the run shows something."""
    shown: dict[str, dict[int, list[str]]] = defaultdict(lambda: defaultdict(list))
    for item in record.items:
        for name, number in item.readings.items():
            shown[name][number].append(item.id)
    places = {it.id: it for it in record.manual.ambiguities}
    for name, numbers in shown.items():
        untold = [f"reading {n}" for n in range(1, max(numbers) + 1)]
        what = "The record does not hold what the manual says there."
        places.setdefault(name, Ambiguity(id=name, source=[], what=what, readings=untold))
    found = [Followed(it, dict(sorted(shown[it.id].items()))) for it in places.values()]
    return sorted(found, key=lambda it: not it.shown_by)
