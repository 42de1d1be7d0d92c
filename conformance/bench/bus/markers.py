"""Marker frames: where a check begins and ends, in anybody's trace of the bus."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from conformance.bench.bus.link import Link
from conformance.errors import BenchError, SpecError
from conformance.spec.model import DeviceSpec, Entry, Key
from conformance.wire.cob_id import LSS_MASTER, LSS_SLAVE, NMT, SYNC, TIME, emcy, rpdo, tpdo
from conformance.wire.frame import Frame

BEGIN: Final = 0
END: Final = 1
CODES: Final = {
    "pass": 1,
    "fail": 2,
    "inconclusive": 3,
    "skipped": 4,
    "not_applicable": 5,
}
"""Last octet of the frame at an item's end; 0 at its beginning."""

_OF_ANY_NODE: Final = (range(0x581, 0x600), range(0x601, 0x680), range(0x701, 0x780))
_COB_ID_OBJECTS: Final = (range(0x1005, 0x1006), range(0x1012, 0x1013), range(0x1014, 0x1015))
_COB_ID_RECORDS: Final = (range(0x1200, 0x1300), range(0x1400, 0x1600), range(0x1800, 0x1A00))
_NOT_VALID_OR_EXTENDED: Final = 1 << 31 | 1 << 29


class Markers:
    """Marks items on the bus: 4 octets number, lowest first, 1 octet begin or end, 1 octet verdict.

    Args:
        link: The link to the bus.
        can_id: On which identifier.
    """

    def __init__(self, link: Link, can_id: int) -> None:
        self._link = link
        self._can_id = can_id

    def begin(self, number: int) -> None:
        """Mark where an item begins."""
        self._send(number, BEGIN, 0)

    def end(self, number: int, verdict: str) -> None:
        """Mark where an item ends, what it did undone."""
        self._send(number, END, CODES[verdict])

    def _send(self, number: int, place: int, code: int) -> None:
        self._link.send(Frame(self._can_id, number.to_bytes(4, "little") + bytes((place, code))))


def require_free(can_id: int, spec: DeviceSpec) -> None:
    """Make sure that nothing documented uses a CAN-ID.

    Raises:
        SpecError: Something does.
    """
    if used := _used_for(can_id, spec):
        raise SpecError(
            f"markers: expected a CAN-ID that nothing uses, got {can_id:03X}h, which is for {used}"
        )


def require_not_held(can_id: int, spec: DeviceSpec, held: Mapping[Key, object]) -> None:
    """Make sure that no object of the node holds a CAN-ID as its COB-ID.

    Raises:
        BenchError: One does.
    """
    for entry in _cob_id_entries(spec):
        data = held.get(entry.key)
        if isinstance(data, bytes) and _is_cob_id(int.from_bytes(data, "little"), can_id):
            raise BenchError(
                f"markers: the node uses {can_id:03X}h by its {entry.address}; choose another CAN-ID"
            )


def _used_for(can_id: int, spec: DeviceSpec) -> str:
    """Return what this node, or any, uses a CAN-ID for; empty where that is nothing."""
    fixed = {NMT: "NMT", SYNC: "SYNC", TIME: "TIME", LSS_SLAVE: "LSS", LSS_MASTER: "LSS"}
    if can_id in fixed:
        return fixed[can_id]
    if any(can_id in ids for ids in _OF_ANY_NODE):
        return "SDO or heartbeat"
    node_id = spec.node_id
    pdos = {of(number, node_id) for of in (tpdo, rpdo) for number in range(1, 5)}
    if can_id == emcy(node_id) or can_id in pdos:
        return "EMCY or a PDO of this node"
    for entry in _cob_id_entries(spec):
        if isinstance(entry.default, int) and _is_cob_id(entry.default, can_id):
            return f"what {entry.address} of this node says"
    return ""


def _cob_id_entries(spec: DeviceSpec) -> list[Entry]:
    """Return the entries that hold a COB-ID."""
    return [entry for entry in spec.entries.values() if _holds_cob_id(entry)]


def _holds_cob_id(entry: Entry) -> bool:
    if any(entry.index in ids for ids in _COB_ID_OBJECTS):
        return entry.sub == 0
    subs = (1, 2) if entry.index in _COB_ID_RECORDS[0] else (1,)
    return entry.sub in subs and any(entry.index in ids for ids in _COB_ID_RECORDS)


def _is_cob_id(word: int, can_id: int) -> bool:
    """Tell whether a COB-ID is valid and names a CAN-ID of 11 bits."""
    return not word & _NOT_VALID_OR_EXTENDED and word & 0x7FF == can_id
