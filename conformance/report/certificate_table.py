"""The failed items of a certificate, the first few of each requirement."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Final

from conformance.report.printable import printable
from conformance.report.record import Record
from conformance.report.results import Item

MOST_OF_ONE: Final = 3
"""Items of one requirement in a table."""

MOST_NAMED: Final = 12
MOST_OF_A_NAME: Final = 40
MOST_OF_A_VALUE: Final = 60
"""Characters that are shown of it."""

UNKNOWN: Final = "not in the record"


@dataclass(frozen=True, slots=True)
class Row:
    """A failed item.

    Args:
        title: Requirement and object.
        says: The rule in words, and who knows of the deviation.
        place: Level and slice of the trace.
        source: Sections of the manual, then the standard's.
        expected: What was expected of the first comparison that failed.
        actual: What came.
    """

    title: str
    says: str
    place: str
    source: str
    expected: str
    actual: str


@dataclass(frozen=True, slots=True)
class Table:
    """Failed items, the first few of each requirement.

    Args:
        title: With how many there are.
        rows: Those that are shown.
        more: How many others there are and where; empty if none.
    """

    title: str
    rows: Sequence[Row]
    more: str


def table_of(noun: str, items: Sequence[Item], most: int, record: Record) -> Table:
    """Return a table of failed items of a record.

    Args:
        noun: What they are, in the singular.
        items: All of them.
        most: Rows that are shown.
        record: Theirs.
    """
    by_requirement: dict[str, list[Item]] = defaultdict(list)
    for item in items:
        by_requirement[item.requirement].append(item)
    few = [group[:MOST_OF_ONE] for group in by_requirement.values()]
    chosen = [it for turn in zip_longest(*few) for it in turn if it is not None][:most]
    shown = [it for group in few for it in group if it in chosen]
    left = Counter(item.requirement for item in items)
    left.subtract(item.requirement for item in shown)
    named = listed(f"{name} {count}" for name, count in left.items() if count)
    more = len(items) - len(shown)
    return Table(
        title=many(len(items), noun),
        rows=[_row(item, record) for item in shown],
        more=f"{more} more, by requirement: {named}. All of them are in {record.path.name}."
        if more
        else "",
    )


def _row(item: Item, record: Record) -> Row:
    manual = f"{record.device.manual}, "
    source = item.source.replace(manual, "manual, ") if record.device.manual else item.source
    others = len(item.deviations) - 1
    more = f"; and {many(others, 'other comparison')}" if others > 0 else ""
    known = f"Known to {printable(item.known)}." if item.known else ""
    return Row(
        title=printable(f"{item.requirement} {item.object}", MOST_OF_A_VALUE),
        says=" ".join(filter(None, (printable(item.sentence), known))),
        place=printable(", ".join(filter(None, (item.level, item.trace))), MOST_OF_A_VALUE),
        source=printable(source) or UNKNOWN,
        expected=printable(": ".join(filter(None, (item.quantity, item.expected)))),
        actual=printable(item.actual) + more,
    )


def listed(names: Iterable[str], most: int = MOST_NAMED) -> str:
    """Return names, each once, and how many more there are."""
    every = list(dict.fromkeys(names))
    shown = [printable(name, MOST_OF_A_NAME) for name in every[:most]]
    if len(every) > most:
        shown.append(f"and {len(every) - most} more")
    return ", ".join(shown)


def many(count: int, noun: str) -> str:
    """Return a number with its noun."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"
