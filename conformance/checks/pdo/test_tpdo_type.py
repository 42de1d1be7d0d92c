"""TPDO: undocumented transmission types, and what a synchronous type rules out (CiA 301 v4.2.0, 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.in_force import InForce
from conformance.checks.cases import OUT_OF_RANGE
from conformance.checks.pdo.tilted_tpdos import carry_the_tilt, tilted
from conformance.checks.pdo.tpdo_cases import (
    Numbered,
    documents,
    judge_reading,
    outcome_of,
    parameter_of,
    readings_of,
    synchronous,
    timed,
    type_readings,
    typed,
)
from conformance.checks.pdo.tpdos import (
    EVENT_MS,
    TYPE_SUB,
    WINDOW_S,
    allows,
    event_time_ms,
    others_off,
    port_of,
    require_acts,
    send_sync,
    set_up,
    sync_id,
    waiting,
)
from conformance.checks.steps import ENTER, make_writable, own_value, state_word
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.abort import describe
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtState

COMMUNICATION = f"{CIA301}, 7.5.2.37"
ACYCLIC = 0
EVERY_SYNC = 1
ANSWER_S = 0.1
TILT_DEG = 3.0


def _undocumented(spec: DeviceSpec) -> Iterable[Case]:
    tpdo = spec.services.tpdo
    if tpdo is not None:
        beside = {
            edge for low, high in tpdo.transmission_types for edge in (int(low) - 1, int(high) + 1)
        }
        figures = [
            it for it in sorted({0, 255} | beside) if 0 <= it <= 255 and not documents(tpdo, it)
        ]
        for case in typed(spec):
            for figure in figures:
                numbered = Numbered(case.subject, figure)
                yield Case(f"{case.label}/type-{figure}", numbered, case.section)


@requirement(
    "TPDO-13",
    level="shall",
    cases=("kind", _undocumented),
    source=f"{COMMUNICATION}; 7.2.4.3.17",
    effects=("reads", "writes"),
)
def test_undocumented_transmission_type(node: Node, kind: Numbered, verdict: Verdict) -> None:
    """An undocumented transmission type is aborted with a code for an invalid value, and the old one stays."""
    entry = parameter_of(node, kind.number, TYPE_SUB)
    make_writable(node, entry)
    present = own_value(node, entry)

    answer = node.try_download(*entry.key, entry.type.encode(kind.figure))

    quantity = f"transmission type {kind.figure}"
    readings = type_readings(node.spec, kind.figure)
    judge_reading(verdict, quantity, readings, outcome_of(answer))
    if answer.abort is not None:
        verdict.one_of(f"abort code for {quantity}", answer.abort, OUT_OF_RANGE, show=describe)
        verdict.equal(
            f"{entry.address} afterwards", node.upload(*entry.key), present, show=bytes.hex
        )


def _both(spec: DeviceSpec) -> Iterable[Case]:
    with_timer = {case.subject for case in timed(spec)}
    return (case for case in synchronous(spec) if case.subject in with_timer)


@requirement(
    "TPDO-14",
    level="shall",
    cases=("number", waiting(_both)),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_event_timer_leaves_a_synchronous_tpdo(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """With a synchronous type the event timer sends nothing."""
    port, event_ms = port_of(node, number), event_time_ms(node.spec, number, EVENT_MS) or EVENT_MS
    others_off(node, number)
    before_ms = port.period_ms
    set_up(node, port, EVERY_SYNC, event_ms)
    port.start()
    require_acts(in_force, port, before_ms, verdict)

    unasked = port.listen(max(WINDOW_S, 4 * event_ms / 1000))
    send_sync(node)
    answered = port.listen(ANSWER_S)

    readings = readings_of(
        node.spec, lambda tpdo: "none" if tpdo.event_time_acts == "asynchronous" else "some"
    )
    judge_reading(verdict, "TPDOs without SYNC", readings, "some" if unasked else "none")
    verdict.equal("TPDOs after a SYNC", "some" if answered else "none", "some")


def _acyclic(spec: DeviceSpec) -> Iterable[Case]:
    if spec.services.sync_consumer is not None:
        for case in tilted(spec):
            if allows(spec, case.subject, ACYCLIC):
                yield case


@requirement(
    "TPDO-15",
    level="should",
    cases=("number", _acyclic),
    source=COMMUNICATION,
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_acyclic_tpdo_waits_for_sync(
    node: Node, number: int, stimulus: Stimulus, verdict: Verdict
) -> None:
    """With type 0 a change of value sends the TPDO after the next SYNC, not before it, and in Operational alone."""
    port, sync = port_of(node, number), Frame(sync_id(node))
    stimulus.tilt(TILT_DEG, -TILT_DEG)
    carry_the_tilt(node, port, ACYCLIC)
    port.start()
    node.send(sync)
    before = port.listen(ANSWER_S)

    seen: dict[NmtState, tuple[int, list[Stamped]]] = {}
    for state in (NmtState.OPERATIONAL, NmtState.STOPPED, NmtState.PRE_OPERATIONAL):
        node.nmt(ENTER[state])
        mark = node.link.mark()
        stimulus.tilt(-TILT_DEG if len(seen) % 2 == 0 else TILT_DEG)
        early = len(node.link.since(mark, port.matches))
        node.send(sync)
        seen[state] = early, port.listen(ANSWER_S)

    early, answered = seen[NmtState.OPERATIONAL]
    if before and answered and before[-1].frame.data == answered[-1].frame.data:
        raise SetupRefused("the TPDO does not show the tilt, see TPDO-19")
    verdict.equal("TPDOs before the SYNC", early, 0)
    verdict.equal("TPDOs after the SYNC", len(answered), 1)
    for state in (NmtState.STOPPED, NmtState.PRE_OPERATIONAL):
        early, answered = seen[state]
        verdict.equal(f"TPDOs in {state_word(state)}", early + len(answered), 0)
