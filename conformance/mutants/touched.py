"""Which entries each item of a run asked for, from the record of the run."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

from conformance.report.results import Results
from conformance.spec.model import Key
from conformance.wire import cob_id

_SLICE = re.compile(r"trace\.log:(\d+)-(\d+)")
_REQUESTS = range(cob_id.sdo_request(1), cob_id.sdo_request(127) + 1)
_INITIATE = frozenset("2346AC")
"""First digit of requests that name an object (CiA 301 v4.2.0, 7.2.4.3)."""


def touched(results: Results, trace: Path) -> dict[Key, frozenset[str]]:
    """Return, for each index and sub-index that was asked for, the items that did.

    Args:
        results: The record.
        trace: Its trace.
    """
    keys = [_asked(line) for line in trace.read_text(encoding="ascii").splitlines()]
    found: dict[Key, set[str]] = defaultdict(set)
    for item in results.items:
        place = _SLICE.fullmatch(item.trace)
        for key in keys[int(place[1]) - 1 : int(place[2])] if place else ():
            if key is not None:
                found[key].add(item.id)
    return {key: frozenset(items) for key, items in found.items()}


def _asked(line: str) -> Key | None:
    _, _, frame, direction = line.split(" ")
    identifier, _, data = frame.partition("#")
    if direction != "T" or len(data) < 8 or data[0] not in _INITIATE:
        return None
    if int(identifier, 16) not in _REQUESTS:
        return None
    index, sub = bytes.fromhex(data[2:6]), int(data[6:8], 16)
    return int.from_bytes(index, "little"), sub
