"""What the units of a lot have in common, and which stand out."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from conformance.lots.inspection import Inspection, Numbers, Try, Unit

FEW: Final = 8
"""Units below which neither a capability nor a drift nor an outlier is told."""

DRIFT_Z: Final = 4.0
"""A correlation so many standard deviations from none (Fisher's z) is told as a drift."""

OUTLIER: Final = 5.0
"""A modified z-score so great makes an outlier."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A measured quantity over the units of a lot; a unit counts with the mean of its values.

    Args:
        item: Item that measured it.
        quantity: What.
        unit: Of the numbers.
        least: They may not be below it; None without such a limit.
        most: They may not be above it; None without such a limit.
        units: How many units told it.
        mean: Of the units.
        spread: Standard deviation over the units.
        lowest: Of all values of all units.
        highest: Of all values of all units.
        cpk: Distance of the mean from the nearer limit in three spreads; None with few units or no spread.
        drift_per_unit: Slope over the serial numbers, or places; None where there is no clear one.
        outliers: Units far from the others.
    """

    item: str
    quantity: str
    unit: str
    least: float | None
    most: float | None
    units: int
    mean: float
    spread: float
    lowest: float
    highest: float
    cpk: float | None
    drift_per_unit: float | None
    outliers: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Serials:
    """Serial numbers as the units told them, against the list.

    Args:
        told: How many units told one.
        twice: Told by more than one unit.
        unlisted: Told and not in the list; empty without a list.
        missing: In the list and drawn, judged, and told by no unit; empty without a list.
    """

    told: int
    twice: tuple[str, ...]
    unlisted: tuple[str, ...]
    missing: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Statistics:
    """Of one lot.

    Args:
        judged: Units that were judged, without those declared nonconforming.
        declared: Units that a person declared nonconforming, as no run decides them.
        first_pass: Of them, those that conformed in their first run.
        conforming: Of them, those that conform.
        by_requirement: Requirement to the number of units that deviate from it, the most first.
        by_object: Object, or what else an item is about, to that number.
        quantities: The measured ones, the least capable first.
        serials: As told by the units.
    """

    judged: int
    declared: int
    first_pass: int
    conforming: int
    by_requirement: dict[str, int]
    by_object: dict[str, int]
    quantities: tuple[Quantity, ...]
    serials: Serials

    def as_keys(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return asdict(self)


def statistics_of(inspection: Inspection, listed: Sequence[int] | None) -> Statistics:
    """Return the statistics of an inspection.

    Args:
        inspection: So far.
        listed: Serial numbers of the lot; None where no list tells them.
    """
    judged = [it for it in inspection.units if it.tries and it.declared_so is None]
    telling = [(it.unit, told) for it in judged if (told := it.telling) is not None]
    return Statistics(
        judged=len(judged),
        declared=sum(it.declared_so is not None for it in inspection.units),
        first_pass=sum(it.tries[0].verdict == "conforming" for it in judged if _stays(it)),
        conforming=inspection.count("conforming"),
        by_requirement=_pareto(_deviations(it, 0) for it in judged),
        by_object=_pareto(_deviations(it, 1) for it in judged),
        quantities=tuple(_quantities(telling)),
        serials=_serials(judged, listed),
    )


def _stays(unit: Unit) -> bool:
    return unit.verdict == "conforming"


def _deviations(unit: Unit, part: int) -> set[str]:
    """Return what a unit deviates from: a part of the ids of its failed items, in all its runs."""
    own = (tried for tried in unit.tries if not tried.other)
    ids = (it.split("/") for tried in own for it in tried.deviations)
    return {it[part] for it in ids if len(it) > part}


def _pareto(units: Iterable[set[str]]) -> dict[str, int]:
    counted = Counter(name for names in units for name in names)
    return dict(sorted(counted.items(), key=lambda it: (-it[1], it[0])))


def _quantities(telling: Sequence[tuple[int, Try]]) -> list[Quantity]:
    """Return what was measured, the least capable first."""
    grouped: dict[tuple[Any, ...], list[tuple[int, Numbers]]] = {}
    for unit, tried in telling:
        for it in tried.numbers if tried.verdict != "undecided" else ():
            key = (it.item, it.quantity, it.unit, it.least, it.most)
            grouped.setdefault(key, []).append((unit, it))
    made = [_quantity(values) for values in grouped.values()]
    return sorted(made, key=lambda it: math.inf if it.cpk is None else it.cpk)


def _quantity(values: Sequence[tuple[int, Numbers]]) -> Quantity:
    first, means = values[0][1], [it.mean for _, it in values]
    mean = statistics.fmean(means)
    spread = statistics.stdev(means) if len(means) > 1 else 0.0
    enough = len(means) >= FEW and spread > abs(mean) * 1e-9
    return Quantity(
        item=first.item,
        quantity=first.quantity,
        unit=first.unit,
        least=first.least,
        most=first.most,
        units=len(means),
        mean=mean,
        spread=spread,
        lowest=min(it.lowest for _, it in values),
        highest=max(it.highest for _, it in values),
        cpk=capability(mean, spread, first.least, first.most) if enough else None,
        drift_per_unit=drift([unit for unit, _ in values], means) if enough else None,
        outliers=outliers([(unit, it.mean) for unit, it in values]) if enough else (),
    )


def capability(mean: float, spread: float, least: float | None, most: float | None) -> float:
    """Return Cpk: how far the mean is from the nearer limit, in three spreads; negative outside.

    Args:
        mean: Of the units.
        spread: Standard deviation, more than 0.
        least: Lower limit; one of the two is given.
        most: Upper limit.
    """
    rooms = [mean - least] if least is not None else []
    rooms += [most - mean] if most is not None else []
    return min(rooms) / (3 * spread)


def drift(places: Sequence[int], values: Sequence[float]) -> float | None:
    """Return the slope of values over their places, None where there may be none."""
    if len(set(places)) < 4 or len(set(values)) < 2:
        return None
    correlation = statistics.correlation(places, values)
    if abs(correlation) < 1 and abs(math.atanh(correlation)) * math.sqrt(len(values) - 3) < DRIFT_Z:
        return None
    return statistics.linear_regression(places, values).slope


def outliers(values: Sequence[tuple[int, float]]) -> tuple[int, ...]:
    """Return the units whose value is far from the others, by the modified z-score of Iglewicz and Hoaglin.

    Args:
        values: Units and their values.
    """
    median = statistics.median(value for _, value in values)
    apart = [abs(value - median) for _, value in values]
    scale = statistics.median(apart) * 1.4826 or statistics.fmean(apart) * 1.2533
    if not scale:
        return ()
    return tuple(
        unit for (unit, _), far in zip(values, apart, strict=True) if far / scale > OUTLIER
    )


def _serials(judged: Sequence[Unit], listed: Sequence[int] | None) -> Serials:
    told = {it.unit: it.tries[-1].serial for it in judged if it.tries[-1].serial}
    counted = Counter(told.values())
    known = {str(it) for it in listed or ()}
    missing = () if listed is None else (str(it) for it in told if str(it) not in counted)
    return Serials(
        told=len(told),
        twice=tuple(sorted(it for it, times in counted.items() if times > 1)),
        unlisted=tuple(sorted(it for it in counted if known and it not in known)),
        missing=tuple(missing),
    )
