"""EMCY history: order, number and depth of the errors kept, and clearing (CiA 301 v4.2.0, 7.5.2.4)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from conformance.bench.node.node import Node
from conformance.bench.services.emcy import EmcyPort, depths
from conformance.bench.services.provocations import AnyProvocation, Provocation
from conformance.checks.cases import OUT_OF_RANGE, REFUSED_WRITE
from conformance.checks.errors.emcies import (
    NO_ERROR,
    above,
    any_errors,
    code_words,
    judge,
    kept,
    require_told,
    told,
)
from conformance.effects import Need
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import EmcyProducer
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode, describe

HISTORY = f"{CIA301}, 7.5.2.4"
UNUSED = (
    AbortCode.NO_DATA_AVAILABLE,
    AbortCode.SUB_INDEX_DOES_NOT_EXIST,
    AbortCode.GENERAL_ERROR,
)
MORE = 2
"""Errors beyond the greatest depth, so that the history must drop some."""


def _count(spec: DeviceSpec) -> Entry | None:
    """Return the number of errors in the history."""
    producer = spec.services.emcy_producer
    if producer is None or producer.history is None:
        return None
    return spec.entry(producer.history, 0)


def _each_error(spec: DeviceSpec) -> Iterable[Case]:
    count = _count(spec)
    for case in any_errors(spec) if count is not None else ():
        yield replace(case, section=count.source if count else "")


def _first_error(spec: DeviceSpec) -> Iterable[Case]:
    for case in tuple(_each_error(spec))[:1]:
        count = _count(spec)
        yield replace(case, label=address(count.index) if count else "")


def _told_apart(spec: DeviceSpec) -> Iterable[Case]:
    """Return two errors with different codes, by the history's object."""
    count, found = _count(spec), above(spec)
    if count is not None and len({error.code for error in found}) > 1:
        yield Case(address(count.index), (found[0], found[1]), count.source, kept(spec))


@requirement(
    "EMCY-12",
    level="manual",
    cases=("error", _each_error),
    source=HISTORY,
    effects=("reads", "writes"),
)
def test_error_enters_the_history(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """An error is in sub-index 1 of the history once it was told."""
    if told(spec, emcy, error, verdict) is None:
        return

    past = emcy.past(1)

    verdict.equal("latest error", past, [error.code], show=code_words)


@requirement(
    "EMCY-13",
    level="shall",
    cases=("both", _told_apart),
    source=HISTORY,
    effects=("reads", "writes"),
    needs=("sudden-tilt",),
)
def test_history_is_in_order(
    spec: DeviceSpec, emcy: EmcyPort, both: tuple[Provocation, Provocation], verdict: Verdict
) -> None:
    """The history has the latest error in sub-index 1 and older ones behind it."""
    first, second = both
    if told(spec, emcy, first, verdict) is None:
        return
    emcy.end()
    emcy.provoke(second)

    past = emcy.past(3)

    def wanted(producer: EmcyProducer) -> set[tuple[int, ...]]:
        with_resets = producer.history_keeps == "errors-and-resets"
        codes = (second.code, *((NO_ERROR,) if with_resets else ()), first.code)
        return {(*codes, *past[len(codes) :])}

    judge(spec, verdict, "history", tuple(past), wanted, show=code_words)


@requirement(
    "EMCY-14",
    level="shall",
    cases=("error", _first_error),
    source=HISTORY,
    effects=("reads", "writes"),
)
def test_history_counts_its_errors(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """The number of errors rises by one with each error, unless the history is full."""
    emcy.calm()
    before = emcy.count()
    messages = told(spec, emcy, error, verdict)
    if messages is None:
        return

    after = emcy.count()

    full = before >= min(_depths(spec))
    most = before + len(messages)  # errors on the bus may come more than once
    verdict.one_of("number of errors", after, list(range(before + (not full), most + 1)))


def _depths(spec: DeviceSpec) -> set[int]:
    count = _count(spec)
    return depths(spec, count.index) if count is not None else {0}


@requirement(
    "EMCY-15",
    level="manual",
    cases=("error", _first_error),
    source=HISTORY,
    effects=("reads", "writes"),
)
def test_history_keeps_the_documented_number(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """The history keeps as many errors as documented and drops older ones."""
    if told(spec, emcy, error, verdict) is None:
        return
    emcy.end()
    for _ in range(max(_depths(spec)) + MORE):
        _once_more(emcy, error)

    count = emcy.count()

    verdict.one_of("errors kept", count, sorted(_depths(spec)))
    codes = sorted(set(emcy.past(count)) - {error.code, NO_ERROR})
    verdict.equal("codes of other errors", codes, [], show=code_words)


def _once_more(emcy: EmcyPort, error: AnyProvocation) -> None:
    """Let an error come and go.

    Raises:
        SetupRefused: It is one of the bus that does not.
    """
    seen = emcy.provoke(error)
    if isinstance(error, Provocation):
        emcy.end()
        return
    require_told(seen)
    emcy.relieve()
    if emcy.present():
        raise SetupRefused("the error does not go by itself, so that no other can be told")


def _clearable(spec: DeviceSpec) -> Iterable[Case]:
    count = _count(spec)
    if count is not None and any(reading.writable for reading in count.readings):
        needs: tuple[Need, ...] = ("tilt",) if above(spec) else ()
        yield Case(count.address, count, count.source_of("access"), kept(spec), needs)


@requirement(
    "EMCY-16",
    level="manual",
    cases=("count", _clearable),
    source=HISTORY,
    effects=("reads", "writes"),
)
def test_history_is_cleared(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, count: Entry, verdict: Verdict
) -> None:
    """Writing 0 to sub-index 0 clears the history, where it can be written."""
    for error in above(spec)[:1]:
        if told(spec, emcy, error, verdict) is not None:
            emcy.end()

    cleared = node.sdo.download(count.index, 0, count.type.encode(0))

    fixed = [other for other in count.alternatives if not other.entry.writable]
    open_to_either = bool(fixed) or not count.writable
    refused = open_to_either and cleared.abort in REFUSED_WRITE
    verdict.holds(
        f"download of 0 to {count.address}",
        expected="confirmed, or refused as read-only" if open_to_either else "confirmed",
        actual=str(cleared),
        ok=cleared.confirmed or refused,
    )
    if cleared.confirmed:
        verdict.equal("errors left", emcy.count(), 0)
    for other in count.alternatives:
        if other.entry.writable != count.writable and other.entry.writable == cleared.confirmed:
            verdict.follows(other.ambiguity, other.reading)


def _takes_zero_only(spec: DeviceSpec) -> Iterable[Case]:
    count = _count(spec)
    if count is not None and all(reading.writable for reading in count.readings):
        for value in (1, 255):
            label = f"{count.address}/{value}"
            yield Case(label, value, count.source_of("access"))


@requirement(
    "EMCY-17",
    level="shall",
    cases=("value", _takes_zero_only),
    source=HISTORY,
    effects=("reads", "writes"),
)
def test_history_takes_zero_only(
    node: Node, spec: DeviceSpec, value: int, verdict: Verdict
) -> None:
    """Any other value than 0 is refused in sub-index 0 of the history."""
    count = _count(spec)
    if count is None:
        raise SetupRefused("the manual documents no error history")

    written = node.sdo.download(count.index, 0, count.type.encode(value))

    judge(
        spec,
        verdict,
        f"download of {value} to {count.address}",
        "confirmed" if written.confirmed else "refused" if written.refused else str(written),
        lambda producer: {"refused"} if producer.history_takes == "zero" else {"confirmed"},
    )
    if written.abort is not None:
        verdict.one_of("abort code", written.abort, OUT_OF_RANGE, show=describe)


def _places(spec: DeviceSpec) -> Iterable[Case]:
    count = _count(spec)
    if count is not None:
        yield Case(address(count.index), count.index, count.source)


@requirement("EMCY-18", level="shall", cases=("index", _places), source=HISTORY)
def test_unused_places_hold_no_error(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, index: int, verdict: Verdict
) -> None:
    """A place of the history without an error is aborted or reads 0."""
    used = emcy.count()
    unused = [entry for entry in spec.subs(index) if entry.sub > used]
    if not unused:
        raise SetupRefused("every place of the history is in use")

    for entry in unused:
        place = node.sdo.upload(entry.index, entry.sub)
        empty = place.data is not None and not any(place.data)
        verdict.holds(
            entry.address,
            expected="0, or an abort",
            actual=str(place),
            ok=empty or place.abort in UNUSED,
        )
        for other in entry.alternatives:
            if (other.entry.default is None) == place.refused != (entry.default is None):
                verdict.follows(other.ambiguity, other.reading)
