"""The services that an EDS lets one expect: from the objects it lists (CiA 301 v4.2.0, 7.5.2)."""

from __future__ import annotations

from typing import Any, Final

from conformance.spec.eds.kinds import ERROR_HISTORY, ERROR_REGISTER
from conformance.spec.eds.model import EdsEntry, EdsFile
from conformance.spec.eds.values import parse_number

_STATES: Final = ["pre-operational", "operational", "stopped"]
_WHOLE: Final = [0x1000, 0x9FFF]
_GROUPS: Final = {1: _WHOLE, 2: [0x1000, 0x1FFF], 3: [0x6000, 0x9FFF], 4: [0x2000, 0x5FFF]}
_TYPES: Final = ((0, 240), (252, 255))
_LSS: Final = ["switch-state-global", "switch-state-selective"]
_LSS_CONFIGURATION: Final = [
    "switch-state-global",
    "configure-node-id",
    "configure-bit-timing",
    "activate-bit-timing",
    "inquire-identity",
    "inquire-node-id",
]
COMMUNICATION: Final = 0x1800
MAPPING: Final = 0x1A00
_MOST_TPDOS: Final = 0x200
_MOST_MAPPED: Final = 64


def services_of(eds: EdsFile) -> dict[str, Any]:
    """Return the blocks of the services, as a device spec file has them."""
    blocks: dict[str, dict[str, Any] | None] = {
        "nmt": {"automatic_start": False, "source": "CiA 301"},
        "heartbeat_producer": _heartbeat(eds),
        "sync_consumer": _plain(eds, 0x1005),
        "emcy_producer": _emcy(eds),
        "tpdo": _tpdo(eds),
        "store": _groups(eds, 0x1010, "save", "at-once"),
        "restore": _groups(eds, 0x1011, "load", "after-reset"),
        "lss": _lss(eds),
    }
    return {name: block for name, block in blocks.items() if block is not None}


UNSAID: Final = {
    "tpdo": "when a mapping may be written (map_only_while)",
    "lss": "whether LSS stores (store-configuration)",
}
"""What an EDS does not say of a service, and the standard leaves to the device."""


def tpdo_count(eds: EdsFile) -> int:
    """Return how many TPDOs, counted from the first one, have both their objects.

    Not more than the EDS claims, if it claims any.
    """
    claimed = min(device_figure(eds, "NrOfTXPDO") or _MOST_TPDOS, _MOST_TPDOS)
    for number in range(claimed):
        communication = all(_integer(eds, COMMUNICATION + number, sub) for sub in (0, 1, 2))
        mapping = all(_integer(eds, MAPPING + number, sub) for sub in (0, 1))
        if not (communication and mapping):
            return number
    return claimed


def _integer(eds: EdsFile, index: int, sub: int) -> EdsEntry | None:
    """Return an entry of an integer type."""
    entry = eds.entries.get((index, sub))
    if entry is None or entry.type is None or entry.access is None:
        return None
    return entry if entry.type.is_integer else None


def _variable(eds: EdsFile, index: int) -> EdsEntry | None:
    item = eds.objects.get(index)
    return None if item is None or item.in_record else _integer(eds, index, 0)


def _cite(entry: EdsEntry) -> str:
    return f"line {entry.line}; CiA 301"


def _plain(eds: EdsFile, index: int) -> dict[str, Any] | None:
    entry = _variable(eds, index)
    return None if entry is None else {"object": index, "source": _cite(entry)}


def _heartbeat(eds: EdsFile) -> dict[str, Any] | None:
    entry = _variable(eds, 0x1017)
    if entry is None or entry.access != "rw":
        return None
    low, high = entry.low, entry.high
    longest = high if isinstance(high, int) and 0 < high <= 0xFFFF else 0xFFFF
    shortest = low if isinstance(low, int) and 0 < low <= longest else 1
    return {
        "object": 0x1017,
        "min_ms": shortest,
        "max_ms": longest,
        "states": _STATES,
        "source": _cite(entry),
    }


def _emcy(eds: EdsFile) -> dict[str, Any] | None:
    entry = _variable(eds, 0x1014)
    if entry is None:
        return None
    block: dict[str, Any] = {"object": 0x1014}
    if _variable(eds, ERROR_REGISTER) is not None:
        block["error_register"] = ERROR_REGISTER
    history = eds.objects.get(ERROR_HISTORY)
    if history is not None and history.in_record and _integer(eds, ERROR_HISTORY, 1) is not None:
        block["history"] = ERROR_HISTORY
    return {
        **block,
        "states": _STATES[:2],
        "codes": {0: "No error"},
        "register_bits": {0: "Generic error"},
        "source": _cite(entry),
    }


def _tpdo(eds: EdsFile) -> dict[str, Any] | None:
    count = tpdo_count(eds)
    if not count:
        return None
    most = max(max(eds.objects[MAPPING + number].entries) for number in range(count))
    first = eds.objects[COMMUNICATION].entries
    return {
        "count": count,
        "max_mapped": min(most, _MOST_MAPPED),
        "transmission_types": _types(first[2]),
        "map_only_while": [],
        "source": f"line {first[0].line}; CiA 301",
    }


def _types(entry: EdsEntry) -> list[list[int]]:
    """Return the transmission types of CiA 301 that the limits allow."""
    low = entry.low if isinstance(entry.low, int) else 0
    high = entry.high if isinstance(entry.high, int) else 0xFF
    pairs = [[max(low, first), min(high, last)] for first, last in _TYPES]
    return [pair for pair in pairs if pair[0] <= pair[1]] or [list(pair) for pair in _TYPES]


def _groups(eds: EdsFile, index: int, signature: str, effective: str) -> dict[str, Any] | None:
    groups = {sub: [ranges] for sub, ranges in _GROUPS.items() if _integer(eds, index, sub)}
    if not groups:
        return None
    return {
        "object": index,
        "signature": signature,
        "groups": groups,
        "effective": effective,
        "source": f"line {eds.objects[index].line}; CiA 301",
    }


def _lss(eds: EdsFile) -> dict[str, Any] | None:
    section = eds.ini.section("DeviceInfo")
    line = None if section is None else section.get("LSS_Supported")
    if line is None or device_figure(eds, "LSS_Supported") != 1:
        return None
    return {
        "waiting": list(_LSS),
        "configuration": list(_LSS_CONFIGURATION),
        "source": f"line {line.number}; CiA 305",
    }


def device_figure(eds: EdsFile, key: str, section: str = "DeviceInfo") -> int | None:
    """Return a number of a section that describes the device, None when it gives none."""
    try:
        number = parse_number(eds.text(section, key))[0]
    except ValueError:
        return None
    return number if isinstance(number, int) and number >= 0 else None
