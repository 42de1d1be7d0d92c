"""What the command line does with the history; with the database, which takes long to load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path

from conformance.errors import BenchError, SpecError
from conformance.history import asking, pages, series
from conformance.history.database import Database
from conformance.history.keeping import enter, keep_lot, numbers_of, place_unit
from conformance.history.lot import Lot
from conformance.report.console import console
from conformance.report.printable import printable
from conformance.report.record import read_record


class Entering:
    """Enters what is being judged, and says so.

    Args:
        url: Of the database.
        create: Make what does not exist yet.

    Raises:
        SpecError: The database is none of this suite.
        BenchError: It cannot be opened.
    """

    def __init__(self, url: str, *, create: bool = True) -> None:
        self._url = url
        self._create = create
        self._open().close()

    def run(self, place: Path) -> None:
        """Enter a finished run.

        Raises:
            BenchError: The database fails.
        """
        try:
            with closing(self._open()) as database:
                enter(database, read_record(place))
                console.say(f"history: {database.name}")
        except BenchError as error:
            again = f"canopen-conformance history add {place}"
            raise BenchError(f"{error}; the record is there, try: {again}") from error

    def lot(self, lot: Lot, runs: Mapping[int, Sequence[Path]]) -> None:
        """Enter a lot, which unit stands at which place of it, and all runs of its units.

        Args:
            lot: What is known of it.
            runs: Folders of the runs, by the unit's place from 1.

        Raises:
            BenchError: The database fails.
        """
        with closing(self._open()) as database:
            keep_lot(database, lot)
            for place, folders in runs.items():
                for record in map(read_record, folders):
                    enter(database, record)
                    label, told = numbers_of(record)
                    if label or told:
                        place_unit(database, lot.name, place, record.device.spec, label, told)
            console.say(f"history: {database.name}")

    def series(self, name: str) -> list[str]:
        """Return what was noted of each lot of a series; see `conformance.history.series`."""
        with closing(self._open()) as database:
            return series.lots_of(database, name)

    def conclude(self, name: str, lot: str, content: str | None) -> None:
        """Note what became of a lot of a series, None for nothing yet; see `conformance.history.series`."""
        with closing(self._open()) as database:
            if content is None:
                series.withdraw(database, name, lot)
            else:
                series.note(database, name, lot, content)

    def _open(self) -> Database:
        return Database(self._url, create=self._create)


def add(places: Sequence[Path], url: str) -> None:
    """Enter finished runs, and say how many were new.

    Raises:
        SpecError: There is none, or one is no record.
        BenchError: The database fails.
    """
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


def show(url: str, serial: str, lot: str, export: Path | None) -> None:
    """Tell what is known of a unit, of a lot, or of all.

    Raises:
        SpecError: There is no such unit, lot or database.
        BenchError: The database fails.
    """
    with closing(Database(url, create=False)) as database, database.reading() as connection:
        condition = asking.of_serial(serial) if serial else None
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
            pages.print_names(found, console)
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
