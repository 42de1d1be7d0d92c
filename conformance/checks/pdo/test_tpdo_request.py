"""TPDO: sent on a remote request (CiA 301 v4.2.0, 7.2.2.2 and 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort, pace_entries
from conformance.bench.settings.in_force import may_wait
from conformance.checks.pdo.tpdo_cases import (
    Numbered,
    documents,
    judge_reading,
    outcome_of,
    parameter_of,
    readings_of,
    synchronous,
    type_readings,
    typed,
)
from conformance.checks.pdo.tpdos import TYPE_SUB, others_off, port_of, send_sync, set_up
from conformance.checks.steps import ENTER, make_writable, require_alive, state_word
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState

AT_SYNC, AT_ONCE = 252, 253
AFTER_SYNC = 1
NO_REQUEST = 1 << 30
COMMUNICATION = f"{CIA301}, 7.2.2.2 and 7.5.2.37"
ANSWER_S = 0.1
WORDS = ("bit-30-clear", "bit-30-set")


def _requested(spec: DeviceSpec) -> Iterable[Case]:
    tpdo = spec.services.tpdo
    for case in typed(spec):
        for figure in (AT_SYNC, AT_ONCE):
            possible = figure == AT_ONCE or spec.services.sync_consumer is not None
            if tpdo is not None and documents(tpdo, figure) and possible:
                numbered = Numbered(case.subject, figure)
                yield Case(f"{case.label}/type-{figure}", numbered, case.section)


def _at_once(spec: DeviceSpec) -> Iterable[Case]:
    return (case for case in _requested(spec) if case.subject.figure == AT_ONCE)


def _takes_type(node: Node, kind: Numbered, verdict: Verdict) -> bool:
    """Give a TPDO its type; after a refusal that a reading allows nothing is left to see."""
    entry = parameter_of(node, kind.number, TYPE_SUB)
    make_writable(node, entry)
    answer = node.try_download(*entry.key, entry.type.encode(kind.figure))
    readings = type_readings(node.spec, kind.figure)
    judge_reading(verdict, f"transmission type {kind.figure}", readings, outcome_of(answer))
    return answer.confirmed


@requirement(
    "TPDO-16",
    level="manual",
    cases=("kind", _requested),
    source=COMMUNICATION,
    effects=("reads", "writes"),
    needs=("remote-frames",),
)
def test_tpdo_is_sent_on_request(node: Node, kind: Numbered, verdict: Verdict) -> None:
    """With type 252 or 253 the TPDO is sent on a remote request that its COB-ID allows, and only then."""
    if not _takes_type(node, kind, verdict):
        return
    port = _ready(node, kind)
    octets = port.mapped_octets
    port.start()

    unasked, answered = 0, []
    for bit_30 in port.bits_30:
        port.allow_remote(bit_30)
        unasked += _after_sync(node, port)
        port.request(octets)
        answered += [WORDS[bit_30]] if port.listen(ANSWER_S) else []

    verdict.equal("TPDOs without a request", unasked, 0)
    tried = [WORDS[bit_30] for bit_30 in port.bits_30]
    readings = readings_of(
        node.spec, lambda tpdo: tpdo.remote if tpdo.remote in tried else "neither"
    )
    judge_reading(verdict, "requests answered with", readings, " and ".join(answered) or "neither")


def _ready(node: Node, kind: Numbered) -> TpdoPort:
    """Set up a TPDO of a type that the node takes."""
    port = port_of(node, kind.number)
    others_off(node, kind.number)
    set_up(node, port, kind.figure)
    return port


def _after_sync(node: Node, port: TpdoPort) -> int:
    """Count the TPDOs without a request, after a SYNC where the node listens to it."""
    if node.spec.services.sync_consumer is not None:
        send_sync(node)
    return len(port.listen(ANSWER_S))


@requirement(
    "TPDO-17",
    level="shall",
    cases=("kind", _at_once),
    source=f"{CIA301}, 7.3.2.2.5",
    effects=("reads", "writes"),
    needs=("remote-frames",),
)
def test_request_is_answered_in_operational_only(
    node: Node, kind: Numbered, verdict: Verdict
) -> None:
    """A remote request for a TPDO is answered neither in Pre-operational nor in Stopped."""
    if not _takes_type(node, kind, verdict):
        return
    port = _ready(node, kind)
    octets = port.mapped_octets
    port.start()
    _let_it_be_asked(port, octets)

    for state in (NmtState.STOPPED, NmtState.PRE_OPERATIONAL):
        node.nmt(ENTER[state])
        port.listen(ANSWER_S)
        port.request(octets)
        answered = len(port.listen(ANSWER_S))
        verdict.equal(f"answers in {state_word(state)}", answered, 0)
    require_alive(node)


def _let_it_be_asked(port: TpdoPort, octets: int) -> None:
    """Give bit 30 of the COB-ID the value with which the TPDO answers in Operational.

    Raises:
        SetupRefused: There is none.
    """
    for bit_30 in port.bits_30:
        port.allow_remote(bit_30)
        port.request(octets)
        if port.listen(ANSWER_S):
            return
    raise SetupRefused("the TPDO answers no remote request, see TPDO-16")


def _forbidding(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs after SYNC whose bit 30 can be set, where by no reading that allows requests."""
    tpdo = spec.services.tpdo
    services = [services.tpdo for services, _ in spec.services_readings]
    if tpdo is None or any(it is not None and it.remote == "bit-30-set" for it in services):
        return
    for case in synchronous(spec):
        pace = pace_entries(spec, tpdo.communication + case.subject - 1)
        word = spec.entry(tpdo.communication + case.subject - 1, 1)
        free = word is not None and all(reading.writable for reading in word.readings)
        if free and not any(may_wait(entry) for entry in pace):
            yield case


@requirement(
    "TPDO-69",
    level="shall",
    cases=("number", _forbidding),
    source=COMMUNICATION,
    effects=("reads", "writes"),
    needs=("remote-frames",),
)
def test_forbidden_request_is_not_answered(node: Node, number: int, verdict: Verdict) -> None:
    """A TPDO that is sent after SYNC does not come on a remote request where its COB-ID forbids that."""
    port = _ready(node, Numbered(number, AFTER_SYNC))
    octets = port.mapped_octets
    if not _forbids(node, port, number):
        verdict.holds("bit 30", expected="set or not taken", actual="not taken", ok=True)
        return
    port.start()
    port.listen(ANSWER_S)

    port.request(octets)
    answers = len(port.listen(ANSWER_S))
    send_sync(node)
    followed = bool(port.listen(ANSWER_S))

    if not followed:
        raise SetupRefused("the TPDO does not follow SYNC, see TPDO-03")
    verdict.equal("TPDOs after a remote request that bit 30 forbids", answers, 0)


def _forbids(node: Node, port: TpdoPort, number: int) -> bool:
    """Set bit 30 of the COB-ID; tell whether the node takes it, as it need not if it never answers."""
    try:
        port.allow_remote(1)
    except SetupRefused:
        return False
    return bool(node.number(*parameter_of(node, number, 1).key) & NO_REQUEST)
