"""Heartbeats in each NMT state, among other nodes' heartbeats and guarding (CiA 301, 7.2.8.3.2)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.bus.intervals import gaps_ms
from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import NO_HEARTBEAT, HeartbeatPort, state_of
from conformance.checks.cases import neighbours
from conformance.checks.limits import gap_tolerance_ms
from conformance.checks.steps import ENTER, require_alive, run_and_switch_off, state_word
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, address
from conformance.verdict import Verdict
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import Heartbeat, NmtState, encode_heartbeat

PRODUCER = f"{CIA301}, 7.2.8.3.2.2"
CONSUMER = 0x1016
BEATS = 10
SILENT_S = 0.5
STRANGE_EVERY_S = 0.02


def _states(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    for state in ENTER:
        word = state_word(state)
        if producer is not None and word in producer.states:
            yield Case(word, state, producer.source)


@requirement(
    "HB-06",
    level="shall",
    cases=("state", _states),
    source=PRODUCER,
    effects=("reads", "writes"),
)
def test_heartbeat_keeps_its_period_in_each_state(
    node: Node, heartbeat: HeartbeatPort, state: NmtState, verdict: Verdict
) -> None:
    """The period is the same in each NMT state that has heartbeats."""
    heartbeat.enter()
    heartbeat.set(heartbeat.typical_ms)
    _, before_ms = heartbeat.rhythm(BEATS, heartbeat.typical_ms)
    if not before_ms:
        raise SetupRefused("there is no heartbeat to be compared with, see HB-01")
    node.nmt(ENTER[state])
    heartbeat.collect(1, 2 * heartbeat.typical_ms / 1000)

    gaps, _ = heartbeat.rhythm(BEATS, heartbeat.typical_ms, before_ms[0])

    verdict.equal("intervals seen", len(gaps), BEATS)
    tolerance_ms = gap_tolerance_ms(before_ms[0])
    verdict.within("heartbeat period", gaps, before_ms[0], tolerance_ms, unit="ms")


@requirement(
    "HB-10",
    level="shall",
    cases=("state", _states),
    source=f"{CIA301}, 7.5.2.20",
    effects=("reads", "writes"),
)
def test_heartbeat_stays_off_in_each_state(
    node: Node, heartbeat: HeartbeatPort, state: NmtState, verdict: Verdict
) -> None:
    """Switched off, the heartbeat does not come back with a change of the NMT state."""
    period_ms = run_and_switch_off(heartbeat)
    node.nmt(ENTER[state])
    node.link.listen(1.5 * period_ms / 1000, node.is_error_control)

    silent = node.link.listen(SILENT_S + 3 * period_ms / 1000, node.is_error_control)

    verdict.equal("heartbeats with the time off", len(silent), 0)
    node.nmt(ENTER[NmtState.PRE_OPERATIONAL])
    require_alive(node)


def _producer_alone(spec: DeviceSpec) -> Iterable[Case]:
    """Return one case where the manual has a heartbeat producer and no consumer."""
    return _object(spec) if spec.entry(CONSUMER, 0) is None else ()


@requirement(
    "HB-13",
    level="manual",
    cases=_producer_alone,
    effects=("reads", "writes", "other-nodes"),
    needs=("remote-frames",),
)
def test_heartbeats_and_guarding_of_others_mean_nothing(
    node: Node, heartbeat: HeartbeatPort, verdict: Verdict
) -> None:
    """Heartbeats of other nodes, their end and requests to guard them change nothing in the node."""
    before, period_ms = _running(heartbeat)
    mark = node.link.mark()

    for frame in _strangers(node.node_id):
        node.link.send(frame)
        node.link.listen(STRANGE_EVERY_S, node.is_error_control)
    node.link.listen(BEATS * heartbeat.typical_ms / 1000, node.is_error_control)

    seen = node.link.since(mark, node.is_error_control)
    _judge_undisturbed(node, verdict, seen, period_ms, before)


def _running(heartbeat: HeartbeatPort) -> tuple[str, float]:
    """Switch the heartbeat on and return the state and the period that it shows."""
    heartbeat.enter()
    heartbeat.set(heartbeat.typical_ms)
    seen = heartbeat.state_now()
    _, mean_ms = heartbeat.rhythm(BEATS, heartbeat.typical_ms)
    if seen == NO_HEARTBEAT or not mean_ms:
        raise SetupRefused("there is no heartbeat to be disturbed, see HB-01")
    return seen, mean_ms[0]


def _strangers(node_id: int) -> list[Frame]:
    """Return other nodes' heartbeats in all states, and guarding requests to them."""
    told = (NmtState.BOOT_UP, NmtState.OPERATIONAL, NmtState.STOPPED, NmtState.PRE_OPERATIONAL)
    frames = []
    for other in neighbours(node_id):
        frames += [encode_heartbeat(Heartbeat(other, state)) for state in told]
        frames.append(Frame(cob_id.heartbeat(other), remote=True, dlc=1))
    return frames


def _object(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    if producer is not None:
        yield Case(address(producer.object), None, producer.source)


@requirement(
    "HB-14",
    level="should",
    cases=_object,
    source=PRODUCER,
    effects=("reads", "writes"),
    needs=("remote-frames",),
)
def test_guarding_does_not_disturb_the_heartbeat(
    node: Node, heartbeat: HeartbeatPort, verdict: Verdict
) -> None:
    """While the heartbeat runs a guarding request is not answered."""
    before, period_ms = _running(heartbeat)
    mark = node.link.mark()

    for _ in range(BEATS):
        node.link.send(Frame(cob_id.heartbeat(node.node_id), remote=True, dlc=1))
        node.link.listen(0.7 * heartbeat.typical_ms / 1000, node.is_error_control)

    seen = node.link.since(mark, node.is_error_control)
    _judge_undisturbed(node, verdict, seen, period_ms, before)


def _judge_undisturbed(
    node: Node, verdict: Verdict, seen: list[Stamped], period_ms: float, before: str
) -> None:
    gaps = gaps_ms(node.link, seen, period_ms)
    verdict.within("heartbeat period", gaps, period_ms, gap_tolerance_ms(period_ms), unit="ms")
    states = sorted({state_of(beat) for beat in seen})
    verdict.equal("state", " and ".join(states), before)
