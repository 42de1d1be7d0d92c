"""Heartbeat producer: long periods, other periods, times below the minimum (CiA 301, 7.2.8.3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

from conformance.bench.bus.intervals import mean_ms
from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import HeartbeatPort
from conformance.checks.limits import gap_tolerance_ms, mean_tolerance_ms
from conformance.checks.steps import require_alive
from conformance.errors import SetupRefused
from conformance.numbers import figure
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, OtherServices, address
from conformance.verdict import Verdict

PRODUCER = f"{CIA301}, 7.2.8.3.2.2"
OBJECT = f"{CIA301}, 7.5.2.20"
LONG_MS = 2000
LONG_BEATS = 3
LONGEST_S = 5.0
"""How long no second heartbeat may come at the longest time."""

BEATS = 5
MOST_MS = 1000
"""Above a greater minimum than this it takes too long to see what becomes of less."""


def _long(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None and producer.min_ms <= LONG_MS <= producer.max_ms:
        yield Case(f"{address(producer.object)}/{LONG_MS}ms", LONG_MS, producer.source)


@requirement(
    "HB-07",
    level="shall",
    cases=("period_ms", _long),
    source=PRODUCER,
    effects=("reads", "writes"),
)
def test_heartbeat_keeps_a_long_period(
    heartbeat: HeartbeatPort, period_ms: int, verdict: Verdict
) -> None:
    """A period of seconds is kept as well, within the suite's own tolerance."""
    heartbeat.enter()
    heartbeat.set(period_ms)

    gaps_ms = heartbeat.gaps_ms(LONG_BEATS, period_ms)

    verdict.equal("intervals seen", len(gaps_ms), LONG_BEATS)
    verdict.within("heartbeat period", gaps_ms, period_ms, gap_tolerance_ms(period_ms), unit="ms")


def _longest(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    entry = None if producer is None else spec.entry(producer.object)
    if producer is None or entry is None:
        return
    edges = {last for reading in entry.readings for _, last in reading.legal or ()}
    legal = [it for it in edges | {producer.max_ms} if entry.always_legal(it)]
    longest = max((it for it in legal if it <= producer.max_ms), default=0)
    if longest > LONGEST_S * 1000:
        yield Case(f"{address(producer.object)}/{longest}ms", longest, producer.source)


@requirement(
    "HB-08",
    level="shall",
    cases=("period_ms", _longest),
    source=PRODUCER,
    effects=("reads", "writes"),
)
def test_longest_period_does_not_wrap_round(
    node: Node, heartbeat: HeartbeatPort, period_ms: int, verdict: Verdict
) -> None:
    """At the longest documented time no second heartbeat comes after seconds."""
    heartbeat.enter()
    heartbeat.set(period_ms)

    seen = node.link.listen(LONGEST_S, node.is_error_control)

    gaps_ms = [(b.time_s - a.time_s) * 1000 for a, b in pairwise(seen)]
    verdict.holds(
        f"heartbeats within {LONGEST_S:g} s",
        expected="1 at most",
        actual=f"{len(seen)}, {gaps_ms[0]:.0f} ms apart" if gaps_ms else str(len(seen)),
        ok=len(seen) <= 1,
    )
    require_alive(node)


class Change(NamedTuple):
    """From one running period to another, in milliseconds."""

    before_ms: int
    after_ms: int


def _changes(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is None:
        return
    short = min(max(100, producer.min_ms), producer.max_ms)
    long = min(3 * short, producer.max_ms)
    if short < long:
        for label, change in (("faster", Change(long, short)), ("slower", Change(short, long))):
            yield Case(f"{address(producer.object)}/{label}", change, producer.source)


@requirement(
    "HB-09",
    level="shall",
    cases=("change", _changes),
    source=OBJECT,
    effects=("reads", "writes"),
)
def test_running_heartbeat_takes_another_period(
    heartbeat: HeartbeatPort, change: Change, verdict: Verdict
) -> None:
    """A new time changes the period of a running heartbeat, after the running period at the latest."""
    heartbeat.enter()
    heartbeat.set(change.before_ms)
    if not heartbeat.gaps_ms(1, change.before_ms):
        raise SetupRefused("there is no heartbeat to be changed, see HB-01")
    heartbeat.set(change.after_ms)

    heartbeat.collect(1, (change.before_ms + change.after_ms) / 1000)
    gaps_ms = heartbeat.gaps_ms(BEATS, change.after_ms)[1:]

    verdict.equal("intervals seen", len(gaps_ms), BEATS - 1)
    margin_ms = abs(change.after_ms - change.before_ms) / 2
    verdict.within("heartbeat period", gaps_ms, change.after_ms, margin_ms, unit="ms")


def _object(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None:
        yield Case(address(producer.object), producer.object, producer.source)


@requirement(
    "HB-12",
    level="shall",
    cases=("index", _object),
    source=OBJECT,
    effects=("reads", "writes"),
)
def test_the_same_time_again_keeps_the_heartbeat_going(
    node: Node, heartbeat: HeartbeatPort, index: int, verdict: Verdict
) -> None:
    """With the time it has written once more the heartbeat goes on."""
    period_ms = heartbeat.typical_ms
    heartbeat.enter()
    heartbeat.set(period_ms)
    if not heartbeat.gaps_ms(1, period_ms):
        raise SetupRefused("there is no heartbeat to go on, see HB-01")
    heartbeat.set(period_ms)
    written_s = node.link.time_s

    seen = heartbeat.collect(BEATS, 2 * BEATS * period_ms / 1000)

    times_s = [written_s, *(beat.time_s for beat in seen)]
    if len(seen) < BEATS:
        times_s.append(node.link.time_s)
    longest_ms = max((b - a) * 1000 for a, b in pairwise(times_s))
    verdict.at_most(
        f"longest pause after {address(index)} was written again",
        longest_ms,
        1.5 * period_ms,
        unit="ms",
    )


def _below(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None and producer.min_ms <= MOST_MS:
        for period_ms in sorted({1, producer.min_ms - 1} - {0, producer.off, producer.min_ms}):
            yield Case(f"{address(producer.object)}/{period_ms}ms", period_ms, producer.source)


@requirement("HB-15", level="manual", cases=("period_ms", _below), effects=("reads", "writes"))
def test_time_below_the_minimum_is_treated_as_documented(
    node: Node, heartbeat: HeartbeatPort, period_ms: int, spec: DeviceSpec, verdict: Verdict
) -> None:
    """A time below the minimum does to a running heartbeat what some reading of the manual has."""
    producer = heartbeat.producer
    before_ms = min(3 * producer.min_ms, producer.max_ms)
    size = node.spec.entries[producer.object, 0].type
    heartbeat.enter()
    heartbeat.set(before_ms)

    transfer = node.try_download(producer.object, 0, size.encode(period_ms))

    heartbeat.collect(1, 2 * before_ms / 1000)
    beats = heartbeat.beats(BEATS, before_ms)[1:]
    if transfer.refused:
        seen = "refused"
    else:
        known = {"ignored": before_ms, "clamped": producer.min_ms, "accepted": period_ms}
        seen = _followed(node, beats, known)
    readings: dict[str, OtherServices | None] = {
        services.heartbeat_producer.below_minimum: other
        for services, other in spec.services_readings[::-1]
        if services.heartbeat_producer is not None
    }
    verdict.holds(
        f"{period_ms} ms", expected=" or ".join(sorted(readings)), actual=seen, ok=seen in readings
    )
    followed = readings.get(seen)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)


def _followed(node: Node, beats: list[Stamped], known: dict[str, int]) -> str:
    """Return the word whose period the heartbeats have on average."""
    if len(beats) < 2:
        return "confirmed, and no heartbeat"
    for word, period_ms in known.items():
        found_ms = mean_ms(node.link, beats, period_ms)[0]
        if abs(found_ms - period_ms) <= mean_tolerance_ms(period_ms):
            return word
    return f"confirmed, and a period of {figure(found_ms, 4)} ms"
