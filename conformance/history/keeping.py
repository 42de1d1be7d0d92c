"""Enters runs and lots into the history.

A lot is kept once it is known and again whenever more is known of it; its units get their places one by
one, before or after they were judged:

    database = Database(create=True)
    keep_lot(database, Lot("4500017", part="incl-360", order="4500017", size=50, plan="II, AQL 0.65: n 20"))
    place_unit(database, "4500017", 7, "DEVICE", "40117")
    enter(database, read_record(folder))
    keep_lot(database, replace(lot, verdict="accepted", decided="2026-01-31T10:00:00+00:00"))
"""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import Final

from sqlalchemy import insert, select, update

from conformance.errors import SpecError
from conformance.history.database import Database
from conformance.history.lot import Lot
from conformance.history.schema import deviations, lots, places, runs
from conformance.history.units import unit_of
from conformance.report.printable import printable
from conformance.report.record import Record

_NUMBER: Final = re.compile(r"[0-9A-F]{2}( [0-9A-F]{2}){3}")
_SERIAL_NUMBER: Final = "1018h:04"
_FIRMWARE: Final = "100Ah"


def enter(database: Database, record: Record) -> bool:
    """Enter a run with its unit and its deviations, all of it or nothing.

    Returns:
        False if the same record was there already.

    Raises:
        BenchError: The database fails.
    """
    label, told = numbers_of(record)
    with database.writing() as connection:
        if not database.insert_missing(connection, runs, _run(record), "sha256"):
            return False
        unit = unit_of(database, connection, record.device.spec, label, told)
        this = runs.c.sha256 == record.sha256
        names = {"unit_id": unit, "label": printable(label), "told": told}
        connection.execute(update(runs).where(this).values(names))
        number = connection.execute(select(runs.c.id).where(this)).scalar_one()
        if found := _deviations(record, number):
            connection.execute(insert(deviations), found)
    return True


def keep_lot(database: Database, lot: Lot) -> None:
    """Keep what is known of a lot, in place of what was known before.

    Raises:
        BenchError: The database fails.
    """
    values = {
        name: value if isinstance(value, int) else printable(value)
        for name, value in asdict(lot).items()
    }
    values["order_number"] = values.pop("order")
    with database.writing() as connection:
        if not database.insert_missing(connection, lots, values, "name"):
            connection.execute(update(lots).where(lots.c.name == values["name"]).values(values))


def place_unit(
    database: Database, lot: str, place: int, device: str, label: str, told: str = ""
) -> None:
    """Keep which unit stands at a place of a lot.

    Args:
        database: The history.
        lot: Its name.
        place: From 1.
        device: Name of the unit's spec.
        label: The unit's serial number, as a person read it; empty without one.
        told: The same as its node tells it; empty if it does not.

    Raises:
        SpecError: There is no such lot.
        BenchError: The database fails.
    """
    with database.writing() as connection:
        number = connection.execute(
            select(lots.c.id).where(lots.c.name == printable(lot))
        ).scalar_one_or_none()
        if number is None:
            raise SpecError(f"{database.name}: expected the lot {lot!r}, got none of that name")
        unit = unit_of(database, connection, device, label, told)
        assert unit is not None  # it goes by one of the two
        values = {"lot_id": number, "place": place, "unit_id": unit}
        if not database.insert_missing(connection, places, values, "lot_id", "place"):
            there = (places.c.lot_id == number) & (places.c.place == place)
            connection.execute(update(places).where(there).values(unit_id=unit))


def numbers_of(record: Record) -> tuple[str, str]:
    """Return a unit's serial number as a person read it and as the node told it; empty where one did not."""
    told = record.device.serial_told
    if told is None:  # a record of an older version
        text = record.device.identity.get(_SERIAL_NUMBER, "")
        number = int.from_bytes(bytes.fromhex(text), "little") if _NUMBER.fullmatch(text) else 0
        told = str(number)
    return record.device.serial.strip(), "" if told == "0" else printable(told)


def verdict_of(record: Record) -> str:
    """Return the run in one word as its items bear it out."""
    if any(map(record.deviates, record.items)):
        return "deviates"
    return "conforms" if record.summary.verdict == "conforms" else "inconclusive"


def _run(record: Record) -> dict[str, str | int | bool]:
    told = record.run
    texts = {
        "device": record.device.spec,
        "variant": record.device.variant,
        "started": str(told.get("started", "")),
        "selected": str(told.get("select", "")),
        "suite": str(told.get("suite", "")),
        "spec_sha256": str(told.get("spec_sha256", "")),
        "firmware": record.device.identity.get(_FIRMWARE, ""),
        "bench": str(told.get("bench", "")),
        "path": str(record.path.resolve()),
    }
    return {name: printable(text, 1000) for name, text in texts.items()} | {
        "sha256": record.sha256,
        "verdict": verdict_of(record),
        "complete": record.summary.complete,
        "items": len(record.items),
        "deviations": sum(map(record.deviates, record.items)),
        "simulated": told.get("interface") == "canopen_simulator",
    }


def _deviations(record: Record, run: int) -> list[dict[str, str | int]]:
    """Return a row for each item that deviates; an item that is there twice counts once."""
    found = {item.id: item for item in record.items if record.deviates(item)}
    return [
        {
            "run_id": run,
            "item": printable(item.id, 1000),
            "quantity": printable(item.quantity),
            "expected": printable(item.expected),
            "actual": printable(item.actual),
            "unit": printable(item.unit),
        }
        for item in found.values()
    ]
