"""TPDO: when it is sent (CiA 301 v4.2.0, 7.2.2 and 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

from conformance.bench.link import Stamped
from conformance.bench.node import Node
from conformance.bench.tpdo import TpdoPort
from conformance.checks.limits import gap_tolerance_ms, mean, mean_tolerance_ms
from conformance.checks.steps import ENTER, require_alive
from conformance.checks.tpdos import (
    ASYNCHRONOUS,
    allows,
    disablable,
    event_time_ms,
    listen,
    others_off,
    paced,
    port_of,
    send_sync,
    set_up,
    sync_ms,
    tpdos,
)
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState

COMMUNICATION = f"{CIA301}, 7.5.2.37"
LAST_S = 0.2
EVENT_TIMES_MS = (20, 100)
SYNC_TYPES = (1, 2, 3, 240)
PERIODS = 20
PERIODS_BEFORE = 4


class Numbered(NamedTuple):
    """A TPDO and one figure to try."""

    number: int
    figure: int


def _event_timers(spec: DeviceSpec) -> Iterable[Case]:
    for case in tpdos(spec):
        times = {event_time_ms(spec, case.subject, at_least) for at_least in EVENT_TIMES_MS}
        if any(allows(spec, case.subject, n) for n in ASYNCHRONOUS):
            for figure in sorted(time for time in times if time is not None):
                numbered = Numbered(case.subject, figure)
                yield Case(f"{case.label}/{figure}ms", numbered, case.section)


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
    cases=("number", tpdos),
    source=f"{CIA301}, 7.3.2.2.5",
    effects=("reads", "writes"),
)
def test_tpdo_is_sent_in_operational_only(node: Node, number: int, verdict: Verdict) -> None:
    """A TPDO is sent in Operational, and neither in Pre-operational nor in Stopped."""
    port, pace = port_of(node, number), paced(node, number)
    set_up(node, port, pace.transmission_type, pace.event_ms)
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
    cases=("timer", _event_timers),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_event_timer_sets_the_period(node: Node, timer: Numbered, verdict: Verdict) -> None:
    """With an asynchronous type the TPDO is sent at the period of its event timer."""
    port = port_of(node, timer.number)
    others_off(node, timer.number)
    before_ms = port.event_ms
    kind = next(n for n in ASYNCHRONOUS if allows(node.spec, timer.number, n))
    set_up(node, port, kind, timer.figure)
    port.start()
    if timer.figure != before_ms:
        _require_in_force(port, before_ms)

    seen = port.collect(PERIODS + 2, (PERIODS + 2) * timer.figure * 2 / 1000)

    gaps_ms = [(b.time_s - a.time_s) * 1000 for a, b in pairwise(seen[1:])]
    verdict.equal("intervals seen", len(gaps_ms), PERIODS)
    verdict.within("TPDO period", gaps_ms, timer.figure, gap_tolerance_ms(timer.figure), unit="ms")
    verdict.within(
        "mean TPDO period",
        mean(gaps_ms),
        timer.figure,
        mean_tolerance_ms(timer.figure),
        unit="ms",
    )


@requirement(
    "TPDO-03",
    level="manual",
    cases=("kind", _sync_types),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_tpdo_follows_every_nth_sync(node: Node, kind: Numbered, verdict: Verdict) -> None:
    """With a synchronous type n the TPDO is sent after every n-th SYNC."""
    port = port_of(node, kind.number)
    others_off(node, kind.number)
    before_ms = port.event_ms
    set_up(node, port, kind.figure)
    port.start()
    _require_in_force(port, before_ms)

    syncs = 2 * kind.figure if kind.figure > 10 else 5 * kind.figure
    answered = _send_syncs(node, port, syncs)

    wanted = syncs // kind.figure
    verdict.equal(f"TPDOs after {syncs} SYNCs", sum(map(len, answered)), wanted)
    places = [place for place, seen in enumerate(answered) if seen]
    distances = sorted({b - a for a, b in pairwise(places)})
    verdict.equal("SYNCs from TPDO to TPDO", distances, [kind.figure])


def _require_in_force(port: TpdoPort, before_ms: int) -> None:
    """Make sure that a TPDO acts on its new parameters, where they may have to be stored first.

    Raises:
        SetupRefused: It is still sent at the period it had before.
    """
    later = port.may_act_later
    if later is None or not before_ms:
        return
    seen = port.collect(PERIODS_BEFORE + 1, (PERIODS_BEFORE + 2) * before_ms / 1000)
    gaps_ms = [(b.time_s - a.time_s) * 1000 for a, b in pairwise(seen[1:])]
    tolerance_ms = gap_tolerance_ms(before_ms)
    if gaps_ms and all(abs(gap_ms - before_ms) <= tolerance_ms for gap_ms in gaps_ms):
        raise SetupRefused(
            f"the TPDO is still sent every {before_ms} ms; new parameters may have to be stored "
            f"and the node reset first (reading {later.reading} of {later.ambiguity})"
        )


def _send_syncs(node: Node, port: TpdoPort, count: int) -> list[list[Stamped]]:
    """Send SYNCs and return the TPDOs that came after each, before the next."""
    answered = []
    for _ in range(count):
        send_sync(node)
        answered.append(port.listen(sync_ms(node.spec) / 1000))
    answered[-1] += port.listen(LAST_S)
    return answered


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
