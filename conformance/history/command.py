"""The command line's `history`: what is known of a unit, a lot, or all of them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Annotated, Final

import typer

from conformance.errors import BenchError, SpecError
from conformance.history import asking, pages
from conformance.history.database import EXPECTED, VARIABLE, Database
from conformance.history.keeping import enter
from conformance.report.console import console
from conformance.report.printable import printable
from conformance.report.record import read_record

ADD: Final = "add"

DatabaseOption = Annotated[
    str,
    typer.Option(metavar="URL", help=f"{EXPECTED}; ${VARIABLE} or a file of your own if absent."),
]


def history(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SERIAL | add RUN...]", help="A unit's serial number, or runs to enter."
        ),
    ] = None,
    lot: Annotated[str, typer.Option(help="The units of this lot.")] = "",
    export: Annotated[
        Path | None, typer.Option(metavar="FILE.csv", help="Write the runs asked for as CSV.")
    ] = None,
    database: DatabaseOption = "",
) -> None:
    """Tell what is known of a unit, of a lot, or of all; or enter runs that are finished."""
    asked = words or []
    if asked[:1] == [ADD]:
        if lot or export:
            raise SpecError("history add: expected runs alone, got --lot or --export as well")
        _add([Path(it) for it in asked[1:]], database)
        return
    if len(asked) > 1 or (asked and lot):
        raise SpecError("history: expected one serial number, or --lot, or add RUN..., got more")
    with closing(Database(database, create=False)) as opened:
        _show(opened, asked[0] if asked else "", lot, export)


def prepare(url: str) -> None:
    """See that runs can be entered, before one begins.

    Raises:
        SpecError: The database is none of this suite.
        BenchError: It cannot be opened.
    """
    Database(url, create=True).close()


def remember(place: Path, url: str) -> None:
    """Enter a finished run, and say so.

    Raises:
        BenchError: The database fails.
    """
    try:
        with closing(Database(url, create=True)) as database:
            enter(database, read_record(place))
            console.say(f"history: {database.name}")
    except BenchError as error:
        again = f"canopen-conformance history add {place}"
        raise BenchError(f"{error}; the record is there, try: {again}") from error


def _add(places: Sequence[Path], url: str) -> None:
    if not places:
        raise SpecError("history add: expected folders of runs, or their results.json, got none")
    records = [read_record(place) for place in places]
    with closing(Database(url, create=True)) as opened:
        entered = sum(enter(opened, record) for record in records)
        there = len(records) - entered
        console.say(
            f"{entered} of {len(records)} runs entered"
            + (f", {there} were there already" if there else "")
            + f": {opened.name}"
        )


def _show(database: Database, serial: str, lot: str, export: Path | None) -> None:
    with database.reading() as connection:
        condition = asking.of_serial(printable(serial)) if serial else None
        if lot:
            known = asking.lot_named(connection, printable(lot))
            if known is None:
                raise SpecError(f"--lot: expected the name of a lot in the history, got {lot!r}")
            condition = asking.of_lot(known.id)
            pages.print_lot(known, asking.units_of(connection, known.id), console)
        elif serial:
            found = list(asking.runs_where(connection, condition))
            if not found:
                raise SpecError(
                    f"SERIAL: expected the serial number of a unit in {database.name}, got {serial!r}"
                )
            pages.print_runs(found, asking.deviations_where(connection, condition), console)
        else:
            pages.print_overview(
                asking.by_device(connection),
                asking.most_frequent(connection),
                asking.newest_lots(connection),
                console,
            )
        if export is not None:
            deviating = asking.deviations_where(connection, condition)
            count = pages.write_csv(export, asking.runs_where(connection, condition), deviating)
            console.say(f"{count} runs: {export}")
