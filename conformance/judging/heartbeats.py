"""What a recording shows of a heartbeat time that was written (CiA 301 v4.2.0, 7.2.8.3.2.2 and 7.5.2.20)."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from functools import partial
from itertools import pairwise

from conformance.checks.limits import gap_tolerance_ms, mean_tolerance_ms
from conformance.judging.exchanges import Exchange
from conformance.judging.recording import Seen
from conformance.judging.rhythm import TWICE_MS
from conformance.judging.sightings import Sighting
from conformance.judging.states import LOSSY
from conformance.judging.timeline import Timeline, number
from conformance.spec.document import HeartbeatProducer
from conformance.spec.model import address
from conformance.verdict import Verdict
from conformance.wire.cob_id import heartbeat

SILENT_PERIODS = 10
"""So many periods without a heartbeat show that it is off."""

OVER = 1.5
"""So many periods after it was switched off one may still have been on its way."""

BEATS = 20
UNEVEN = 1.5
"""Gaps that differ by more tell of lost frames, so that no mean follows from them."""


def heartbeats(timeline: Timeline) -> Iterator[Sighting]:
    """Return what a recording shows of writing the heartbeat time."""
    producer = timeline.spec.services.heartbeat_producer
    if producer is None or (producer.object, 0) not in timeline.spec.entries:
        return
    key = (producer.object, 0)
    lines = sorted({*timeline.changes({key}), *(seen.line for seen, _ in timeline.commands)})
    for exchange in timeline.exchanges.all:
        if exchange.kind == "download" and exchange.key == key:
            place = bisect_right(lines, exchange.last.line)
            ends = min([timeline.lasts_until(exchange.last.line), *lines[place : place + 1]])
            yield from _Written(timeline, producer, exchange, ends).sightings()


class _Written:
    """One download of the heartbeat time, and what came after it.

    Args:
        timeline: The recording.
        producer: The spec's.
        exchange: The download.
        ends: The line from which on something else may decide on the heartbeat.
    """

    def __init__(
        self, timeline: Timeline, producer: HeartbeatProducer, exchange: Exchange, ends: int
    ) -> None:
        self._timeline = timeline
        self._producer = producer
        self._exchange = exchange
        self._ends = ends
        between = timeline.recording.seen[exchange.last.line : ends - 1]
        self._end_s = between[-1].time_s if between else exchange.last.time_s
        own = heartbeat(timeline.spec.node_id)
        self._asked = any(it.frame.can_id == own and it.frame.remote for it in between)
        self._beats = [
            it
            for it in between
            if it.frame.can_id == own and not it.frame.extended and it.frame.data != b"\0"
        ]

    def sightings(self) -> Iterator[Sighting]:
        """Return what it shows."""
        exchange, producer = self._exchange, self._producer
        entry = self._timeline.spec.entries[exchange.key]
        carried = bytes(exchange.parts)
        if not exchange.clean or not exchange.expedited or len(carried) < (entry.type.size or 0):
            return
        sent = Exchange("download", *exchange.key, exchange.first, exchange.last, data=carried)
        sent.sized = exchange.sized
        period_ms = number(entry, sent)
        if period_ms is None or self._asked:
            return
        before = self._timeline.known(exchange.key, exchange.first.line - 1)
        if 0 < period_ms < self._least_ms() and period_ms != producer.off:
            yield from self._below(period_ms)
        elif before is None or not exchange.confirmed:
            return
        elif period_ms == producer.off and before.value != producer.off:
            yield from self._off(before.value)
        elif before.value == producer.off and producer.min_ms <= period_ms <= producer.max_ms:
            yield from self._first(period_ms)

    def _least_ms(self) -> int:
        """Return the least period under any reading."""
        found = (it.heartbeat_producer for it, _ in self._timeline.spec.services_readings)
        return min(it.min_ms for it in found if it is not None)

    def _first(self, period_ms: int) -> Iterator[Sighting]:
        confirmed, beats = self._exchange.last, self._beats
        most_ms = period_ms + gap_tolerance_ms(period_ms)
        label = address(self._producer.object)
        if not beats and self._lives_on(SILENT_PERIODS * period_ms / 1000):
            judge = partial(_judge_none, most_ms=most_ms, waited_ms=SILENT_PERIODS * period_ms)
            yield self._sighting("HB-02", label, confirmed, judge, self._doubt(period_ms))
        if len(beats) <= 1:
            return
        timeline = self._timeline
        jitter_s = timeline.jitter_ms / 1000
        waited_s = timeline.recording.waited_s(beats[0], timeline.bitrate, jitter_s)
        after_ms = max(0.0, beats[0].time_s - confirmed.time_s - waited_s) * 1000
        judge = partial(_judge_first, after_ms=after_ms, most_ms=most_ms)
        yield self._sighting("HB-02", label, beats[0], judge, self._doubt(period_ms))

    def _lives_on(self, wait_s: float) -> bool:
        """Tell whether the node answers so long after the download, and the recorder takes heartbeats."""
        since_s = self._exchange.last.time_s + wait_s
        return any(it.frame.data != b"\0" for it in self._timeline.error_control) and any(
            it.last.time_s > since_s and it.last.line < self._ends
            for it in self._timeline.exchanges.all
        )

    def _doubt(self, period_ms: int) -> str:
        """Return why a late heartbeat may be one that the recording lacks."""
        most_ms = period_ms + gap_tolerance_ms(period_ms) + self._timeline.jitter_ms
        gaps_ms = [(b.time_s - a.time_s) * 1000 for a, b in pairwise(self._beats)]
        lossy = self._timeline.exchanges.disturbed or any(it > most_ms for it in gaps_ms)
        return LOSSY if lossy else ""

    def _off(self, period_ms: int) -> Iterator[Sighting]:
        begins_s = self._exchange.last.time_s + OVER * period_ms / 1000
        if self._end_s - begins_s < SILENT_PERIODS * period_ms / 1000:
            return
        late = [it for it in self._beats if it.time_s > begins_s]
        label = address(self._producer.object)
        judge = partial(_judge_silence, label=label, count=len(late))
        last = late[-1] if late else self._exchange.last
        doubt = LOSSY if self._timeline.exchanges.disturbed else ""
        yield self._sighting("HB-03", label, last, judge, doubt)

    def _below(self, period_ms: int) -> Iterator[Sighting]:
        least_ms, exchange = self._least_ms(), self._exchange
        label = f"{address(self._producer.object)}/{period_ms}ms"
        if exchange.abort is not None:
            judge = partial(_judge_refusal, period_ms=period_ms)
            yield self._sighting("HB-04", label, exchange.last, judge, "")
            return
        beats = self._beats
        gaps_ms = [(b.time_s - a.time_s) * 1000 for a, b in pairwise(beats)]
        off_ms = 2 * self._timeline.jitter_ms
        if len(gaps_ms) < BEATS or max(gaps_ms) > UNEVEN * min(gaps_ms) + off_ms:
            return
        mean_ms = (beats[-1].time_s - beats[0].time_s) * 1000 / len(gaps_ms)
        judge = partial(_judge_mean, mean_ms=mean_ms, least_ms=least_ms, over=len(gaps_ms))
        doubt = "the recording has frames twice" if min(gaps_ms) < TWICE_MS else ""
        yield self._sighting("HB-04", label, beats[-1], judge, doubt)

    def _sighting(
        self, requirement: str, label: str, last: Seen, judge: partial[None], doubt: str
    ) -> Sighting:
        section = self._producer.source
        return Sighting(requirement, label, section, self._exchange.first, last, judge, doubt)


def _judge_none(verdict: Verdict, most_ms: float, waited_ms: int) -> None:
    verdict.holds(
        "first heartbeat after the confirmation",
        expected=f"within {most_ms:g} ms",
        actual=f"none within {waited_ms} ms",
        ok=False,
    )


def _judge_first(verdict: Verdict, after_ms: float, most_ms: float) -> None:
    verdict.at_most("first heartbeat after the confirmation", after_ms, most_ms, unit="ms")


def _judge_silence(verdict: Verdict, label: str, count: int) -> None:
    verdict.equal(f"heartbeats with {label} = off", count, 0)


def _judge_refusal(verdict: Verdict, period_ms: int) -> None:
    verdict.holds(f"download of {period_ms} ms", expected="an abort", actual="abort", ok=True)


def _judge_mean(verdict: Verdict, mean_ms: float, least_ms: int, over: int) -> None:
    allowed_ms = least_ms - mean_tolerance_ms(least_ms)
    verdict.at_least("mean heartbeat period", mean_ms, allowed_ms, unit="ms", over=over)
