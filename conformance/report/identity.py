"""What a node says it is, in words: the objects of CiA 301 v4.2.0, 7.5.2, and the maker's own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

_NUMBER: Final = re.compile(r"[0-9A-F]{2}( [0-9A-F]{2}){3}")
_NAMES: Final = {
    "1000h": "device type",
    "1008h": "manufacturer device name",
    "1009h": "manufacturer hardware version",
    "100Ah": "manufacturer software version",
    "1018h:01": "vendor-ID",
    "1018h:02": "product code",
    "1018h:03": "revision number",
    "1018h:04": "serial number",
}
_NUMBERS: Final = ("1000h", "1018h:01", "1018h:02", "1018h:03", "1018h:04")


@dataclass(frozen=True, slots=True)
class Told:
    """What a node says in one object.

    Args:
        object: Its address.
        name: By the standard, empty for the maker's own.
        value: A number where it is one and was read, else as it stands in the record.
    """

    object: str
    name: str
    value: str


def identity(told: Mapping[str, str]) -> list[Told]:
    """Return what a node says it is, from a record's ``device.identity``."""
    return [_told(name, text) for name, text in told.items()]


def _told(name: str, text: str) -> Told:
    value = text
    if name in _NUMBERS and _NUMBER.fullmatch(text):
        number = int.from_bytes(bytes.fromhex(text), "little")
        value = f"{number} ({number:08X}h)"
    return Told(name, _NAMES.get(name, ""), value)
