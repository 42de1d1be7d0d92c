"""What an acceptance certificate says, from the records of runs alone."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from conformance.errors import SpecError
from conformance.report.cautions import is_simulated
from conformance.report.certificate_table import listed, many
from conformance.report.certificate_unit import Unit, unit_of
from conformance.report.printable import printable
from conformance.report.record import Record


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate, of one device or of several.

    Args:
        lot: Title of the lot, empty without one.
        summary: How many units came to which verdict.
        notes: What a reader has to know before the summary is relied on.
        partial: Why it is no acceptance, empty if it is one.
        units: In the order in which they were given.
        made: Time of the latest record, in seconds since 1970; None where no record tells.
    """

    lot: str
    summary: str
    notes: Sequence[str]
    partial: str
    units: Sequence[Unit]
    made: int | None


def certify(records: Sequence[Record], lot: str = "") -> Certificate:
    """Return what the certificate of some records says.

    Args:
        records: One or several, of one unit each.
        lot: Title of the lot.

    Raises:
        SpecError: A record is given twice.
    """
    first: dict[str, Record] = {}
    for record in records:
        if first.setdefault(record.sha256, record) is not record:
            other = first[record.sha256].path
            raise SpecError(f"RUN: expected each record once, got {record.path} and {other}")
    units = [unit_of(record, lot) for record in records]
    partial = sum(bool(unit.partial) for unit in units)
    made = [when for record in records if (when := _when(record)) is not None]
    return Certificate(
        lot=printable(lot),
        summary=_summary(units),
        notes=list(_lot_notes(records, units)),
        partial=_lot_partial(partial, len(units)),
        units=units,
        made=max(made, default=None),
    )


def _summary(units: Sequence[Unit]) -> str:
    counted = Counter(unit.verdict for unit in units)
    words = {
        "conforms": ("conforms", "conform"),
        "deviates": ("deviates", "deviate"),
        "inconclusive": ("is undecided", "are undecided"),
    }
    parts = (
        f"{counted[word]} {one if counted[word] == 1 else several}"
        for word, (one, several) in words.items()
    )
    return f"{many(len(units), 'unit')}: {', '.join(parts)}."


def _lot_partial(partial: int, units: int) -> str:
    if not partial:
        return ""
    if partial == units:
        return "This is no acceptance: no record is that of an acceptance run."
    return f"{partial} of {units} records: no acceptance run."


def _lot_notes(records: Sequence[Record], units: Sequence[Unit]) -> Iterator[str]:
    places = defaultdict(list)
    for number, record in enumerate(records, 1):
        if record.device.serial:
            places[record.device.serial].append(str(number))
    for serial, numbers in places.items():
        if len(numbers) > 1:
            yield f"Serial {printable(serial)} is there more than once: units {listed(numbers)}."
    simulated = sum(is_simulated(record) for record in records)
    if simulated:
        yield f"{simulated} of {many(len(units), 'device')} judged: simulated, not real."


def _when(record: Record) -> int | None:
    """Return when a run ended or began, in seconds since 1970; None if the record does not tell."""
    for key in ("finished", "started"):
        try:
            told = datetime.fromisoformat(str(record.run.get(key)))
            return int((told if told.tzinfo else told.replace(tzinfo=UTC)).timestamp())
        except (ValueError, OverflowError):
            continue
    return None
