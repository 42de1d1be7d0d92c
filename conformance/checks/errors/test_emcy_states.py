"""EMCY by NMT state, what an error does to the state, and the inhibit time (CiA 301, 7.2.7, 7.3.2)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from conformance.bench.bus.intervals import gaps_ms
from conformance.bench.node.node import Node
from conformance.bench.services.emcy import EmcyPort
from conformance.bench.services.heartbeat import NO_HEARTBEAT, HeartbeatPort, name_of
from conformance.bench.services.provocations import AnyProvocation, Provocation
from conformance.checks.errors.emcies import (
    any_errors,
    came_about,
    judge,
    provoked,
    require_told,
    told,
)
from conformance.checks.steps import ENTER, require_alive, state_word
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import EmcyProducer
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState

STATES = f"{CIA301}, 7.3.2.2.5"
BEHAVIOUR = f"{CIA301}, 7.5.2.32"
INHIBIT = f"{CIA301}, 7.5.2.18"
INHIBIT_MS = 1000
TICKS_PER_MS = 10
TOLERANCE_MS = 5.0


class Visit(NamedTuple):
    """An error in an NMT state."""

    state: NmtState
    error: AnyProvocation


def _in_states(spec: DeviceSpec) -> Iterable[Case]:
    for case in provoked(spec):
        for state in ENTER:
            yield replace(case, label=state_word(state), subject=Visit(state, case.subject))


@requirement(
    "EMCY-23",
    level="shall",
    cases=("visit", _in_states),
    source=STATES,
    effects=("reads", "writes"),
)
def test_emcy_is_sent_in_its_states_only(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, visit: Visit, verdict: Verdict
) -> None:
    """An EMCY is sent in Pre-operational and Operational, and not in Stopped."""
    is_told = told(spec, emcy, visit.error, verdict) is not None
    emcy.end()
    node.nmt(ENTER[visit.state])

    seen = emcy.provoke(visit.error)

    judge(
        spec,
        verdict,
        f"EMCYs in {name_of(visit.state)}",
        "some" if seen else "none",
        lambda producer: {
            "some" if is_told and state_word(visit.state) in producer.states else "none"
        },
    )
    node.nmt(ENTER[NmtState.PRE_OPERATIONAL])
    require_alive(node)


class Reaction(NamedTuple):
    """An error in an NMT state, with the error behaviour at a value if an object has it."""

    state: NmtState
    value: int | None
    error: AnyProvocation


def _reactions(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.emcy_producer
    rule = producer.on_error if producer is not None else None
    if rule is None:
        return
    entry = None if rule.object is None else spec.entry(rule.object)
    values: Iterable[int | None] = [None]
    if entry is not None:
        values = sorted(rule.states.keys() | (entry.values or {}).keys())
    for case in any_errors(spec):
        for value in values:
            for state in (NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL):
                at = "" if entry is None else f"{entry.address}={value}/"
                label = f"{case.label}/{at}{state_word(state)}"
                reaction = Reaction(state, value, case.subject)
                yield replace(case, label=label, subject=reaction, section=rule.source)


@requirement(
    "EMCY-24",
    level="manual",
    cases=("reaction", _reactions),
    source=BEHAVIOUR,
    effects=("reads", "writes"),
)
def test_error_leads_to_the_documented_state(
    node: Node,
    spec: DeviceSpec,
    emcy: EmcyPort,
    heartbeat: HeartbeatPort,
    reaction: Reaction,
    verdict: Verdict,
) -> None:
    """An error leads to the documented NMT state, chosen by an object where one is documented."""
    emcy.calm()
    heartbeat.state()
    rule = emcy.producer.on_error
    if reaction.value is not None and rule is not None and rule.object is not None:
        node.download(rule.object, 0, reaction.value)
    node.nmt(ENTER[reaction.state])
    if heartbeat.state_now() != name_of(reaction.state):
        raise SetupRefused(f"the node did not enter {name_of(reaction.state)}, see NMT-01")

    emcy.provoke(reaction.error)

    seen = heartbeat.state_now()
    if seen == NO_HEARTBEAT:
        raise SetupRefused("no heartbeat shows the state, see HB-05")
    judge(spec, verdict, "state", seen, lambda producer: {_after(producer, reaction)})


def _after(producer: EmcyProducer, reaction: Reaction) -> str:
    """Return the state that an error leads to, by what the manual says of the producer."""
    rule = producer.on_error
    before = state_word(reaction.state)
    if rule is None or before not in rule.leaves or reaction.error.axis in rule.mild:
        return name_of(reaction.state)
    word = rule.state if reaction.value is None else rule.states.get(reaction.value)
    return name_of(next(state for state in ENTER if state_word(state) == (word or before)))


def _inhibited(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.emcy_producer
    entry = spec.entry(producer.inhibit) if producer is not None and producer.inhibit else None
    for case in provoked(spec) if entry is not None and entry.writable else ():
        if entry is not None:
            yield replace(case, label=entry.address, section=entry.source)


@requirement(
    "EMCY-25",
    level="shall",
    cases=("error", _inhibited),
    source=INHIBIT,
    effects=("reads", "writes"),
)
def test_inhibit_time_keeps_emcys_apart(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """Two EMCYs are at least the inhibit time apart; the second is delayed or lost as documented."""
    emcy.calm()
    if emcy.producer.inhibit is not None:
        node.download(emcy.producer.inhibit, 0, INHIBIT_MS * TICKS_PER_MS)
    emcy.listen(INHIBIT_MS / 1000)
    mark = node.link.mark()
    first = emcy.provoke(error)
    if not came_about(spec, emcy, error, first, verdict):
        return
    require_told(first)

    emcy.relieve()
    emcy.listen(INHIBIT_MS / 1000)

    seen = node.link.since(mark, emcy.matches)
    gaps = gaps_ms(node.link, seen, INHIBIT_MS)
    if isinstance(error, Provocation):  # when one of the bus has gone, no manual says
        judge(
            spec,
            verdict,
            "EMCYs for an error that came and went within the inhibit time",
            len(seen),
            lambda producer: {1 + (_tells_the_end(producer) and producer.inhibited == "delayed")},
        )
    least_ms = min(gaps, default=float("inf"))
    verdict.at_least("from EMCY to EMCY", least_ms, INHIBIT_MS - TOLERANCE_MS, unit="ms")


def _tells_the_end(producer: EmcyProducer) -> bool:
    return producer.cleared == "sent" and producer.lasts == "while-present"
