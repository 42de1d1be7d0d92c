"""Which unit a run is of, by the label that a person read and the serial number that the node told."""

from __future__ import annotations

import re
from typing import Any, Final

from sqlalchemy import (
    CompoundSelect,
    Connection,
    Select,
    delete,
    func,
    select,
    union,
    update,
)

from conformance.history.database import Database
from conformance.history.schema import places, runs, units
from conformance.report.printable import printable

MOST_DIGITS: Final = 20
_HEXADECIMAL: Final = re.compile(rf"(0[xX])?([0-9A-Fa-f]{{1,{MOST_DIGITS}}})[hH]?")


def written(label: str, told: str = "") -> str:
    """Return a label as the node would tell it, where it is a number; else as it stands.

    Args:
        label: From a person: decimal, with zeros before it or spaces in it, or hexadecimal after 0x. Other
            hexadecimal digits count where that is what the node told.
        told: Number that the node told, decimal; empty if none.
    """
    text = "".join(label.split())
    if text.isascii() and text.isdecimal() and len(text) <= MOST_DIGITS:
        return str(int(text))
    if (match := _HEXADECIMAL.fullmatch(text)) is not None:
        number = str(int(match[2], 16))
        if match[1] or number == told:
            return number
    return printable(label)


def called(serial: str) -> CompoundSelect[Any]:
    """Return what selects the units that go by a serial number, on a label or as their nodes tell it."""
    names = {printable(serial), written(serial)}
    return union(
        select(units.c.id).where(units.c.serial.in_(names)),
        select(runs.c.unit_id).where(runs.c.label.in_(names)),
        select(runs.c.unit_id).where(runs.c.told.in_(names)),
    )


def unit_of(
    database: Database, connection: Connection, device: str, label: str, told: str
) -> int | None:
    """Return the unit that goes by a label, a told number, or both; it is made where there is none.

    A run without a label is of the unit that told that number, if one alone did. What is known of a number
    goes to the unit whose label comes later.

    Args:
        database: The history.
        connection: In a transaction that writes.
        device: Name of its spec.
        label: Empty without one.
        told: Empty if the node told none.
    """
    if not label and not told:
        return None
    device = printable(device)
    if not label:
        found = connection.execute(_telling(device, told).union(_of_serial(device, told))).scalars()
        known: list[int] = list(found)
        return known[0] if len(known) == 1 else _made(database, connection, device, told)
    name = written(label, told)
    unit = _labelled(connection, device, name, printable(label))
    if unit is None:
        unit = _made(database, connection, device, name)
    if told not in ("", name):
        _take_over(connection, device, unit, told)
    return unit


def _labelled(connection: Connection, device: str, name: str, label: str) -> int | None:
    """Return the unit of a label, however that was written before."""
    with_label = select(runs.c.unit_id).where(
        (runs.c.device == device) & (runs.c.label == label) & runs.c.unit_id.is_not(None)
    )
    for query in (_of_serial(device, name), _of_serial(device, label), with_label):
        unit: int | None = connection.execute(query.limit(1)).scalar()
        if unit is not None:
            return unit
    return None


def _take_over(connection: Connection, device: str, unit: int, told: str) -> None:
    """Give a unit what is known of its number without a label, unless another unit tells that as well."""
    other = connection.execute(_of_serial(device, told)).scalar()
    telling = connection.execute(_telling(device, told)).scalars()
    if other is None or set(telling) - {unit} != {other}:
        return
    of_other = runs.c.unit_id == other
    labelled = of_other & ((runs.c.label != "") | (runs.c.told != told))
    if connection.execute(select(func.count()).select_from(runs).where(labelled)).scalar_one():
        return
    connection.execute(update(runs).where(of_other).values(unit_id=unit))
    connection.execute(update(places).where(places.c.unit_id == other).values(unit_id=unit))
    connection.execute(delete(units).where(units.c.id == other))


def _telling(device: str, told: str) -> Select[Any]:
    of_it = (runs.c.device == device) & (runs.c.told == told) & runs.c.unit_id.is_not(None)
    return select(runs.c.unit_id).where(of_it).distinct()


def _of_serial(device: str, serial: str) -> Select[Any]:
    return select(units.c.id).where((units.c.device == device) & (units.c.serial == serial))


def _made(database: Database, connection: Connection, device: str, serial: str) -> int:
    database.insert_missing(
        connection, units, {"device": device, "serial": serial}, "device", "serial"
    )
    number: int = connection.execute(_of_serial(device, serial)).scalar_one()
    return number
