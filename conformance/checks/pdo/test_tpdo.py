"""TPDO: when it is sent (CiA 301 v4.2.0, 7.2.2 and 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.settings.in_force import InForce
from conformance.checks.limits import gap_tolerance_ms, mean_tolerance_ms
from conformance.checks.pdo.tpdo_cases import Numbered
from conformance.checks.pdo.tpdos import (
    ASYNCHRONOUS,
    act_on,
    allows,
    disablable,
    event_time_ms,
    listen,
    others_off,
    paced,
    port_of,
    send_syncs,
    set_up,
    tpdos,
    waiting,
)
from conformance.checks.steps import ENTER, require_alive
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState

COMMUNICATION = f"{CIA301}, 7.5.2.37"
EVENT_TIMES_MS = (20, 100, 300)
"""The last one needs two octets."""
SYNC_TYPES = (1, 2, 3, 240)
LONGEST_S = 2.0


def _periods(period_ms: int) -> int:
    """Return over how many periods an event timer is watched."""
    return max(4, min(20, round(LONGEST_S * 1000 / period_ms)))


def _event_times(spec: DeviceSpec) -> Iterable[int]:
    """Return the least cycle that is documented, and longer times."""
    least_ms = spec.services.tpdo.min_cycle_ms if spec.services.tpdo else None
    return EVENT_TIMES_MS if least_ms is None else (least_ms, *EVENT_TIMES_MS)


class Timed(NamedTuple):
    """A TPDO, an event time and an asynchronous type to try."""

    number: int
    period_ms: int
    kind: int


def _event_timers(spec: DeviceSpec) -> Iterable[Case]:
    for case in tpdos(spec):
        kinds = [kind for kind in ASYNCHRONOUS if allows(spec, case.subject, kind)]
        found = {event_time_ms(spec, case.subject, at_least) for at_least in _event_times(spec)}
        times = sorted(time for time in found if time is not None)
        for kind in kinds:
            suffix = "" if kind == kinds[0] else f"/type-{kind}"
            for period_ms in times if kind == kinds[0] else times[:1]:
                timed = Timed(case.subject, period_ms, kind)
                yield Case(f"{case.label}/{period_ms}ms{suffix}", timed, case.section)


def _sync_types(spec: DeviceSpec) -> Iterable[Case]:
    if spec.services.sync_consumer is not None:
        for case in tpdos(spec):
            for figure in SYNC_TYPES:
                if allows(spec, case.subject, figure):
                    numbered = Numbered(case.subject, figure)
                    yield Case(f"{case.label}/type-{figure}", numbered, case.section)


@requirement(
    "TPDO-01",
    level="shall",
    cases=("number", waiting(tpdos)),
    source=f"{CIA301}, 7.3.2.2.5",
    effects=("reads", "writes"),
)
def test_tpdo_is_sent_in_operational_only(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """A TPDO is sent in Operational, and neither in Pre-operational nor in Stopped."""
    port, pace = port_of(node, number), paced(node, number)
    before_ms = port.period_ms
    set_up(node, port, pace.transmission_type, pace.event_ms)
    port.start()
    act_on(in_force, port, before_ms, verdict)
    for state in (NmtState.OPERATIONAL, NmtState.STOPPED, NmtState.PRE_OPERATIONAL):
        node.nmt(ENTER[state])
        node.link.listen(pace.period_ms / 1000, port.matches)

        seen = len(listen(node, port, pace))

        wanted = "some" if state is NmtState.OPERATIONAL else "none"
        verdict.equal(
            f"TPDOs in {state.name.capitalize().replace('_', '-')}",
            "some" if seen else "none",
            wanted,
        )
    require_alive(node)


@requirement(
    "TPDO-02",
    level="shall",
    cases=("timer", waiting(_event_timers)),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_event_timer_sets_the_period(
    node: Node, timer: Timed, in_force: InForce, verdict: Verdict
) -> None:
    """With an asynchronous type the TPDO is sent at the period of its event timer."""
    port = port_of(node, timer.number)
    others_off(node, timer.number)
    before_ms = port.period_ms
    set_up(node, port, timer.kind, timer.period_ms)
    port.start()
    if timer.period_ms != before_ms:
        act_on(in_force, port, before_ms, verdict)

    periods = _periods(timer.period_ms)
    seen = port.collect(periods + 2, (periods + 2) * timer.period_ms * 2 / 1000)

    gaps = port.gaps_ms(seen[1:], timer.period_ms)
    verdict.equal("intervals seen", len(gaps), periods)
    verdict.within(
        "TPDO period", gaps, timer.period_ms, gap_tolerance_ms(timer.period_ms), unit="ms"
    )
    verdict.within(
        "mean TPDO period",
        port.mean_ms(seen[1:], timer.period_ms),
        timer.period_ms,
        mean_tolerance_ms(timer.period_ms),
        unit="ms",
        over=periods,
    )


@requirement(
    "TPDO-03",
    level="manual",
    cases=("kind", waiting(_sync_types)),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_tpdo_follows_every_nth_sync(
    node: Node, kind: Numbered, in_force: InForce, verdict: Verdict
) -> None:
    """With a synchronous type n the TPDO is sent after every n-th SYNC."""
    port = port_of(node, kind.number)
    others_off(node, kind.number)
    before_ms = port.period_ms
    set_up(node, port, kind.figure)
    port.start()
    act_on(in_force, port, before_ms, verdict)

    syncs = 2 * kind.figure if kind.figure > 10 else 5 * kind.figure
    answered = send_syncs(node, port, syncs)

    wanted = syncs // kind.figure
    verdict.equal(f"TPDOs after {syncs} SYNCs", sum(map(len, answered)), wanted)
    places = [place for place, seen in enumerate(answered) if seen]
    distances = sorted({b - a for a, b in pairwise(places)})
    verdict.equal("SYNCs from TPDO to TPDO", distances, [kind.figure])


@requirement(
    "TPDO-04",
    level="manual",
    cases=("number", disablable),
    source=f"{CIA301}, 7.5.2.37",
    effects=("reads", "writes"),
)
def test_disabled_tpdo_is_not_sent(node: Node, number: int, verdict: Verdict) -> None:
    """With bit 31 of its COB-ID set a TPDO is not sent; with the bit cleared it is."""
    port, pace = port_of(node, number), paced(node, number)
    set_up(node, port, pace.transmission_type, pace.event_ms)
    port.disable()
    port.start()

    disabled = len(listen(node, port, pace))
    port.enable()
    enabled = len(listen(node, port, pace))

    verdict.equal("TPDOs with bit 31 set", disabled, 0)
    verdict.equal("TPDOs with bit 31 clear", "some" if enabled else "none", "some")
