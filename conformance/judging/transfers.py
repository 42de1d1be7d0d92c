"""SDO exchanges of a recording, held against the object dictionary (CiA 301 v4.2.0, 7.2.4.3)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from conformance.checks import cases
from conformance.checks.dictionary.test_object_dictionary import MISSING, judge_length
from conformance.checks.dictionary.test_object_values import judge_value
from conformance.checks.sdo.transfers import may_need_segments
from conformance.judging.exchanges import Exchange
from conformance.judging.sightings import Sighting
from conformance.judging.timeline import Timeline, number
from conformance.spec.model import DeviceSpec, Entry, is_legal
from conformance.verdict import Verdict
from conformance.wire.abort import describe

DISTURBED = "responses near it answer no request of the recording: frames are missing or swapped"


def transfers(timeline: Timeline) -> Iterator[Sighting]:
    """Return what a recording shows of SDO and the object dictionary."""
    spec = timeline.spec
    for exchange in timeline.exchanges.all:
        entry = spec.entries.get(exchange.key)
        of_one = _Exchange(spec, exchange)
        if entry is not None and exchange.kind == "upload":
            yield from of_one.upload(entry)
        elif entry is not None:
            yield from of_one.download(entry)


class _Exchange:
    """One exchange, and what it shows.

    Args:
        spec: What the device is held against.
        exchange: The exchange.
    """

    def __init__(self, spec: DeviceSpec, exchange: Exchange) -> None:
        self._spec = spec
        self._exchange = exchange

    def upload(self, entry: Entry) -> Iterator[Sighting]:
        """Return what an upload shows of an entry that the manual has."""
        exchange, data = self._exchange, self._exchange.data
        absent = exchange.abort in MISSING
        if self._all(cases.present, entry):
            is_open = cases.is_mapping(entry, self._spec)
            judge = partial(_judge_existence, entry=entry, exchange=exchange)
            yield from [] if is_open else [self._sighting("OD-01", entry, "access", judge)]
        if self._all(cases.readable, entry) and not absent:
            judge = partial(_judge_upload, entry=entry, exchange=exchange)
            yield self._sighting("OD-02", entry, "access", judge)
        if self._all(cases.write_only, entry) and not absent:
            judge = partial(_judge_refusal, what=f"upload of {entry.address}", exchange=exchange)
            yield self._sighting("OD-07", entry, "access", judge)
        if data is None or not self._all(cases.readable, entry):
            return
        judge = partial(_judge_segments, exchange=exchange)
        if self._all(may_need_segments, entry) and not exchange.expedited:
            whole = exchange.announced in (None, len(data))
            yield self._sighting("SDO-01", entry, "access", judge, proof=whole)
        if not exchange.toggles or exchange.announced not in (None, len(data)):
            return  # it is not the whole value
        sure = exchange.expedited or exchange.announced is not None
        if exchange.sized:
            judge = partial(_judge_length, entry=entry, data=data)
            yield self._sighting("OD-03", entry, "type", judge, proof=sure)
        else:
            data = data[: entry.type.size]
        lengths = {it.type.size for it in entry.readings}
        if self._all(cases.fixed, entry) and lengths & {None, len(data)}:
            judge = partial(_judge_value, entry=entry, data=data)
            yield self._sighting("OD-09", entry, "default", judge, proof=sure)

    def download(self, entry: Entry) -> Iterator[Sighting]:
        """Return what a download shows of an entry that the manual has."""
        exchange = self._exchange
        if self._all(cases.read_only, entry):
            what = f"download to {entry.address} ({entry.access})"
            judge = partial(_judge_refusal, what=what, exchange=exchange)
            yield self._sighting("OD-05", entry, "access", judge, proof=True)
            if exchange.abort is not None:
                judge = partial(_judge_code, code=exchange.abort)
                yield self._sighting("OD-06", entry, "access", judge)
        elif exchange.confirmed and exchange.expedited:
            judge = partial(_judge_confirmation, reply=exchange.reply)
            yield self._sighting("SDO-29", entry, "access", judge, proof=True)
        if self._is_outside(entry):
            what = f"download of {number(entry, exchange)} to {entry.address}"
            judge = partial(_judge_refusal, what=what, exchange=exchange)
            yield self._sighting("OD-13", entry, "ranges", judge)

    def _is_outside(self, entry: Entry) -> bool:
        """Tell whether it carried a value that no reading allows, whatever else the node holds."""
        exchange = self._exchange
        if not exchange.expedited or not self._all(cases.has_illegal_values, entry):
            return False
        sent = Exchange("download", *exchange.key, exchange.first, exchange.last)
        sent.data, sent.sized = bytes(exchange.parts), exchange.sized
        value = number(entry, sent)
        if value is None or any(it.writable_while for it in entry.readings):
            return False
        return not any(
            is_legal(value, ranges)
            for reading in entry.readings
            for limit in cases.limits(reading)
            for ranges in limit.readings
        )

    def _all(self, which: Callable[[Entry, DeviceSpec], bool], entry: Entry) -> bool:
        return all(which(reading, self._spec) for reading in entry.readings)

    def _sighting(
        self,
        requirement: str,
        entry: Entry,
        attribute: str,
        judge: partial[None],
        *,
        proof: bool = False,
    ) -> Sighting:
        exchange = self._exchange
        return Sighting(
            requirement,
            entry.address,
            entry.source_of(attribute),
            exchange.first,
            exchange.last,
            judge,
            "" if exchange.clean else DISTURBED,
            proof,
        )


def _outcome(exchange: Exchange) -> str:
    if exchange.abort is not None:
        return f"abort {describe(exchange.abort)}"
    return "confirmed" if exchange.kind == "download" else "answered"


def _judge_existence(verdict: Verdict, entry: Entry, exchange: Exchange) -> None:
    verdict.holds(
        f"existence of {entry.address}",
        expected="an answer other than that it does not exist",
        actual=_outcome(exchange),
        ok=exchange.abort not in MISSING,
    )


def _judge_upload(verdict: Verdict, entry: Entry, exchange: Exchange) -> None:
    verdict.holds(
        f"upload of {entry.address}",
        expected="confirmed",
        actual=_outcome(exchange),
        ok=exchange.confirmed,
    )


def _judge_refusal(verdict: Verdict, what: str, exchange: Exchange) -> None:
    verdict.holds(
        what, expected="an abort", actual=_outcome(exchange), ok=exchange.abort is not None
    )


def _judge_code(verdict: Verdict, code: int) -> None:
    verdict.one_of("abort code", code, cases.REFUSED_WRITE, show=describe)


def _judge_length(verdict: Verdict, entry: Entry, data: bytes) -> None:
    judge_length(entry, data, verdict)


def _judge_value(verdict: Verdict, entry: Entry, data: bytes) -> None:
    judge_value(entry, data, verdict)


def _judge_segments(verdict: Verdict, exchange: Exchange) -> None:
    verdict.holds(
        "toggle bits of the responses",
        expected="those of their requests",
        actual="those" if exchange.toggles else "others",
        ok=exchange.toggles,
    )
    if exchange.announced is not None and exchange.data is not None:
        verdict.equal("octets", len(exchange.data), exchange.announced)


def _judge_confirmation(verdict: Verdict, reply: bytes) -> None:
    verdict.equal(
        "octets 4 to 7 of the confirmation",
        reply[4:],
        bytes(4),
        show=lambda it: it.hex(" ").upper(),
    )
