"""Shows what was asked of the history: tables for a terminal, CSV for a spreadsheet."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Row

from conformance.errors import BenchError
from conformance.history.asking import LotUnit
from conformance.report.console import Terminal

COLUMNS: Final = (
    "device",
    "serial",
    "label",
    "told",
    "variant",
    "started",
    "verdict",
    "complete",
    "selected",
    "items",
    "deviations",
    "suite",
    "spec_sha256",
    "firmware",
    "bench",
    "simulated",
    "path",
)
"""Of a run, in the CSV file; ``deviating_items`` follows them."""

_LOT: Final = ("lot", "part", "order", "size", "plan", "verdict", "decided")
_FORMULA: Final = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes for the beginning of a formula."""


def print_overview(
    devices: Sequence[Row[Any]],
    frequent: Sequence[Row[Any]],
    lots: Sequence[Row[Any]],
    terminal: Terminal,
) -> None:
    """Print what the history holds."""
    if not devices and not lots:
        terminal.say("no run and no lot yet")
    if devices:
        heads = ("device", "units", "runs", "conform", "deviate", "inconclusive", "first", "last")
        terminal.table(
            heads,
            (
                _texts(
                    it.device,
                    it.units,
                    it.runs,
                    it.conforms,
                    it.deviates,
                    it.inconclusive,
                    it.first,
                    it.last,
                )
                for it in devices
            ),
        )
    if frequent:
        terminal.say()
        terminal.table(
            ("deviates most often", "runs"), (_texts(it.item, it.runs) for it in frequent)
        )
    if lots:
        terminal.say()
        terminal.table(_LOT, (_lot(it) for it in lots))


def print_lot(lot: Row[Any], units: Sequence[LotUnit], terminal: Terminal) -> None:
    """Print a lot and what is known of its units."""
    terminal.table(_LOT, [_lot(lot)])
    if units:
        terminal.say()
        heads = ("place", "device", "serial", "runs", "last verdict", "deviations", "when")
        terminal.table(
            heads,
            (
                _texts(
                    it.place,
                    it.device,
                    it.serial,
                    it.runs,
                    it.verdict or "not judged",
                    it.deviations,
                    it.started,
                )
                for it in units
            ),
        )


def print_names(found: Sequence[Row[Any]], terminal: Terminal) -> None:
    """Print by which other numbers the units of some runs go, if by any."""
    for unit in dict.fromkeys((it.device, it.serial) for it in found):
        own = [it for it in found if (it.device, it.serial) == unit]
        labels = dict.fromkeys(it.label for it in own if it.label not in ("", it.serial))
        told = dict.fromkeys(it.told for it in own if it.told not in ("", it.serial))
        for words, names in (("labelled as", labels), ("whose node tells", told)):
            if names:
                terminal.say(f"{unit[0]} {unit[1]}, {words} {', '.join(names)}")


def print_runs(
    found: Sequence[Row[Any]], deviating: Mapping[int, Sequence[str]], terminal: Terminal
) -> None:
    """Print runs, numbered, and in which of them which item deviates."""
    heads = (
        "no.",
        "device",
        "serial",
        "variant",
        "started",
        "verdict",
        "deviations",
        "items",
        "firmware",
        "suite",
        "bench",
        "of it",
    )
    terminal.table(
        heads,
        (
            _texts(
                number,
                it.device,
                it.serial,
                it.variant,
                it.started,
                it.verdict,
                it.deviations,
                it.items,
                it.firmware,
                it.suite,
                it.bench,
                _part(it),
            )
            for number, it in enumerate(found, 1)
        ),
    )
    over_time: dict[str, list[int]] = {}
    for number, it in enumerate(found, 1):
        for item in deviating.get(it.id, ()):
            over_time.setdefault(item, []).append(number)
    if over_time:
        terminal.say()
        terminal.table(
            ("deviates", "in runs"), ((item, _spans(at)) for item, at in sorted(over_time.items()))
        )


def write_csv(path: Path, found: Iterable[Row[Any]], deviating: Mapping[int, list[str]]) -> int:
    """Write a line per run.

    Returns:
        How many.

    Raises:
        BenchError: The disk does not take it.
    """
    count = 0
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            lines = csv.writer(file)
            lines.writerow((*COLUMNS, "deviating_items"))
            for it in found:
                cells = [_cell(getattr(it, name)) for name in COLUMNS]
                lines.writerow([*cells, _cell(" ".join(deviating.get(it.id, ())))])
                count += 1
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror}") from error
    return count


def _cell(value: object) -> object:
    """Return what a spreadsheet shows as it is, whatever a device or a person wrote."""
    if value is None:
        return ""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def _part(run: Row[Any]) -> str:
    """Return what was judged of a device, if not all."""
    words = (run.selected, "" if run.complete else "ended early")
    return ", ".join(filter(None, words)) or "all"


def _spans(numbers: Sequence[int]) -> str:
    """Return ``1-3, 7`` for 1, 2, 3, 7."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and spans[-1][-1] == number - 1:
            spans[-1][1:] = [number]
        else:
            spans.append([number])
    return ", ".join("-".join(map(str, span)) for span in spans)


def _lot(lot: Row[Any]) -> tuple[str, ...]:
    known = lot.verdict or "not decided"
    return _texts(lot.name, lot.part, lot.order_number, lot.size, lot.plan, known, lot.decided)


def _texts(*cells: object) -> tuple[str, ...]:
    return tuple(map(str, cells))
