"""The value an entry has on the first day, also where the manual gives none."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle, islice

from conformance.simulator.faults import Faults
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry, Key
from conformance.wire.datatypes import DataType, Value

_TEXT = "1.0"
_ON_COMMAND = 1
"""Parameters are stored, or restored, on command (CiA 301 v4.2.0, 7.5.2.13 and 7.5.2.14)."""
_PREDEFINED_TPDOS = 4
"""TPDOs that have a COB-ID in the predefined connection set (CiA 301 v4.2.0, 7.3.5)."""

_REALS = (DataType.REAL32, DataType.REAL64)


def initial_value(entry: Entry, serial_number: int, faults: Faults) -> Value:
    """Return the factory value of an entry.

    Args:
        entry: The entry.
        serial_number: Of this device.
        faults: Defects to show.
    """
    wrong = {key_of(address): value for address, value in faults.wrong_defaults.items()}
    if entry.key in wrong and entry.type.is_integer:
        return min(max(wrong[entry.key], entry.type.minimum), entry.type.maximum)
    if entry.follows == "serial-number":
        return _serial_number(entry, serial_number)
    default = entry.default_value
    return _plausible(entry) if default is None else default


def unstated_values(spec: DeviceSpec) -> dict[Key, Value]:
    """Return initial values that no manual prints but that follow from what it says elsewhere."""
    return _start_word(spec) | dict.fromkeys(_commands(spec), _ON_COMMAND)


def _commands(spec: DeviceSpec) -> Iterator[Key]:
    """Return what stores or restores by a signature and has no documented value."""
    for service in (spec.services.store, spec.services.restore):
        for sub in () if service is None else service.groups:
            entry = spec.entry(service.object, sub) if service is not None else None
            if entry is not None and entry.readable and entry.default is None:
                yield entry.key


def _start_word(spec: DeviceSpec) -> dict[Key, Value]:
    rule, tpdo = spec.services.nmt.start_by, spec.services.tpdo
    values: dict[Key, Value] = {}
    if rule is not None:
        values[key_of(rule.object)] = 0 if rule.value else rule.mask
    if tpdo is not None:
        for number in range(min(tpdo.count, _PREDEFINED_TPDOS)):
            values[tpdo.communication + number, 1] = 0x180 + 0x100 * number + spec.node_id
    entries = spec.entries
    return {
        key: value
        for key, value in values.items()
        if key in entries and entries[key].default is None
    }


def _serial_number(entry: Entry, serial_number: int) -> Value:
    if entry.type.is_integer:
        return min(serial_number, entry.type.maximum)
    least = 0 if entry.octets is None else entry.octets[0]
    text = str(serial_number).rjust(least, "0")
    return text if _is_text(entry.type) else text.encode("ascii")


def _plausible(entry: Entry) -> Value:
    """Return 0 or the lowest legal number, or the shortest legal text."""
    if entry.type.is_integer:
        legal = entry.legal or ()
        if not legal or any(low <= 0 <= high for low, high in legal):
            return 0
        return min(low for low, _ in legal)
    if entry.type in _REALS:
        return 0.0
    if entry.type is DataType.BOOLEAN:
        return False
    if entry.type.size is not None:
        return bytes(entry.type.size)
    least = len(_TEXT) if entry.octets is None else entry.octets[0]
    text = "".join(islice(cycle(_TEXT), least))
    return text if _is_text(entry.type) else text.encode("ascii")


def _is_text(kind: DataType) -> bool:
    return kind in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING)
