"""TPDO: its event timer switched off, changed, set too short, and started (CiA 301 v4.2.0, 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

from conformance.bench.bus.intervals import apart_ms
from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort
from conformance.bench.settings.in_force import InForce
from conformance.checks.limits import gap_tolerance_ms, mean_tolerance_ms
from conformance.checks.pdo.tpdo_cases import (
    Numbered,
    Readings,
    asynchronous_type,
    judge_reading,
    parameter,
    parameter_of,
    readings_of,
    timed,
)
from conformance.checks.pdo.tpdos import (
    EVENT_MS,
    EVENT_TIMER_SUB,
    WINDOW_S,
    event_time_ms,
    others_off,
    port_of,
    require_acts,
    set_up,
    waiting,
)
from conformance.errors import SetupRefused
from conformance.numbers import figure
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import Tpdo
from conformance.spec.model import DeviceSpec, is_legal
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtCommand

COMMUNICATION = f"{CIA301}, 7.5.2.37"
OLD_MS, NEW_MS = 100, 40
OTHER_MS = 10
FIRST_MS = 200
SEEN = 8


def _run_by_timer(
    node: Node, number: int, at_least_ms: int, in_force: InForce, verdict: Verdict
) -> int:
    """Have a TPDO sent by its event timer, set to another time than before; return the period in ms.

    Raises:
        SetupRefused: It is not sent at all.
    """
    port, kind = port_of(node, number), asynchronous_type(node.spec, number)
    before_ms = port.period_ms
    found = (event_time_ms(node.spec, number, at_least_ms + more) for more in (0, OTHER_MS))
    event_ms = next((time for time in found if time not in (None, before_ms)), None)
    if kind is None or event_ms is None:
        raise SetupRefused("the manual offers no event timer to make the TPDO come")
    others_off(node, number)
    set_up(node, port, kind, event_ms)
    port.start()
    require_acts(in_force, port, before_ms, verdict)
    if len(port.collect(2, 4 * event_ms / 1000)) < 2:
        raise SetupRefused("the TPDO does not come, see TPDO-02")
    return event_ms


def _anew(node: Node, number: int) -> None:
    """Leave Operational and enter it again."""
    node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    port_of(node, number).start()


def _can_be_off(spec: DeviceSpec) -> Iterable[Case]:
    for case in timed(spec):
        timer = parameter(spec, case.subject, EVENT_TIMER_SUB)
        if timer is not None and is_legal(0, timer.legal):
            yield case


@requirement(
    "TPDO-07",
    level="shall",
    cases=("number", waiting(_can_be_off)),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_event_time_0_switches_the_timer_off(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """With an event time of 0 an asynchronous TPDO is not sent again and again."""
    port, timer = port_of(node, number), parameter_of(node, number, EVENT_TIMER_SUB)
    period_ms = _run_by_timer(node, number, EVENT_MS, in_force, verdict)

    answer = node.try_download(*timer.key, timer.type.encode(0))
    refusing = [it for it in timer.alternatives if not is_legal(0, it.entry.legal)]
    verdict.holds(
        "event time of 0",
        expected="confirmed or refused" if refusing else "confirmed",
        actual=str(answer),
        ok=answer.confirmed or (answer.refused and bool(refusing)),
    )
    if answer.refused and refusing:
        verdict.follows(refusing[0].ambiguity, refusing[0].reading)
    if not answer.confirmed:
        return
    if in_force.repeat():
        port.start()
    for when in ("while it was sent", "before Operational was entered"):
        seen = port.listen(max(WINDOW_S, 4 * period_ms / 1000))
        verdict.equal(f"TPDOs with nothing new, 0 written {when}", _repeated(seen), 0)
        _anew(node, number)


def _repeated(seen: list[Stamped]) -> int:
    """Count the TPDOs that carry what the one before did: a change of value did not send them."""
    return sum(a.frame.data == b.frame.data for a, b in pairwise(seen))


def _changeable(spec: DeviceSpec) -> Iterable[Case]:
    for case in timed(spec):
        old, new = (event_time_ms(spec, case.subject, ms) for ms in (OLD_MS, NEW_MS))
        if old != new:
            yield case


@requirement(
    "TPDO-08",
    level="shall",
    cases=("number", waiting(_changeable)),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_new_event_time_takes_effect(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """A new event time counts from the timer's next run or next start, as documented, and is kept by then."""
    port, timer = port_of(node, number), parameter_of(node, number, EVENT_TIMER_SUB)
    old_ms = _run_by_timer(node, number, OLD_MS, in_force, verdict)
    new_ms = event_time_ms(node.spec, number, NEW_MS) or NEW_MS

    mark = node.link.mark()
    port.collect(1, 2 * old_ms / 1000)
    node.download(*timer.key, new_ms)
    port.collect(SEEN, SEEN * 2 * old_ms / 1000)
    seen = node.link.since(mark, port.matches)
    present, later = port.gaps_ms(seen[:2], old_ms), seen[1:]
    in_force.repeat()
    _anew(node, number)
    anew = port.gaps_ms(port.collect(SEEN, SEEN * 2 * old_ms / 1000), new_ms)[1:]

    readings = readings_of(node.spec, lambda tpdo: tpdo.new_event_time)
    if "open" not in readings:
        verdict.within("period that runs", present, old_ms, gap_tolerance_ms(old_ms), unit="ms")
    kept = port.gaps_ms(later, old_ms)
    start = bool(kept) and all(abs(it - old_ms) <= gap_tolerance_ms(old_ms) for it in kept)
    next_ms = old_ms if start else new_ms
    behind = port.gaps_ms(later[1:], next_ms)
    verdict.within("periods behind it", behind, next_ms, gap_tolerance_ms(next_ms), unit="ms")
    verdict.within(
        "period after entering Operational", anew, new_ms, gap_tolerance_ms(new_ms), unit="ms"
    )
    followed = readings.get("next-start" if start else "next-run")
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)


def _too_short(spec: DeviceSpec) -> Iterable[Case]:
    least_ms = spec.services.tpdo.min_cycle_ms if spec.services.tpdo else None
    if least_ms is not None:
        for case in timed(spec):
            for figure in sorted({1, least_ms - 1} - {0}):
                numbered = Numbered(case.subject, figure)
                yield Case(f"{case.label}/{figure}ms", numbered, case.section)


@requirement(
    "TPDO-09",
    level="manual",
    cases=("timer", waiting(_too_short)),
    effects=("reads", "writes"),
)
def test_event_time_below_the_least_cycle(
    node: Node, timer: Numbered, in_force: InForce, verdict: Verdict
) -> None:
    """A TPDO does not come faster than its least cycle: a shorter event time is refused, raised or dropped."""
    port, entry = (
        port_of(node, timer.number),
        parameter_of(node, timer.number, EVENT_TIMER_SUB),
    )
    before_ms = _run_by_timer(node, timer.number, OLD_MS, in_force, verdict)

    answer = node.try_download(*entry.key, entry.type.encode(timer.figure))
    if answer.confirmed:
        in_force.repeat()
    _anew(node, timer.number)
    seen = port.collect(SEEN + 2, SEEN * 2 * before_ms / 1000)[1:]

    outcome = "refused" if answer.refused else _outcome(node, port, seen, before_ms, timer.figure)
    judge_reading(verdict, f"event time of {timer.figure} ms", _below(node.spec), outcome)
    if answer.refused:
        gaps = port.gaps_ms(seen, before_ms)
        verdict.within(
            "period after the refusal", gaps, before_ms, gap_tolerance_ms(before_ms), unit="ms"
        )


def _below(spec: DeviceSpec) -> Readings:
    def says(tpdo: Tpdo) -> str:
        return "accepted" if tpdo.min_cycle_ms is None else tpdo.below_min_cycle

    return readings_of(spec, says)


def _outcome(
    node: Node, port: TpdoPort, seen: list[Stamped], before_ms: int, written_ms: int
) -> str:
    """Say what became of an event time, by the TPDOs that came then."""
    tpdo = node.spec.services.tpdo
    least_ms = tpdo.min_cycle_ms if tpdo is not None else None
    words = {least_ms: "raised", before_ms: "ignored", written_ms: "accepted"}
    for period_ms, word in words.items():
        if period_ms and any(
            abs(it - period_ms) <= mean_tolerance_ms(period_ms)
            for it in port.mean_ms(seen, period_ms)
        ):
            return word
    found_ms = port.mean_ms(seen, before_ms)
    return f"sent every {figure(found_ms[0], 4)} ms" if found_ms else "not sent any more"


def _starts_at_once(spec: DeviceSpec) -> Iterable[Case]:
    if "open" not in readings_of(spec, lambda tpdo: tpdo.first):
        yield from timed(spec)


@requirement(
    "TPDO-10",
    level="manual",
    cases=("number", waiting(_starts_at_once)),
    effects=("reads", "writes"),
)
def test_first_tpdo_comes_at_once(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """On entering Operational the TPDO is sent at once, not when the first period is over."""
    port = port_of(node, number)
    period_ms = _run_by_timer(node, number, FIRST_MS, in_force, verdict)
    node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)

    started = node.nmt(NmtCommand.START)
    seen = port.collect(1, 4 * period_ms / 1000)

    delays_ms = [apart_ms(node.link, started, it, 0.0) for it in seen]
    verdict.equal("TPDOs in four periods", "some" if seen else "none", "some")
    for delay_ms in delays_ms:
        verdict.at_most("time to the first TPDO", delay_ms, period_ms / 2, unit="ms")
