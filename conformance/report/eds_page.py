"""A device's manual against its EDS, for people (a table) and for programs (JSON)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from conformance.report.console import Terminal
from conformance.spec.eds.compare import Row
from conformance.spec.eds.model import EdsFile
from conformance.spec.model import DeviceSpec


def to_json(spec: DeviceSpec, eds: EdsFile, rows: Sequence[Row]) -> dict[str, Any]:
    """Return the comparison as plain data."""
    return {
        "device": spec.name,
        "variant": spec.variant,
        "manual": spec.manual.name,
        "eds": str(eds.ini.path),
        "eds_sha256": eds.sha256,
        "differences": [_plain(row) for row in rows if row.differs],
        "notes": [_plain(row) for row in rows if not row.differs],
    }


def _plain(row: Row) -> dict[str, Any]:
    plain = asdict(row)
    del plain["differs"]
    return plain


def print_table(
    spec: DeviceSpec, eds: EdsFile, rows: Sequence[Row], terminal: Terminal, *, show_all: bool
) -> None:
    """Print the differences; with ``show_all`` the notes as well."""
    differences = [row for row in rows if row.differs]
    notes = [row for row in rows if not row.differs]
    count = f"{len(differences)} difference" + ("" if len(differences) == 1 else "s")
    terminal.say(f"{spec.manual.name}, {spec.variant}, against {eds.name}: {count}", style="bold")
    heads = ("object", "attribute", "manual", "section", "EDS", "line")
    if differences:
        terminal.table(heads, (_cells(row) for row in differences))
    if notes and show_all:
        terminal.say()
        terminal.say("Names, and what only one of both says:", style="bold")
        terminal.table(heads, (_cells(row) for row in notes))
    elif notes:
        terminal.say(f"{len(notes)} names and figures that only one of both gives: see --all")


def _cells(row: Row) -> tuple[str, ...]:
    line = str(row.line) if row.line else "-"
    return row.object, row.attribute, row.manual or "-", row.section or "-", row.eds or "-", line
