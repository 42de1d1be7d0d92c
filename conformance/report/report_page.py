"""A run's record as one HTML file that opens offline: verdict, deviations with their frames, the rest."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import Final

from conformance.errors import BenchError
from conformance.report.cautions import cautions
from conformance.report.frames import Evidence, TraceFile
from conformance.report.identity import identity
from conformance.report.pages import render
from conformance.report.plots import plots
from conformance.report.provenance_words import facts, shown_time
from conformance.report.readings_words import followed
from conformance.report.record import Record
from conformance.report.results import VERDICTS, Item
from conformance.report.shown_statements import FATES, coverage

NAME: Final = "report.html"
MOST_FRAMES: Final = 6000
"""Of all items together; the trace has the rest."""

_PLACE = re.compile(r"trace\.log:(\d+-\d+)")


@dataclass(frozen=True, slots=True)
class Finding:
    """A failed item with its frames."""

    item: Item
    evidence: Evidence


@dataclass(frozen=True, slots=True)
class Row:
    """An item in the list of all.

    Args:
        item: The item.
        section: Of the manual.
        lines: Of the trace.
    """

    item: Item
    section: str
    lines: str


@dataclass(frozen=True, slots=True)
class Group:
    """The items of one requirement.

    Args:
        first: One of them; requirement, sentence, level and service are those of all.
        standard: Where the rule stands beside the manual.
        rows: The items.
    """

    first: Item
    standard: str
    rows: Sequence[Row]


def write_page(record: Record) -> Path:
    """Write the page of a record beside it.

    Raises:
        BenchError: The disk does not take it.
    """
    path = record.path.with_name(NAME)
    try:
        path.write_text(to_html(record), encoding="utf-8", newline="\n")
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror or error}") from error
    return path


def to_html(record: Record) -> str:
    """Return the page of a record."""
    trace, counts = TraceFile(record.trace), record.counts()
    failed = [item for item in record.items if item.verdict == "fail"]
    findings = _findings(failed, trace)
    return render(
        "report.html.j2",
        record=record,
        device=record.device,
        counts=counts,
        verdicts=VERDICTS,
        deviations=[it for it in findings if record.deviates(it.item)],
        remarks=[it for it in findings if not record.deviates(it.item)],
        undecided=_undecided(record.items),
        skipped=Counter(item.reason for item in record.items if item.verdict == "skipped"),
        recording=bool(record.origin.recording),
        whole=_whole(record) and not counts["skipped"],
        cautions=list(cautions(record)),
        partial=record.origin.acceptance is not True,
        identity=identity(record.device.identity),
        facts=facts(record, trace),
        plots=plots(record.items, record.origin.sdo_response_times),
        groups=list(_groups(record)),
        by_service=_by_service(record.items),
        levels=list(dict.fromkeys(item.level for item in record.items)),
        readings=followed(record),
        coverage=coverage(record),
        fates=FATES,
        started=shown_time(record.origin.started),
        suite=version("canopen-conformance"),
    )


def _whole(record: Record) -> bool:
    """Tell whether everything was asked that the bench could ask; of a recording nothing was."""
    return record.summary.complete and not record.origin.select and not record.origin.recording


def _findings(failed: Iterable[Item], trace: TraceFile) -> list[Finding]:
    """Return failed items with their frames, until there are enough of these."""
    found = []
    left = MOST_FRAMES
    for item in failed:
        evidence = trace.evidence(item.trace, item.begins, item.object)
        left -= len(evidence.frames)
        if left < 0:
            evidence = Evidence(note="The frames are not shown: there are many deviations.")
        found.append(Finding(item, evidence))
    return found


def _undecided(items: Iterable[Item]) -> dict[tuple[str, str], list[str]]:
    """Return requirement and reason of what could not be decided, to the objects it was about.

    Reasons that differ by the name of the object alone are one.
    """
    found: dict[tuple[str, str], list[str]] = {}
    for item in items:
        if item.verdict == "inconclusive":
            reason = item.reason.replace(item.object, "it") if item.object else item.reason
            found.setdefault((item.requirement, reason), []).append(item.object)
    return found


def _by_service(items: Iterable[Item]) -> dict[str, Counter[str]]:
    """Return how many items of each service have each verdict."""
    counted: dict[str, Counter[str]] = {}
    for item in items:
        counted.setdefault(item.service, Counter())[item.verdict] += 1
    return counted


def _groups(record: Record) -> Iterable[Group]:
    """Return all items by service and requirement, in the order of the record."""
    services = {item.service: n for n, item in reversed(list(enumerate(record.items)))}
    ordered = sorted(record.items, key=lambda item: services[item.service])
    for _, group in groupby(ordered, key=lambda item: (item.service, item.requirement)):
        items = list(group)
        rows = [_row(item, record.device.manual) for item in items]
        yield Group(items[0], _standard(items, record.device.manual), rows)


def _row(item: Item, manual: str) -> Row:
    cited = item.source.partition("; ")[0]
    section = cited.removeprefix(f"{manual}, ") if cited.startswith(f"{manual}, ") else ""
    place = _PLACE.fullmatch(item.trace)
    return Row(item, section, place[1] if place else "")


def _standard(items: Sequence[Item], manual: str) -> str:
    parts = (part for item in items for part in item.source.split("; "))
    return "; ".join(dict.fromkeys(it for it in parts if it and not it.startswith(f"{manual}, ")))
