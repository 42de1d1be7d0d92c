"""What an acceptance certificate says, from the records of runs alone."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from conformance.errors import SpecError
from conformance.report.cautions import is_simulated
from conformance.report.certificate_table import listed, many
from conformance.report.certificate_unit import Unit, unit_of
from conformance.report.inspected import Inspected
from conformance.report.printable import printable
from conformance.report.record import Record

MOST_OF_A_SENTENCE: Final = 300


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate, of one device or of several.

    Args:
        lot: Title of the lot, empty without one.
        verdict: What became of the lot, empty where its inspection was not given.
        summary: How many units came to which verdict.
        declared: Units that a person declared nonconforming, which nothing measured.
        notes: What a reader has to know before the summary is relied on.
        partial: Why it is no acceptance, empty if it is one.
        units: In the order in which they were given.
        made: Time of the latest record, in seconds since 1970; 0 where no record tells.
    """

    lot: str
    verdict: str
    summary: str
    declared: Sequence[str]
    notes: Sequence[str]
    partial: str
    units: Sequence[Unit]
    made: int


def certify(
    records: Iterable[Record], lot: str = "", inspected: Inspected | None = None
) -> Certificate:
    """Return what the certificate of some records says.

    Args:
        records: One or several, of one unit each; none is kept.
        lot: Title of the lot.
        inspected: The inspection that they are of, None without one.

    Raises:
        SpecError: A record is given twice.
    """
    paths: dict[str, Path] = {}
    units: list[Unit] = []
    serials, made, simulated = [], [], 0
    for record in records:
        other = paths.setdefault(record.sha256, record.path)
        if len(paths) == len(units):
            raise SpecError(f"RUN: expected each record once, got {record.path} and {other}")
        units.append(unit_of(record, lot))
        serials.append(record.device.serial)
        made.append(_when(record) or 0)
        simulated += is_simulated(record)
    return Certificate(
        lot=printable(lot),
        verdict=printable(inspected.verdict, MOST_OF_A_SENTENCE) if inspected else "",
        summary=_summary(units, inspected),
        declared=inspected.declared if inspected else (),
        notes=list(_lot_notes(serials, simulated)),
        partial=_lot_partial(sum(bool(unit.partial) for unit in units), len(units)),
        units=units,
        made=max(made),
    )


def _summary(units: Sequence[Unit], inspected: Inspected | None) -> str:
    counted = Counter(unit.verdict for unit in units)
    words = {
        "conforms": ("conforms", "conform"),
        "deviates": ("deviates", "deviate"),
        "inconclusive": ("is undecided", "are undecided"),
    }
    parts = [
        f"{counted[word]} {one if counted[word] == 1 else several}"
        for word, (one, several) in words.items()
    ]
    declared = len(inspected.declared) if inspected else 0
    waiting = inspected.waiting if inspected else 0
    if declared:
        parts.append(f"{declared} declared nonconforming by a person, not measured")
    if waiting:
        parts.append(f"{waiting} not judged")
    return f"{many(len(units) + declared + waiting, 'unit')}: {', '.join(parts)}."


def _lot_partial(partial: int, units: int) -> str:
    if not partial:
        return ""
    if partial == units:
        return "This is no acceptance: no record is that of an acceptance run."
    return f"{partial} of {units} records: no acceptance run."


def _lot_notes(serials: Sequence[str], simulated: int) -> Iterator[str]:
    places = defaultdict(list)
    for number, serial in enumerate(serials, 1):
        places[serial].append(str(number))
    for serial, numbers in places.items():
        if serial and len(numbers) > 1:
            yield f"Serial {printable(serial)} is there more than once: units {listed(numbers)}."
    if simulated:
        yield f"{simulated} of {many(len(serials), 'device')} judged: simulated, not real."


def _when(record: Record) -> int | None:
    """Return when a run ended or began, in seconds since 1970; None if the record does not tell."""
    for key in ("finished", "started"):
        try:
            told = datetime.fromisoformat(str(record.run.get(key)))
            return int((told if told.tzinfo else told.replace(tzinfo=UTC)).timestamp())
        except (ValueError, OverflowError):
            continue
    return None
