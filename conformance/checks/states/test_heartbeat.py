"""Heartbeat producer: period, off, lower limit, state (CiA 301 v4.2.0, 7.2.8.3.2.2 and 7.5.2.20)."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil

from conformance.bench.bus.intervals import apart_ms
from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import (
    NO_HEARTBEAT,
    TYPICAL_MS,
    HeartbeatPort,
    name_of,
    state_of,
)
from conformance.checks.limits import gap_tolerance_ms, mean_tolerance_ms
from conformance.checks.steps import ENTER, require_alive, run_and_switch_off, state_word
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, address
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState

PRODUCER = f"{CIA301}, 7.2.8.3.2.2"
BEATS = 20
FRAME_BITS = 65
"""A heartbeat, bit stuffing included."""
FRAMES_FREE = 4
"""A period of fewer frames than these says more about the bus than about the node."""
MOST_TRIED = 25
"""Below a greater minimum than this not every time is tried."""


def _object(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None:
        yield Case(address(producer.object), producer.object, producer.source)


def _periods(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None:
        carried_ms = ceil(FRAMES_FREE * FRAME_BITS * 1000 / spec.bitrate)
        wanted_ms = (carried_ms, TYPICAL_MS)
        for period_ms in sorted(
            {min(max(ms, producer.min_ms), producer.max_ms) for ms in wanted_ms}
        ):
            yield Case(f"{address(producer.object)}/{period_ms}ms", period_ms, producer.source)


@requirement(
    "HB-01",
    level="shall",
    cases=("period_ms", _periods),
    source=PRODUCER,
    effects=("reads", "writes"),
)
def test_heartbeat_keeps_its_period(
    heartbeat: HeartbeatPort, period_ms: int, verdict: Verdict
) -> None:
    """The node produces heartbeats at the period written, within the suite's own tolerance."""
    heartbeat.enter()
    heartbeat.set(period_ms)

    gaps_ms, mean_ms = heartbeat.rhythm(BEATS, period_ms)

    verdict.equal("intervals seen", len(gaps_ms), BEATS)
    verdict.within("heartbeat period", gaps_ms, period_ms, gap_tolerance_ms(period_ms), unit="ms")
    verdict.within(
        "mean heartbeat period",
        mean_ms,
        period_ms,
        mean_tolerance_ms(period_ms),
        unit="ms",
        over=BEATS,
    )


@requirement(
    "HB-02",
    level="shall",
    cases=("index", _object),
    source=PRODUCER,
    effects=("reads", "writes"),
)
def test_heartbeat_starts_at_once(
    node: Node, heartbeat: HeartbeatPort, index: int, verdict: Verdict
) -> None:
    """The first heartbeat comes within one period after the time was written."""
    period_ms = heartbeat.typical_ms
    heartbeat.enter()
    heartbeat.set(heartbeat.producer.off)
    written = node.link.mark()
    heartbeat.set(period_ms)
    confirmed = node.link.since(written, node.channel.is_response)[-1]

    first = node.link.wait(node.is_error_control, 10 * period_ms / 1000, written)

    if first is None:
        verdict.holds(
            f"first heartbeat after download to {address(index)}",
            expected=f"within {period_ms + gap_tolerance_ms(period_ms):g} ms",
            actual=f"none within {10 * period_ms} ms",
            ok=False,
        )
        return
    verdict.at_most(
        "first heartbeat after the confirmation",
        apart_ms(node.link, confirmed, first, 0.0),
        period_ms + gap_tolerance_ms(period_ms),
        unit="ms",
    )


@requirement(
    "HB-03",
    level="shall",
    cases=("index", _object),
    source=f"{CIA301}, 7.5.2.20",
    effects=("reads", "writes"),
)
def test_heartbeat_is_switched_off(
    node: Node, heartbeat: HeartbeatPort, index: int, verdict: Verdict
) -> None:
    """With the documented off value no heartbeat comes once the running period is over."""
    period_ms = run_and_switch_off(heartbeat)
    node.link.listen(1.5 * period_ms / 1000, node.is_error_control)

    silent = node.link.listen(10 * period_ms / 1000, node.is_error_control)

    verdict.equal(f"heartbeats with {address(index)} = off", len(silent), 0)
    require_alive(node)


def _below(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None:
        least = producer.min_ms
        for period_ms in sorted({*range(1, min(least, MOST_TRIED)), least // 2, least - 1} - {0}):
            if period_ms != producer.off:
                yield Case(f"{address(producer.object)}/{period_ms}ms", period_ms, producer.source)


@requirement("HB-04", level="manual", cases=("period_ms", _below), effects=("reads", "writes"))
def test_heartbeat_is_never_faster_than_documented(
    node: Node, heartbeat: HeartbeatPort, period_ms: int, verdict: Verdict
) -> None:
    """A time below the documented minimum is refused, or no heartbeat comes faster than that."""
    producer = heartbeat.producer
    size = node.spec.entries[producer.object, 0].type
    heartbeat.enter()
    heartbeat.set(producer.off)

    transfer = node.try_download(producer.object, 0, size.encode(period_ms))

    if transfer.refused:
        verdict.holds(f"download of {period_ms} ms", expected="an abort", actual="abort", ok=True)
        return
    _, mean_ms = heartbeat.rhythm(BEATS, producer.min_ms)
    if not mean_ms:
        verdict.holds("heartbeats", expected="none, or slower", actual="none", ok=True)
        return
    verdict.at_least(
        "mean heartbeat period",
        mean_ms[0],
        producer.min_ms - mean_tolerance_ms(producer.min_ms),
        unit="ms",
        over=BEATS,
    )


def _states(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    for state in ENTER:
        word = state_word(state)
        if producer is not None and word in producer.states:
            yield Case(word, state, producer.source)


@requirement(
    "HB-05", level="manual", cases=("state", _states), source=PRODUCER, effects=("reads", "writes")
)
def test_heartbeat_carries_the_state(
    node: Node, heartbeat: HeartbeatPort, state: NmtState, verdict: Verdict
) -> None:
    """In each state heartbeats come and carry that state, one octet with bit 7 clear."""
    heartbeat.set(heartbeat.typical_ms)
    node.nmt(ENTER[state])

    seen = heartbeat.collect(4, 8 * heartbeat.typical_ms / 1000)

    settled = sorted({state_of(beat) for beat in seen[1:]}) or [NO_HEARTBEAT]
    verdict.equal("state", " and ".join(settled), name_of(state))
