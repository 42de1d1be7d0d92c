"""A full bus: nobody says how many frames a node takes, but what it may tell and may not do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

from conformance.bench.bus.intervals import gaps_ms
from conformance.bench.node.node import PROBE, Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.burst import send_burst, send_load
from conformance.bench.services.emcy import WINDOW_S, EmcyPort, decoded, errors_to_come
from conformance.bench.services.heartbeat import HeartbeatPort, name_of
from conformance.checks.cases import with_heartbeat
from conformance.checks.errors.emcies import (
    NO_ERROR,
    code_word,
    code_words,
    documented_bits,
    judge,
    kept,
    producers,
)
from conformance.checks.steps import require_state
from conformance.effects import Effect
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import EmcyProducer
from conformance.spec.model import DeviceSpec, OtherServices, address
from conformance.verdict import Verdict
from conformance.wire.emcy import Emergency
from conformance.wire.nmt import NmtCommand, NmtState

USAGE = f"{CIA301}, 7.2.7.1"
STATES = f"{CIA301}, 7.3.2.2"
PRODUCER = f"{CIA301}, 7.2.8.3.2.2"
EFFECTS: tuple[Effect, ...] = ("reads", "writes", "resets", "other-nodes")
OCTETS = 8
PERIODS = 5
LATE = 0.5
"""Share of its period by which a heartbeat under load may be late; left out it would be a whole one."""
_GENERIC = 0
_COMMUNICATION = 8


def _told(spec: DeviceSpec) -> Iterable[Case]:
    for case in producers(spec):
        yield Case(case.label, None, case.section, kept(spec))


@requirement("EMCY-37", level="manual", cases=_told, source=USAGE, effects=EFFECTS)
def test_burst_is_told_as_documented(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, verdict: Verdict
) -> None:
    """A burst of frames brings about no EMCY, or a documented one, once, its end told as documented."""
    emcy.begin(reset=True)
    mark = node.link.mark()

    send_burst(node)
    emcy.listen(WINDOW_S)

    seen = node.link.since(mark, emcy.matches)
    others = sorted({len(it.frame.data) for it in seen} - {OCTETS})
    if verdict.equal("octets of EMCYs", others or [OCTETS], [OCTETS]):
        messages = [decoded(it) for it in seen]
        stopped = not node.answers()  # by an error, as documented: there no EMCY tells its end
        node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        gone = not emcy.register() and not stopped
        _judge_content(spec, messages, verdict)
        _judge_events(spec, messages, verdict, gone=gone)


def _judge_content(spec: DeviceSpec, messages: Sequence[Emergency], verdict: Verdict) -> None:
    """Judge codes, error registers and the octets behind them."""
    known = {code for producer in _producers(spec) for code in producer.codes}
    unknown = sorted({it.error_code for it in messages} - known)
    verdict.equal("undocumented error codes", unknown, [], show=code_words)
    for message in messages:
        register = message.error_register
        bits = {bit for bit in range(8) if register >> bit & 1}
        told = f"with {code_word(message.error_code)}"
        undocumented = sorted(bits - documented_bits(spec))
        verdict.equal(f"undocumented bits of the error register {told}", undocumented, [])
        if message.error_code != NO_ERROR:
            _judge_generic_bit(spec, message, verdict)
        seen = message.manufacturer
        judge(
            spec,
            verdict,
            f"octets 3 to 7 {told}",
            seen,
            partial(_fields, seen=seen),
            show=lambda field: field.hex(" ").upper(),
        )


def _judge_generic_bit(spec: DeviceSpec, message: Emergency, verdict: Verdict) -> None:
    """Judge bit 0 of the error register, which errors of the communication may have their own way."""
    of_communication = message.error_code >> 12 == _COMMUNICATION
    readings: dict[bool, OtherServices | None] = {}
    for services, other in spec.services_readings:
        of_bus = services.bus_errors if of_communication else None
        source = of_bus or services.emcy_producer
        if source is not None:
            readings.setdefault(_GENERIC in source.register_bits, other)
    is_set = bool(message.error_register >> _GENERIC & 1)
    quantity = f"bit 0 of the error register with {code_word(message.error_code)}"
    verdict.one_of(quantity, is_set, readings, show=lambda it: "set" if it else "clear")
    followed = readings.get(is_set)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)


def _fields(producer: EmcyProducer, seen: bytes) -> set[bytes]:
    """Return octets 3 to 7 as seen, but zeros where the manual leaves nothing open."""
    place = producer.manufacturer_code
    if producer.other_octets == "any":
        return {seen}
    return {bytes(it if place and n == place.octet else 0 for n, it in enumerate(seen))}


def _judge_events(
    spec: DeviceSpec, messages: Sequence[Emergency], verdict: Verdict, *, gone: bool
) -> None:
    """Judge that an error is told once, and its end where the register has shown it until then."""
    codes = [it.error_code for it in messages]
    if NO_ERROR in codes or {it.cleared for it in _producers(spec)} == {"sent"}:
        verdict.equal(
            "codes told again while the error lasts", _repeated(codes), [], show=code_words
        )
    if messages and messages[-1].error_register and gone:
        judge(
            spec,
            verdict,
            "last code when the error went",
            codes[-1],
            lambda producer: {NO_ERROR if producer.cleared == "sent" else codes[-1]},
            show=code_word,
        )


def _repeated(codes: Sequence[int]) -> list[int]:
    """Return the codes that came twice without an end between."""
    repeated: list[int] = []
    present: set[int] = set()
    for code in codes:
        if code == NO_ERROR:
            present.clear()
        elif code in present:
            repeated.append(code)
        else:
            present.add(code)
    return repeated


def _producers(spec: DeviceSpec) -> list[EmcyProducer]:
    """Return the EMCY producer under each reading."""
    readings = (services.emcy_producer for services, _ in spec.services_readings)
    return [producer for producer in readings if producer is not None]


def _burst(spec: DeviceSpec) -> Iterable[Case]:
    yield Case("operational", None, spec.services.nmt.source, kept(spec))


@requirement("NMT-16", level="shall", cases=with_heartbeat(_burst), source=STATES, effects=EFFECTS)
def test_burst_leaves_the_node_as_it_was(
    node: Node, heartbeat: HeartbeatPort, stimulus: Stimulus, verdict: Verdict
) -> None:
    """After a burst of frames the node is in its state, was not restarted and answers SDO requests."""
    with errors_to_come(node, stimulus, reset=True) as emcy:
        require_state(node, heartbeat, NmtState.OPERATIONAL)
        on_error = _states_on_error(node)
        mark = node.link.mark()

        send_burst(node)

        state = heartbeat.state_now()
        boot_ups = len(node.link.since(mark, node.is_boot_up))
        told = emcy is not None and bool(node.link.since(mark, emcy.matches))
        if state != name_of(NmtState.OPERATIONAL):
            node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        transfer = node.sdo.upload(*PROBE)

    allowed = [NmtState.OPERATIONAL, *(on_error if told else ())]
    verdict.one_of("state after the burst", state, [name_of(it) for it in allowed])
    verdict.equal("boot-up messages", boot_ups, 0)
    verdict.holds(
        "SDO after the burst",
        expected="an answer",
        actual=str(transfer),
        ok=transfer.answered,
    )


def _states_on_error(node: Node) -> list[NmtState]:
    """Return to what an error leads from Operational, under each reading."""
    rules = (producer.on_error for producer in _producers(node.spec))
    words = {
        rule.state if rule.object is None else rule.states.get(node.number(rule.object))
        for rule in rules
        if rule is not None and "operational" in rule.leaves
    }
    return [NmtState[word.upper().replace("-", "_")] for word in sorted(filter(None, words))]


def _producer(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None:
        yield Case(address(producer.object), None, producer.source, kept(spec))


@requirement("HB-16", level="shall", cases=_producer, source=PRODUCER, effects=EFFECTS)
def test_heartbeat_goes_on_under_load(
    node: Node, heartbeat: HeartbeatPort, stimulus: Stimulus, verdict: Verdict
) -> None:
    """No heartbeat is left out while the bus is full of frames for others and requests to the node."""
    period_ms = heartbeat.typical_ms
    with errors_to_come(node, stimulus, reset=True):
        heartbeat.enter()
        heartbeat.set(period_ms)
        before = heartbeat.beats(1, period_ms)
        if not before:
            raise SetupRefused("there is no heartbeat to be disturbed, see HB-01")
        mark = node.link.mark()

        send_load(node, PERIODS * period_ms / 1000)
        heartbeat.collect(1, 2 * period_ms / 1000)

        seen = [before[-1], *node.link.since(mark, node.is_error_control)]

    gaps = gaps_ms(node.link, seen, period_ms)
    verdict.within("heartbeat period under load", gaps, period_ms, LATE * period_ms, unit="ms")
