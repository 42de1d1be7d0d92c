"""Series of lots, which several stations share: what became of each lot, in the order of its first noting."""

from __future__ import annotations

from sqlalchemy import ColumnElement, delete, select, update

from conformance.history.database import Database
from conformance.history.schema import concluded
from conformance.report.printable import printable

MOST_OF_A_NAME = 1000


def lots_of(database: Database, series: str) -> list[str]:
    """Return what was noted of each lot of a series; nothing where nobody knows the series.

    Raises:
        BenchError: The database fails.
    """
    query = select(concluded.c.content).where(concluded.c.series == _name(series))
    with database.reading() as connection:
        return list(connection.execute(query.order_by(concluded.c.id)).scalars())


def note(database: Database, series: str, lot: str, content: str) -> None:
    """Note what became of a lot, in its place if it was noted before.

    Args:
        database: The history.
        series: Name of its series.
        lot: Its name in the series.
        content: What became of it, in ASCII.

    Raises:
        BenchError: The database fails.
    """
    values = {"series": _name(series), "lot": _name(lot), "content": content}
    with database.writing() as connection:
        if not database.insert_missing(connection, concluded, values, "series", "lot"):
            there = _there(series, lot)
            connection.execute(update(concluded).where(there).values(content=content))


def withdraw(database: Database, series: str, lot: str) -> None:
    """Take back what was noted of a lot, if anything was.

    Raises:
        BenchError: The database fails.
    """
    with database.writing() as connection:
        connection.execute(delete(concluded).where(_there(series, lot)))


def _there(series: str, lot: str) -> ColumnElement[bool]:
    return (concluded.c.series == _name(series)) & (concluded.c.lot == _name(lot))


def _name(text: str) -> str:
    return printable(text, MOST_OF_A_NAME)
