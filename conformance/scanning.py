"""The walk over a node's object dictionary in a run: told while it goes on, kept as a record."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeAlias

from conformance.bench.services.scan import Found, Scan
from conformance.bench.session import Bench
from conformance.report.scanned import (
    Scanned,
    Undocumented,
    area_of,
    as_text,
    guessed_type,
)
from conformance.spec.model import address
from conformance.wire.abort import describe

TELL_EVERY_S = 0.2

ScanProgress: TypeAlias = Callable[[int, int, int], None]
"""Called with the uploads done, those to do as far as is known, and the entries found."""


def scan(bench: Bench, keep: Callable[[Scanned], None], tell: ScanProgress | None) -> str:
    """Walk over the object dictionary.

    Args:
        bench: The open bench.
        keep: Called with the record while it grows, and at the end, also of an interrupted walk.
        tell: Called with how far the walk is.

    Returns:
        Why the walk ended early, empty if it did not.

    Raises:
        BenchError: The rig failed.
        NodeTimeout: The node does not answer any more.
    """
    line, start_s = bench.link.line + 1, bench.link.now()
    walk = Scan(bench)
    told = time.monotonic()
    try:
        for _ in walk.walk():
            now = time.monotonic()
            if now - told < TELL_EVERY_S:
                continue
            told = now
            keep(_record(walk, bench, line, start_s))
            if tell is not None:
                tell(walk.uploads, walk.total, len(walk.found))
        walk.leave()
    finally:
        keep(_record(walk, bench, line, start_s))
    return walk.ended


def _record(walk: Scan, bench: Bench, line: int, start_s: float) -> Scanned:
    documented = {index for index, _ in bench.spec.entries}
    in_record = {found.key[0] for found in walk.found if found.key[1]} | documented
    return Scanned(
        complete=walk.complete,
        ended=walk.ended,
        indices=walk.indices,
        uploads=walk.uploads,
        duration_s=round(bench.link.now() - start_s, 3),
        absent=tuple(describe(code) for code in sorted(walk.absent | walk.missing)),
        trace=f"trace.log:{line}-{bench.link.line}",
        undocumented=tuple(
            _undocumented(found, in_record=found.key[0] in in_record) for found in walk.found
        ),
    )


def _undocumented(found: Found, *, in_record: bool) -> Undocumented:
    index, sub = found.key
    transfer = found.transfer
    data = transfer.partial if transfer.data is None else transfer.data
    says = "" if transfer.confirmed else str(transfer)
    if not transfer.sized:
        says = "the node does not say how many octets count"
    return Undocumented(
        object=address(index, sub if in_record else None),
        index=index,
        sub=sub,
        area=area_of(index),
        length=len(data) if transfer.confirmed else None,
        type=guessed_type(data) if transfer.confirmed and transfer.sized else "",
        hex=data.hex(" ").upper(),
        text=as_text(data),
        says=says,
        trace=f"trace.log:{found.first}-{found.last}",
    )
