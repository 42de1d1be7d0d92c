"""Bit rates as a manual's table has them."""

from __future__ import annotations

import re

from conformance.spec.model import DeviceSpec, Entry

_RATE = re.compile(r"(\d+(?:\.\d+)?)\s*([kM]?)\s*(?:bit/s|baud)", re.IGNORECASE)
_FACTORS = {"": 1, "k": 1_000, "m": 1_000_000}


def bits_per_second(entry: Entry, value: int) -> int:
    """Return the bit rate that a value of the bit rate object stands for, in bit/s."""
    match = _RATE.search((entry.values or {}).get(value, ""))
    return round(float(match[1]) * _FACTORS[match[2].lower()]) if match else value


def documented_rates(spec: DeviceSpec) -> dict[int, int]:
    """Return the bit rates that the manual lists, in bit/s, and the values that stand for them."""
    service = spec.services.bitrate
    entry = None if service is None else spec.entry(service.object)
    if entry is None:
        return {}
    return {bits_per_second(entry, value): value for value in entry.values or ()}
