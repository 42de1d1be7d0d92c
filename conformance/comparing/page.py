"""A comparison for people: tables for a terminal or, as Markdown, for a merge request."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Final

from conformance.comparing.baseline import KnownDeviation
from conformance.comparing.comparison import Change, Comparison
from conformance.numbers import figure
from conformance.report.console import Terminal
from conformance.report.printable import printable

MOST_NAMED: Final = 50
_WORDS: Final = ("no new deviation", "new deviations", "cannot be told")
_MARKDOWN: Final = re.compile(r"([\\`*_{}\[\]<>|#@!&~])")


@dataclass(frozen=True, slots=True)
class _Table:
    title: str
    heads: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def print_comparison(comparison: Comparison, terminal: Terminal) -> None:
    """Print a comparison, its verdict last."""
    for table in _tables(comparison):
        terminal.say(f"{table.title}: {len(table.rows)}")
        terminal.table(table.heads, table.rows[:MOST_NAMED])
        if len(table.rows) > MOST_NAMED:
            terminal.say(f"and {len(table.rows) - MOST_NAMED} more: see --format json")
        terminal.say()
    for reason in comparison.incomplete:
        terminal.say(f"cannot be told: {reason}")
    terminal.say(_headline(comparison))


def to_markdown(comparison: Comparison) -> str:
    """Return a comparison as Markdown, its verdict first."""
    lines = [f"## {_headline(comparison)}", ""]
    lines += [f"- cannot be told: {_escaped(reason)}" for reason in comparison.incomplete]
    lines += [""] * bool(comparison.incomplete)
    for table in _tables(comparison):
        lines += [f"### {table.title}: {len(table.rows)}", ""]
        lines += [_row(table.heads), _row(["---"] * len(table.heads))]
        lines += [_row(map(_escaped, row)) for row in table.rows[:MOST_NAMED]]
        if len(table.rows) > MOST_NAMED:
            lines += ["", f"and {len(table.rows) - MOST_NAMED} more"]
        lines.append("")
    return "\n".join(lines)


def to_json(comparison: Comparison) -> str:
    """Return a comparison as JSON text."""
    content = asdict(comparison)
    for key in ("expired", "no_longer"):
        content[key] = [entry.model_dump() for entry in getattr(comparison, key)]
    return json.dumps({"exit_code": comparison.exit_code, **content}, indent=1) + "\n"


def _headline(comparison: Comparison) -> str:
    words = f"{len(comparison.new)} {_WORDS[1]}" if comparison.new else ""
    counts = {
        "in the baseline": comparison.known,
        "unchanged": comparison.unchanged,
        "fixed": comparison.fixed,
    }
    parts = [f"{len(them)} {word}" for word, them in counts.items() if them]
    return ", ".join([words or _WORDS[comparison.exit_code], *parts])


def _tables(it: Comparison) -> Iterator[_Table]:
    """Return the tables that have rows."""
    deviation = ("item", "before", "after", "expected", "actual")
    tables = (
        _Table("The runs are not alike", ("what", "first run", "second run"), it.settings),
        _Table("New deviations", deviation, [_deviation(c) for c in it.new]),
        _Table("New, in the baseline", (*deviation, "known"), [_known(c) for c in it.known]),
        _Table("Unchanged deviations", (*deviation, "known"), [_known(c) for c in it.unchanged]),
        _Table("Fixed", deviation, [_deviation(c) for c in it.fixed]),
        _Table("Deviated, and is not told", ("item", "after"), [(c.id, c.after) for c in it.gone]),
        _Table("Inconclusive now", ("item", "before"), [(c.id, c.before) for c in it.open]),
        _Table("Expired in the baseline", _ENTRY, [_entry(e) for e in it.expired]),
        _Table("In the baseline, passes", _ENTRY, [_entry(e) for e in it.no_longer]),
        _Table(
            "Figures that changed beyond noise",
            ("item", "quantity", "first run", "second run", "noise"),
            [
                (
                    s.id,
                    s.quantity,
                    _span(s.before, s.unit),
                    _span(s.after, s.unit),
                    _figure(s.noise, s.unit),
                )
                for s in it.shifts
            ],
        ),
        _Table("Items of the first run alone", ("item",), [(i,) for i in it.only_before]),
        _Table("Items of the second run alone", ("item",), [(i,) for i in it.only_after]),
    )
    for table in tables:
        if table.rows:
            shown = [tuple(printable(cell) for cell in row) for row in table.rows]
            yield _Table(table.title, table.heads, shown)


_ENTRY: Final = ("item", "owner", "reason", "expires")


def _entry(entry: KnownDeviation) -> tuple[str, ...]:
    return entry.item, entry.owner, entry.reason, entry.expires


def _deviation(change: Change) -> tuple[str, ...]:
    was = f" (was {change.was})" if change.was else ""
    return change.id, change.before, change.after, change.expected, change.actual + was


def _known(change: Change) -> tuple[str, ...]:
    return *_deviation(change), change.known


def _span(span: tuple[float, float], unit: str) -> str:
    least, most = span
    return _figure(least, unit) if least == most else f"{figure(least, 5)} to {_figure(most, unit)}"


def _figure(value: float, unit: str) -> str:
    return f"{figure(value, 5)} {unit}".strip()


def _escaped(text: str) -> str:
    return _MARKDOWN.sub(r"\\\1", text)


def _row(cells: Sequence[str] | map[str]) -> str:
    return f"| {' | '.join(cells)} |"
