"""The certificate of one device: what its record comes to, in words."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from conformance.errors import SpecError
from conformance.report.cautions import cautions
from conformance.report.certificate_table import (
    MOST_NAMED,
    MOST_OF_A_NAME,
    MOST_OF_A_VALUE,
    UNKNOWN,
    Table,
    listed,
    many,
    table_of,
)
from conformance.report.identity import identity
from conformance.report.printable import printable
from conformance.report.provenance_words import milliseconds
from conformance.report.record import Record
from conformance.report.results import VERDICTS, Item
from conformance.report.shown_statements import coverage

MOST_DEVIATIONS: Final = 10
MOST_REMARKS: Final = 4
MOST_REASONS: Final = 6
MOST_OF_A_NOTE: Final = 240
MOST_OF_A_FIGURE: Final = 1e9
ENDINGS: Final = ("conforms", "inconclusive", "deviates")
"""Verdicts, each worse than the one before."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A fact with its name."""

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class Unit:
    """The certificate of one device.

    Args:
        product: Vendor, name and variant.
        serial: As the label says, or as the node says where nobody gave it.
        verdict: One of `ENDINGS`.
        headline: The verdict in a few words.
        sentence: What it rests on.
        partial: Why it is no acceptance, empty if it is one.
        deviating: Items that deviate.
        notes: What a reader has to know before the verdict is relied on.
        device: What was judged.
        run: How.
        counts: Of items, by verdict.
        not_judged: What was not judged, and why.
        deviations: Failed items that decide.
        remarks: Failed items that do not.
        sha256: Of the record.
    """

    product: str
    serial: str
    verdict: str
    headline: str
    sentence: str
    partial: str
    deviating: int
    notes: Sequence[str]
    device: Sequence[Pair]
    run: Sequence[Pair]
    counts: Sequence[Pair]
    not_judged: Sequence[str]
    deviations: Table
    remarks: Table
    sha256: str


def unit_of(record: Record, lot: str) -> Unit:
    """Return the certificate of one device.

    Args:
        record: Of its run.
        lot: Title of the lot it is from, empty without one.

    Raises:
        SpecError: The record has a verdict that nobody knows.
    """
    counts = record.counts()
    deviations = [item for item in record.items if record.deviates(item)]
    remarks = [i for i in record.items if i.verdict == "fail" and not record.deviates(i)]
    seen = _seen(record)
    verdict = max(seen, record.summary.verdict, key=ENDINGS.index)
    decided = counts["pass"] + counts["fail"]
    partial = _partial(record)
    not_judged = counts["skipped"] or record.run.get("not_judged")
    return Unit(
        product=printable(_product(record), MOST_OF_A_VALUE),
        serial=printable(record.device.serial, MOST_OF_A_NAME) or "not given",
        verdict=verdict,
        headline=_headline(verdict, len(deviations), in_part=bool(partial or not_judged)),
        sentence=_sentence(record, verdict, decided),
        partial=partial,
        deviating=len(deviations),
        notes=list(_notes(record, seen)),
        device=list(_device(record, lot)),
        run=list(_run(record)),
        counts=[Pair(word.replace("_", " "), str(counts[word])) for word in VERDICTS],
        not_judged=list(_not_judged(record)),
        deviations=table_of("deviation", deviations, MOST_DEVIATIONS, record),
        remarks=table_of("remark", remarks, MOST_REMARKS, record),
        sha256=record.sha256,
    )


def _seen(record: Record) -> str:
    """Return the verdict that items and troubles of a record come to.

    Raises:
        SpecError: The record itself has one that nobody knows.
    """
    counts, summary = record.counts(), record.summary
    if summary.verdict not in ENDINGS:
        raise SpecError(
            f"{record.path}: summary.verdict: expected one of {', '.join(ENDINGS)}, "
            f"got {printable(summary.verdict)!r}"
        )
    if any(record.deviates(item) for item in record.items):
        return "deviates"
    hindered = summary.aborted or summary.left_changed or summary.illegal or not summary.complete
    decided = counts["pass"] + counts["fail"]
    return "inconclusive" if hindered or counts["inconclusive"] or not decided else "conforms"


def _headline(verdict: str, deviations: int, *, in_part: bool) -> str:
    if verdict == "deviates":
        return f"The device deviates from its manual: {many(deviations, 'deviation')}"
    if verdict == "inconclusive":
        return "It is not decided whether the device conforms to its manual"
    return f"The device conforms to its manual{' in what was judged' if in_part else ''}"


def _sentence(record: Record, verdict: str, decided: int) -> str:
    counts = record.counts()
    services = {item.service for item in record.items if item.verdict in ("pass", "fail")}
    judged = (
        f"{decided:,} of {many(len(record.items), 'item')} "
        f"were judged, of {many(len(services), 'service')}; {counts['pass']:,} passed."
    )
    if verdict == "conforms" and counts["fail"]:
        return f"{judged} What failed is only recommended, and listed as a remark."
    return judged


def _partial(record: Record) -> str:
    """Return why a record is no acceptance: only a run that says so of itself is one."""
    if record.run.get("acceptance") is True:
        return ""
    return "This is no acceptance: the record is not that of an acceptance run."


def _notes(record: Record, seen: str) -> Iterator[str]:
    yield from (printable(caution, MOST_OF_A_NOTE) for caution in cautions(record))
    said = record.summary.verdict
    if said != seen:
        yield f"The record's summary says “{said}”; its items do not bear that out."


def _device(record: Record, lot: str) -> Iterator[Pair]:
    device = record.device
    if lot:
        yield Pair("lot", printable(lot))
    yield Pair("product", printable(_product(record)))
    yield Pair("serial number on the label", printable(device.serial) or "not given")
    yield Pair("node-ID", printable(f"{device.node_id} ({device.node_id:02X}h)"))
    for told in identity(device.identity)[:MOST_NAMED]:
        yield Pair(
            printable(f"{told.object} {told.name}".strip(), MOST_OF_A_NAME),
            printable(told.value, MOST_OF_A_VALUE),
        )
    if not device.identity:
        yield Pair("identity on the node", UNKNOWN)
    more = len(device.identity) - MOST_NAMED
    if more > 0:
        yield Pair("further objects", f"{more}, see {record.path.name}")


def _run(record: Record) -> Iterator[Pair]:
    run = record.run
    yield Pair("judged against", printable(record.device.manual) or UNKNOWN)
    yield Pair("spec", _text(run.get("spec")) or printable(record.device.spec))
    yield Pair("SHA-256 of the spec", _known(run, "spec_sha256"))
    yield Pair("suite", f"canopen-conformance {_known(run, 'suite')}")
    if recording := _text(run.get("recording")):
        yield Pair("recording", recording)
        yield Pair("SHA-256 of the recording", _known(run, "recording_sha256"))
    else:
        yield Pair("bench", f"{_known(run, 'bench')} ({_text(run.get('interface')) or UNKNOWN})")
    bitrate = _number(run.get("bitrate"))
    yield Pair("bit rate", UNKNOWN if bitrate is None else f"{bitrate / 1000:g} kbit/s")
    stamps = run.get("timestamps")
    late_ms = _number(stamps.get("late_ms")) if isinstance(stamps, dict) else None
    if isinstance(stamps, dict) and late_ms is not None:
        yield Pair(
            "times taken by", f"the {_text(stamps.get('by'))}, at most {milliseconds(late_ms)} late"
        )
    yield Pair("judged" if recording else "began", _known(run, "started"))
    if not recording:
        yield Pair("ended", _known(run, "finished"))
        yield Pair("seed", _known(run, "seed"))
    found = run.get("as_found")
    if isinstance(found, dict) and found.get("differences") == []:
        yield Pair("left as found", f"yes, {_text(found.get('objects'))} settings compared")
    if writes := _text(run.get("non_volatile_writes")):
        yield Pair("writes of its memory", writes)


def _not_judged(record: Record) -> Iterator[str]:
    left_out = _left_out(record.items)
    if left_out:
        yield f"Services of which nothing could be judged: {listed(left_out)}."
    groups: dict[tuple[str, str], list[Item]] = defaultdict(list)
    for item in record.items:
        if item.verdict not in ("pass", "fail"):
            groups[item.verdict, item.reason].append(item)
    order = sorted(groups, key=lambda key: (VERDICTS.index(key[0]), -len(groups[key])))
    for verdict, reason in order[:MOST_REASONS]:
        items = groups[verdict, reason]
        named = listed((item.requirement for item in items), 6)
        word = verdict.replace("_", " ")
        yield f"{len(items)} {word}: {printable(reason, MOST_OF_A_NOTE) or 'no reason given'} ({named})"
    others = sum(len(groups[key]) for key in order[MOST_REASONS:])
    if others:
        more = many(len(order) - MOST_REASONS, "other reason")
        yield f"{others} more for {more}: see {record.path.name}."
    covered = coverage(record)
    fates = ", ".join(f"{count} {words}" for words, count in covered.counts.items())
    yield f"Statements of the manual: {fates or printable(covered.missing)}."
    if record.scan is not None:
        yield printable(f"A {record.scan}.", MOST_OF_A_NOTE)


def _left_out(items: Iterable[Item]) -> list[str]:
    """Return the services that apply, and of which no item was decided."""
    verdicts = defaultdict(set)
    for item in items:
        verdicts[item.service].add(item.verdict)
    return [
        service.replace("_", " ")
        for service, words in verdicts.items()
        if words.isdisjoint(("pass", "fail")) and words != {"not_applicable"}
    ]


def _product(record: Record) -> str:
    device = record.device
    name = f"{device.vendor} {device.name}".strip() or device.spec
    return ", ".join(filter(None, (name, device.variant)))


def _known(run: Mapping[str, Any], key: str) -> str:
    return _text(run.get(key)) or UNKNOWN


def _text(value: object) -> str:
    return "" if value is None else printable(str(value))


def _number(value: object) -> float | None:
    """Return a number that a figure can be, None for anything else."""
    return value if isinstance(value, int | float) and 0 <= value < MOST_OF_A_FIGURE else None
