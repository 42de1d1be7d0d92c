"""What can be asked of the history."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from sqlalchemy import ColumnElement, Connection, Row, case, func, select

from conformance.history.schema import deviations, lots, places, runs, units
from conformance.history.units import called

MOST_LOTS: Final = 20
MOST_DEVIATIONS: Final = 10


@dataclass(frozen=True, slots=True)
class LotUnit:
    """A unit of a lot.

    Args:
        place: In the lot.
        device: Name of its spec.
        serial: Its serial number.
        runs: How many runs there are of it.
        verdict: Of the last one; empty without any.
        deviations: Of the last one.
        started: When that was.
    """

    place: int
    device: str
    serial: str
    runs: int
    verdict: str
    deviations: int
    started: str


def by_device(connection: Connection) -> Sequence[Row[Any]]:
    """Return for each device the number of its runs and units, its verdicts, its first and last run."""
    words = [
        func.sum(case((runs.c.verdict == word, 1), else_=0)).label(word)
        for word in ("conforms", "deviates", "inconclusive")
    ]
    query = select(
        runs.c.device,
        func.count().label("runs"),
        func.count(runs.c.unit_id.distinct()).label("units"),
        *words,
        func.min(runs.c.started).label("first"),
        func.max(runs.c.started).label("last"),
    )
    return connection.execute(query.group_by(runs.c.device).order_by(runs.c.device)).all()


def most_frequent(connection: Connection) -> Sequence[Row[Any]]:
    """Return the items that deviate in most runs."""
    count = func.count().label("runs")
    query = (
        select(deviations.c.item, count)
        .group_by(deviations.c.item)
        .order_by(count.desc(), deviations.c.item)
        .limit(MOST_DEVIATIONS)
    )
    return connection.execute(query).all()


def newest_lots(connection: Connection) -> Sequence[Row[Any]]:
    """Return the lots that were kept last."""
    return connection.execute(select(lots).order_by(lots.c.id.desc()).limit(MOST_LOTS)).all()


def lot_named(connection: Connection, name: str) -> Row[Any] | None:
    """Return a lot."""
    return connection.execute(select(lots).where(lots.c.name == name)).one_or_none()


def units_of(connection: Connection, lot: int) -> list[LotUnit]:
    """Return the units of a lot by their places."""
    of = runs.c.unit_id
    newest = func.row_number().over(
        partition_by=of, order_by=(runs.c.started.desc(), runs.c.id.desc())
    )
    of_lot = of.in_(select(places.c.unit_id).where(places.c.lot_id == lot))
    ranked = (
        select(
            of,
            runs.c.verdict,
            runs.c.deviations,
            runs.c.started,
            func.count().over(partition_by=of).label("runs"),
            newest.label("rank"),
        )
        .where(of_lot)
        .subquery()
    )
    query = (
        select(
            places.c.place,
            units.c.device,
            units.c.serial,
            func.coalesce(ranked.c.runs, 0),
            func.coalesce(ranked.c.verdict, ""),
            func.coalesce(ranked.c.deviations, 0),
            func.coalesce(ranked.c.started, ""),
        )
        .join(units, units.c.id == places.c.unit_id)
        .outerjoin(ranked, (ranked.c.unit_id == units.c.id) & (ranked.c.rank == 1))
        .where(places.c.lot_id == lot)
        .order_by(places.c.place)
    )
    return [LotUnit(*row) for row in connection.execute(query)]


def of_serial(serial: str) -> ColumnElement[bool]:
    """Return the condition that a run is of a unit with a serial number, on its label or told by its node."""
    return runs.c.unit_id.in_(called(serial))


def of_lot(lot: int) -> ColumnElement[bool]:
    """Return the condition that a run is of a unit of a lot."""
    return runs.c.unit_id.in_(select(places.c.unit_id).where(places.c.lot_id == lot))


def runs_where(
    connection: Connection, condition: ColumnElement[bool] | None = None
) -> Iterator[Row[Any]]:
    """Return runs with their serial numbers, the oldest first; all of them without a condition."""
    query = select(runs, units.c.serial).outerjoin(units, units.c.id == runs.c.unit_id)
    if condition is not None:
        query = query.where(condition)
    ordered = query.order_by(runs.c.started, runs.c.id)
    yield from connection.execution_options(yield_per=1000).execute(ordered)


def deviations_where(
    connection: Connection, condition: ColumnElement[bool] | None = None
) -> dict[int, list[str]]:
    """Return run to the items that deviate in it."""
    query = select(deviations.c.run_id, deviations.c.item)
    if condition is not None:
        query = query.where(deviations.c.run_id.in_(select(runs.c.id).where(condition)))
    found: dict[int, list[str]] = {}
    for run, item in connection.execute(query.order_by(deviations.c.run_id, deviations.c.item)):
        found.setdefault(run, []).append(item)
    return found
