"""The object that lets a node start by itself: stored or not, after each kind of start (CiA 301, 7.3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import get_args

from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import HeartbeatPort, name_of
from conformance.bench.services.starting import (
    Restart,
    Started,
    begin_restart,
    observe_starts,
    start_values,
)
from conformance.bench.session import Bench
from conformance.checks.cases import with_heartbeat
from conformance.effects import Effect
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import Services
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, address
from conformance.spec.services import StartBy
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState

POWER_ON_VALUES = f"{CIA301}, 7.3.2.2.1"
Seen = dict[tuple[Restart, bool], Started]


def _rules(spec: DeviceSpec) -> Iterator[StartBy]:
    """Return the rule of the start object, as the first reading that has one."""
    rules = [it.nmt.start_by for it, _ in spec.services_readings if it.nmt.start_by is not None]
    yield from rules[:1]


def _rule(spec: DeviceSpec) -> StartBy:
    for rule in _rules(spec):
        return rule
    raise SetupRefused("the manual documents no object for the automatic start")


def _restarts(spec: DeviceSpec) -> Iterable[Case]:
    for rule in _rules(spec):
        index, _ = key_of(rule.object)
        if all(it.store is not None for it, _ in spec.services_readings):
            for how in get_args(Restart):
                effects: tuple[Effect, ...] = ("power",) if how == "power-on" else ()
                yield Case(f"{address(index)}/{how}", how, rule.source, effects)


@requirement(
    "BOOT-03",
    level="manual",
    cases=("how", with_heartbeat(_restarts)),
    effects=("reads", "writes", "resets", "non-volatile"),
)
def test_start_object_decides_the_state_after_a_start(
    bench: Bench,
    node: Node,
    heartbeat: HeartbeatPort,
    how: Restart,
    spec: DeviceSpec,
    verdict: Verdict,
) -> None:
    """By the stored value of the start object the node starts by itself, or waits for a command."""
    seen = _observed(bench, node, heartbeat, how, verdict)

    states = tuple(seen[how, starts].state for starts in (True, False))
    readings = {_states(it, how): other for it, other in spec.services_readings[::-1]}
    verdict.holds(
        "state with the value to start by itself, and with another",
        expected=" or ".join(sorted(map(_words, readings))),
        actual=_words(states),
        ok=states in readings,
    )
    followed = readings.get(states)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)


def _observed(
    bench: Bench, node: Node, heartbeat: HeartbeatPort, how: Restart, verdict: Verdict
) -> Seen:
    """Return the starts with both values; power is switched for items alone that ask for it."""
    power = how == "power-on"
    restarts = [it for it in get_args(Restart) if (it == "power-on") == power]
    rule = _rule(node.spec)
    seen = bench.observations.once(
        f"start object, power {power}",
        dict,
        lambda: observe_starts(node, heartbeat, rule, restarts),
    )
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def _states(services: Services, how: Restart) -> tuple[str, ...]:
    """Return the states with both values of the start object, as one reading has them."""
    rule = services.nmt.start_by
    acts = rule is not None and (how == "power-on" or rule.after == "every-start")
    by_itself = (services.nmt.automatic_start or acts, services.nmt.automatic_start)
    return tuple(
        name_of(NmtState.OPERATIONAL if it else NmtState.PRE_OPERATIONAL) for it in by_itself
    )


def _words(states: tuple[str, ...]) -> str:
    return ", ".join(states)


def _starts_anew(spec: DeviceSpec) -> Iterable[Case]:
    return (case for case in _restarts(spec) if case.subject != "reset-communication")


@requirement(
    "BOOT-04",
    level="shall",
    cases=("how", with_heartbeat(_starts_anew)),
    source=POWER_ON_VALUES,
    effects=("reads", "writes", "resets"),
)
def test_start_object_not_stored_decides_nothing(
    node: Node, heartbeat: HeartbeatPort, how: Restart, verdict: Verdict
) -> None:
    """Another value of the start object, not stored, does not change how the node starts."""
    rule = _rule(node.spec)
    key = key_of(rule.object)
    before = _state_after(node, heartbeat, how)
    node.hold_back()
    present = node.number(*key)
    node.download(*key, next(it for it in start_values(rule, present) if it != present))

    after = _state_after(node, heartbeat, how)

    verdict.equal("state", after, before)


def _state_after(node: Node, heartbeat: HeartbeatPort, how: Restart) -> str:
    node.await_boot_up(begin_restart(node, how))
    return heartbeat.state()


def _sends_by_itself(spec: DeviceSpec) -> Iterable[Case]:
    """Return the power-on case where every reading has TPDOs by an event timer after it."""
    documented = all(it.nmt.start_by is not None for it, _ in spec.services_readings)
    tpdo = spec.services.tpdo
    timer = None if tpdo is None else spec.entry(tpdo.communication, 5)
    if documented and timer is not None and timer.default:
        yield from (case for case in _restarts(spec) if case.subject == "power-on")


@requirement(
    "BOOT-06",
    level="manual",
    cases=("how", with_heartbeat(_sends_by_itself)),
    effects=("reads", "writes", "resets", "non-volatile"),
)
def test_node_that_starts_by_itself_sends_its_tpdos(
    bench: Bench, node: Node, heartbeat: HeartbeatPort, how: Restart, verdict: Verdict
) -> None:
    """With the value to start by itself stored, TPDOs come after power-on without a command."""
    if not node.number(_first_timer(node), 5):
        raise SetupRefused("the event timer is off, so nothing has to come")

    seen = _observed(bench, node, heartbeat, how, verdict)

    for starts, wanted in ((True, "some"), (False, "none")):
        tpdos = seen[how, starts].tpdos
        verdict.equal(
            f"TPDOs {'with' if starts else 'without'} the value to start by itself",
            "some" if tpdos else "none",
            wanted,
        )


def _first_timer(node: Node) -> int:
    tpdo = node.spec.services.tpdo
    if tpdo is None:
        raise SetupRefused("the manual documents no TPDO")
    return tpdo.communication
