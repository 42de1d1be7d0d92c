"""What a run has shown of the manual's statements, and of the others why not."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from conformance.report.record import Record, Statement
from conformance.report.results import Item

_INDEX = re.compile(r"[0-9A-F]{4}h")
FATES: Final = {
    "deviates": "deviating",
    "open": "undecided, or shown in part",
    "shown": "shown",
    "not_asked": "not judged here",
    "needs": "out of reach of any check",
    "no_check": "visible, not asked for yet",
    "invisible": "not visible on a bus",
}
"""What has become of a statement, in the order in which a reader wants to know."""


@dataclass(frozen=True, slots=True)
class Told:
    """A statement and what the run says of it.

    Args:
        statement: What the manual says.
        fate: One of `FATES`.
        why: Of one that was not shown, or not wholly.
    """

    statement: Statement
    fate: str
    why: str


@dataclass(frozen=True, slots=True)
class Coverage:
    """The manual's statements after a run.

    Args:
        told: All of them.
        counts: Words of a fate to how many statements have it.
        missing: Why there are none, empty if there are.
    """

    told: Sequence[Told]
    counts: Mapping[str, int]
    missing: str


def coverage(record: Record) -> Coverage:
    """Return what a run has shown of the manual."""
    items: dict[str, list[Item]] = defaultdict(list)
    for item in record.items:
        items[item.requirement].append(item)
    order = list(FATES)
    whole = record.summary.complete and not record.origin.select
    recorded = bool(record.origin.recording)
    told = [
        _told(statement, items, whole=whole, recorded=recorded)
        for statement in record.manual.statements
    ]
    told.sort(key=lambda it: order.index(it.fate))
    counted = Counter(it.fate for it in told)
    counts = {words: counted[fate] for fate, words in FATES.items() if counted[fate]}
    return Coverage(told, counts, record.manual.statements_missing if not told else "")


def _told(
    statement: Statement, items: Mapping[str, Sequence[Item]], *, whole: bool, recorded: bool
) -> Told:
    if not statement.verified_by:
        return _unverified(statement)
    found = [it for name in statement.verified_by for it in items.get(name, ())]
    about = _about(statement, found, whole=whole)
    asked = [it for it in about if it.verdict != "not_applicable"]
    words = Counter(it.verdict for it in asked)
    if words["fail"]:
        failed = ", ".join(it.id.partition("/")[2] for it in asked if it.verdict == "fail")
        return Told(statement, "deviates", failed)
    undecided = [it for it in asked if it.verdict in ("inconclusive", "skipped")]
    if undecided:
        names = ", ".join(dict.fromkeys(it.requirement for it in undecided))
        return Told(statement, "open", f"{names}: {undecided[0].reason}")
    unseen = [it for it in about if recorded and it.object and it.verdict == "not_applicable"]
    if words["pass"] and unseen:
        names = ", ".join(dict.fromkeys(it.requirement for it in unseen))
        return Told(statement, "open", f"{names}: the recording does not show all cases")
    if words["pass"]:
        return Told(statement, "shown", "")
    return Told(statement, "not_asked", "no item of what verifies it was judged")


def _about(statement: Statement, items: Sequence[Item], *, whole: bool) -> Sequence[Item]:
    """Return the items about the objects of a statement, or about none.

    Where a whole run has no item about them, the statement is verified at other objects; of a part of a
    run nothing can be told.
    """
    own = [
        it for it in items if (place := _INDEX.match(it.object)) and place[0] in statement.objects
    ]
    general = [it for it in items if not _INDEX.match(it.object)]
    if own or (statement.objects and not whole):
        return [*own, *general]
    return items


def _unverified(statement: Statement) -> Told:
    if statement.because:
        return Told(statement, "invisible", statement.because)
    if statement.needs:
        return Told(statement, "needs", f"needs {statement.needs}")
    return Told(statement, "no_check", statement.open)
