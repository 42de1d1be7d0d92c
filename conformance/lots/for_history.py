"""A lot and its runs, as the history enters them."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from conformance.history import lot as history_lot
from conformance.lots.inspection import Inspection
from conformance.lots.lot_file import Lot


def for_history(
    lot: Lot, inspection: Inspection, folder: Path, word: str
) -> tuple[history_lot.Lot, dict[int, list[Path]]]:
    """Return a lot as the history has it, and the folders of its runs by the unit's place."""
    content = lot.content
    known = history_lot.Lot(
        name=lot.path.stem,
        part=content.part,
        order=content.order,
        size=content.units,
        plan=inspection.plan.words,
        verdict=word,
        decided="" if word == "not decided" else datetime.now(UTC).isoformat(timespec="seconds"),
    )
    places = {name: place for place, name in enumerate(content.names, 1)}
    runs = {
        places[unit.unit]: [folder / tried.folder for tried in unit.tries if not tried.other]
        for unit in inspection.units
    }
    return known, runs
