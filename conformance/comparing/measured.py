"""Figures that changed from one run to another by more than noise.

Noise is what the two runs themselves show: how far the figures of a measurement lie apart within a run, and
by how much either run's timestamps may be late. A single figure tells nothing of its own spread; there the
timestamps are all that is known of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from conformance.report.record import Record

RESPONSE_TIMES: Final = (
    ("median_ms", "SDO response time, median"),
    ("p99_ms", "SDO response time, 99 % within"),
)
_PER_MS: Final[Mapping[str, float]] = {"ms": 1.0, "s": 1e-3, "us": 1e3, "µs": 1e3}
_STEP: Final = 0.1
"""Steps of a decade in the histogram of response times."""


@dataclass(frozen=True, slots=True)
class Shift:
    """A figure that changed.

    Args:
        id: Of the item; empty for one of the whole run.
        quantity: What it is.
        unit: Its unit.
        before: Least and greatest figure of the first run.
        after: Of the second.
        noise: What it would have to change by at least, to be seen.
    """

    id: str
    quantity: str
    unit: str
    before: tuple[float, float]
    after: tuple[float, float]
    noise: float


def shifts(before: Record, after: Record) -> Iterator[Shift]:
    """Return what changed beyond noise, the whole run first.

    A measurement changed where its figures of the two runs leave a gap wider than the noise.
    """
    late_ms = _late_ms(before) + _late_ms(after)
    yield from _response_times(before, after, late_ms)
    old = {item.id: item for item in before.items}
    for item in after.items:
        earlier = _by_quantity(old[item.id].measurements) if item.id in old else {}
        for key, values in _by_quantity(item.measurements).items():
            if key in earlier:
                found = _shift(item.id, *key, earlier[key], values, late_ms)
                if found is not None:
                    yield found


def _response_times(before: Record, after: Record, late_ms: float) -> Iterator[Shift]:
    old, new = (it.run.get("sdo_response_times") for it in (before, after))
    if not isinstance(old, Mapping) or not isinstance(new, Mapping):
        return
    for key, name in RESPONSE_TIMES:
        first, second = _number(old.get(key)), _number(new.get(key))
        if first is None or second is None:
            continue
        noise = max(late_ms, (10**_STEP - 1) * max(first, second))
        if abs(second - first) > noise:
            yield Shift("", name, "ms", (first, first), (second, second), noise)


def _by_quantity(
    measurements: tuple[Mapping[str, Any], ...],
) -> dict[tuple[str, str], tuple[float, ...]]:
    """Return quantity and unit to figures; a quantity that is measured twice is left out."""
    found: dict[tuple[str, str], tuple[float, ...]] = {}
    twice = set()
    for it in measurements:
        key = str(it.get("quantity", "")), str(it.get("unit", ""))
        values = it.get("values")
        if key in found:
            twice.add(key)
        figures = [_number(value) for value in values] if isinstance(values, list) else []
        if figures and None not in figures:
            found[key] = tuple(it for it in figures if it is not None)
    return {key: values for key, values in found.items() if key not in twice}


def _shift(
    id_: str,
    quantity: str,
    unit: str,
    old: tuple[float, ...],
    new: tuple[float, ...],
    late_ms: float,
) -> Shift | None:
    before, after = (min(old), max(old)), (min(new), max(new))
    gap = max(after[0] - before[1], before[0] - after[1])
    spread = max(before[1] - before[0], after[1] - after[0])
    digits = 1e-6 * max(map(abs, (*before, *after)))  # the record has seven
    noise = max(spread, late_ms * _PER_MS.get(unit, 0.0), digits)
    return Shift(id_, quantity, unit, before, after, noise) if gap > noise else None


def _late_ms(record: Record) -> float:
    stamps = record.run.get("timestamps")
    late = _number(stamps.get("late_ms")) if isinstance(stamps, Mapping) else None
    return late or 0.0


def _number(value: object) -> float | None:
    """Return a figure of a record; None where it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)
