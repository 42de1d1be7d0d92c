"""What an entry's value is, deduced from its index and access (CiA 301 v4.2.0, 7.5.2)."""

from __future__ import annotations

from typing import Final

from conformance.spec.document import Follows, Kind
from conformance.spec.eds.entries import PROCESS_DATA
from conformance.spec.eds.model import EdsEntry
from conformance.wire.datatypes import DataType

IDENTITY_OBJECT: Final = 0x1018
SERIAL_NUMBER: Final = (IDENTITY_OBJECT, 4)
ERROR_REGISTER: Final = 0x1001
ERROR_HISTORY: Final = 0x1003
_IDENTITY: Final = (0x1000, 0x1008, 0x1009, 0x100A)
_STATES: Final = (ERROR_REGISTER, 0x1002)
_COMMANDS: Final = (0x1010, 0x1011, 0x1023, 0x1024, 0x1025, *range(0x1F50, 0x1F60))
"""Store, restore, OS command and prompt, debugger, program download and control."""
_SETTINGS_OF_SERVERS: Final = range(0x1200, 0x1C00)
"""SDO and PDO parameters: fixed ones are constant rather than measured."""

_INCLINOMETER: Final = 410
_SLOPES: Final[dict[int, Follows]] = {
    0x6010: "tilt-x",
    0x6020: "tilt-y",
    0x6110: "tilt-x",
    0x6120: "tilt-y",
}
"""Slope long and lateral, 16 and 32 bits (CiA 410)."""


def follows_of(entry: EdsEntry, profile: int | None) -> Follows | None:
    """Return what an entry shows as its index alone tells, for the simulated device.

    Args:
        entry: The entry.
        profile: Number of the device profile, None when the EDS gives none.
    """
    if (entry.index, entry.sub) == SERIAL_NUMBER:
        return "serial-number"
    if entry.index == ERROR_REGISTER and entry.type is DataType.UNSIGNED8:
        return "error-register"
    slope = profile == _INCLINOMETER and entry.type is not None and entry.type.is_integer
    return _SLOPES.get(entry.index) if slope else None


def kind_of(entry: EdsEntry, *, in_record: bool) -> Kind:
    """Return the kind of an entry; the cautious one where an EDS leaves it open."""
    fixed = entry.access in ("ro", "const")
    counts_subs = in_record and entry.sub == 0
    kind: Kind = "config"
    if entry.index in _IDENTITY or (entry.index == IDENTITY_OBJECT and not counts_subs):
        kind = "identity"
    elif entry.index == ERROR_HISTORY:
        kind = "live" if fixed else "counter"
    elif counts_subs and fixed:
        kind = "constant"
    elif entry.index in _STATES or not entry.understood:
        kind = "live"
    elif fixed:
        constant = entry.access == "const" or entry.index in _SETTINGS_OF_SERVERS
        kind = "constant" if constant else "live"
    elif entry.index in _COMMANDS or entry.type is DataType.DOMAIN or entry.access == "wo":
        kind = "command"
    elif is_process_data(entry):
        kind = "live"
    return kind


def is_process_data(entry: EdsEntry) -> bool:
    """Tell whether the access right names a direction of process data: ``rwr`` or ``rww``."""
    return any(
        line.key.lower() == "accesstype" and line.value.lower() in PROCESS_DATA
        for line in entry.left
    )
