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

from sqlalchemy import Connection, insert, select, update

from conformance.errors import SpecError
from conformance.history.database import Database
from conformance.history.lot import Lot
from conformance.history.schema import deviations, lots, places, runs, units
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
    serial = serial_of(record)
    with database.writing() as connection:
        unit = _unit(database, connection, record.device.spec, serial) if serial else None
        values = _run(record) | {"unit_id": unit}
        if not database.insert_missing(connection, runs, values, "sha256"):
            return False
        number = connection.execute(
            select(runs.c.id).where(runs.c.sha256 == record.sha256)
        ).scalar_one()
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


def place_unit(database: Database, lot: str, place: int, device: str, serial: str) -> None:
    """Keep which unit stands at a place of a lot.

    Args:
        database: The history.
        lot: Its name.
        place: From 1.
        device: Name of the unit's spec.
        serial: The unit's serial number.

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
        unit = _unit(database, connection, device, serial)
        values = {"lot_id": number, "place": place, "unit_id": unit}
        if not database.insert_missing(connection, places, values, "lot_id", "place"):
            there = (places.c.lot_id == number) & (places.c.place == place)
            connection.execute(update(places).where(there).values(unit_id=unit))


def serial_of(record: Record) -> str:
    """Return a unit's serial number: what the user said, else what the node did; empty without any."""
    told = record.device.identity.get(_SERIAL_NUMBER, "")
    number = int.from_bytes(bytes.fromhex(told), "little") if _NUMBER.fullmatch(told) else 0
    return record.device.serial or (str(number) if number else "")


def verdict_of(record: Record) -> str:
    """Return the run in one word as its items bear it out."""
    if any(map(record.deviates, record.items)):
        return "deviates"
    return "conforms" if record.summary.verdict == "conforms" else "inconclusive"


def _unit(database: Database, connection: Connection, device: str, serial: str) -> int:
    values = {"device": printable(device), "serial": printable(serial)}
    database.insert_missing(connection, units, values, "device", "serial")
    same = (units.c.device == values["device"]) & (units.c.serial == values["serial"])
    number: int = connection.execute(select(units.c.id).where(same)).scalar_one()
    return number


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
