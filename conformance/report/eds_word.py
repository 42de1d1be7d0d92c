"""What a device's EDS says on a deviation: which of manual, EDS and device stands alone."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from conformance.report.results import Item
from conformance.spec.eds.compare import Attribute, agree, describe, evaluated, unlisted
from conformance.spec.eds.model import EdsEntry, EdsFile
from conformance.spec.model import DeviceSpec, Entry, Key

_ADDRESS = re.compile(r"([0-9A-F]{4})h(?::([0-9A-F]{2}))?")
_VALUE = re.compile(r"download of (-?[0-9]+) to")
_OCTETS = re.compile(r"([0-9]+) octets?\b")
_CONCERNS: Final[Mapping[str, Attribute]] = {
    "OD-01": "existence",
    "OD-02": "access",
    "OD-03": "type",
    "OD-04": "access",
    "OD-05": "access",
    "OD-07": "access",
    "OD-09": "default",
    "OD-10": "default",
    "OD-11": "limits",
    "OD-13": "limits",
    "OD-15": "existence",
    "OD-16": "existence",
}
"""Requirement to the attribute that an EDS has a word on; ids are never used twice."""

_READABLE: Final = ("ro", "rw", "const")
_WRITABLE: Final = ("rw", "wo")
AGAINST_DEVICE: Final = "manual and EDS agree: the device stands alone"
AGAINST_MANUAL: Final = "device and EDS agree: the manual stands alone"
ALL_DIFFER: Final = "manual, EDS and device all differ"


class EdsWord:
    """The EDS as a third witness.

    Args:
        eds: The EDS.
        spec: What the device is judged against.
    """

    def __init__(self, eds: EdsFile, spec: DeviceSpec) -> None:
        self._eds = eds
        self._spec = spec
        self._entries = eds.entries

    @property
    def name(self) -> str:
        """The name of the file."""
        return self._eds.name

    @property
    def sha256(self) -> str:
        """Hash of the file."""
        return self._eds.sha256

    def on(self, item: Item) -> dict[str, str]:
        """Return what the EDS says of a deviation's object and who stands alone, if comparable.

        Empty for a deviation that is about no object.
        """
        key = self._key(item)
        if key is None:
            return {}
        said, entry = self._entries.get(key), self._spec.entries.get(key)
        record = entry is not None and entry.in_record
        sub = key[1] if record or key[1] else None
        says = unlisted(self._eds, key[0], sub) if said is None else describe(self._eds, said)
        concern = _CONCERNS.get(item.requirement)
        stands = "" if concern is None else self._stands(concern, item, entry, said)
        return {"says": says, "stands": stands}

    def _key(self, item: Item) -> Key | None:
        """Return the object of an item; that of the access that failed where it tries several."""
        texts = [item.object]
        if item.requirement == "OD-16":
            texts = [item.quantity, item.object]
        match = next(filter(None, map(_ADDRESS.search, texts)), None)
        return None if match is None else (int(match[1], 16), int(match[2] or "0", 16))

    def _stands(
        self, concern: Attribute, item: Item, entry: Entry | None, said: EdsEntry | None
    ) -> str:
        if concern == "existence":
            exists = item.requirement != "OD-01"
            return AGAINST_MANUAL if exists == (said is not None) else AGAINST_DEVICE
        if said is None or entry is None:
            return ""
        if concern == "access":
            return self._access(item, said)
        return (
            self._limits(item, said)
            if concern == "limits"
            else self._figure(concern, item, entry, said)
        )

    def _figure(self, concern: Attribute, item: Item, entry: Entry, said: EdsEntry) -> str:
        if any(agree(reading, said, concern, self._spec.node_id) for reading in entry.readings):
            return AGAINST_DEVICE
        shown = self._length(said) if concern == "type" else self._default(said)
        if not shown:
            return ""
        return AGAINST_MANUAL if _found(concern, item) == shown else ALL_DIFFER

    @staticmethod
    def _access(item: Item, said: EdsEntry) -> str:
        """Compare what the device allows, which is not what the manual says, with the EDS."""
        if said.access is None:
            return ""
        allowed = _READABLE if item.requirement in ("OD-02", "OD-07") else _WRITABLE
        device_allows = item.requirement in ("OD-05", "OD-07")
        return AGAINST_MANUAL if (said.access in allowed) == device_allows else AGAINST_DEVICE

    def _limits(self, item: Item, said: EdsEntry) -> str:
        """Compare whether the device takes a value with whether the EDS allows it."""
        match = _VALUE.search(item.quantity)
        low, high = (evaluated(end, self._spec.node_id) for end in (said.low, said.high))
        if match is None or (low is None and high is None):
            return ""
        value = int(match[1])
        inside = not (isinstance(low, int) and value < low)
        inside = inside and not (isinstance(high, int) and value > high)
        return AGAINST_MANUAL if inside == (item.requirement == "OD-13") else AGAINST_DEVICE

    @staticmethod
    def _length(said: EdsEntry) -> str:
        size = None if said.type is None else said.type.size
        return "" if size is None else str(size)

    def _default(self, said: EdsEntry) -> str:
        value = evaluated(said.default, self._spec.node_id)
        return "" if value is None else str(value) if isinstance(value, int) else repr(value)


def _found(concern: Attribute, item: Item) -> str:
    """Return what the device has, as the check prints it: octets, a number, a text."""
    if concern == "type":
        match = _OCTETS.match(item.actual)
        return "" if match is None else match[1]
    return item.actual if item.actual[:1] in "'\"" else item.actual.partition(" ")[0]
