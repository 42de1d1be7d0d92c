"""EMCY COB-ID: whether it is valid, what it may be, when it may change (CiA 301 v4.2.0, 7.5.2.17)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from conformance.bench.node.node import Node
from conformance.bench.services.emcy import EmcyPort
from conformance.bench.services.provocations import AnyProvocation
from conformance.checks.errors.emcies import came_about, judge, producers, provoked, told
from conformance.checks.steps import require_alive
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, address
from conformance.verdict import Verdict
from conformance.wire.cob_id import is_restricted
from conformance.wire.datatypes import DataType

COB_ID = f"{CIA301}, 7.5.2.17"
RESTRICTED = f"{CIA301}, 7.3.5"
FREE_CAN_ID = 0x680
"""No service of the predefined connection set has it, and none is kept from it."""

_ALL = range(0x800)
_CAN_ID = 0x7FF


def _movable(spec: DeviceSpec, cases: Iterable[Case]) -> Iterable[Case]:
    producer = spec.services.emcy_producer
    entry = spec.entry(producer.object) if producer is not None else None
    return cases if entry is not None and entry.writable else ()


def _movable_producers(spec: DeviceSpec) -> Iterable[Case]:
    return _movable(spec, producers(spec))


def _movable_errors(spec: DeviceSpec) -> Iterable[Case]:
    return _movable(spec, provoked(spec))


@requirement(
    "EMCY-19",
    level="shall",
    cases=("error", _movable_errors),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_bit_31_switches_emcy_off(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """With bit 31 of its COB-ID set no EMCY is sent; with the bit cleared it is."""
    if told(spec, emcy, error, verdict) is None:
        return
    emcy.end()
    emcy.disable()

    disabled = [*emcy.provoke(error), *emcy.relieve()]
    emcy.end()
    emcy.enable()
    enabled = emcy.provoke(error)

    verdict.equal("EMCYs with bit 31 set", len(disabled), 0)
    verdict.equal("EMCYs with bit 31 clear", "some" if enabled else "none", "some")
    require_alive(node)


@requirement(
    "EMCY-20",
    level="shall",
    cases=("error", _movable_errors),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_emcy_uses_its_cob_id(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """With another CAN-ID in its COB-ID object EMCY is sent on that one, and no longer on the old."""
    if told(spec, emcy, error, verdict) is None:
        return
    emcy.end()
    before = emcy.can_id
    emcy.move(FREE_CAN_ID)
    emcy.watch()
    mark = node.link.mark()

    seen = emcy.provoke(error)

    old = node.link.since(mark, lambda frame: frame.can_id == before)
    verdict.equal(f"EMCYs on {FREE_CAN_ID:03X}h", "some" if seen else "none", "some")
    verdict.equal(f"EMCYs on {before:03X}h", len(old), 0)


@requirement(
    "EMCY-21",
    level="shall",
    cases=("index", _movable_producers),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_can_id_is_fixed_while_valid(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, index: int, verdict: Verdict
) -> None:
    """The CAN-ID of EMCY does not change while EMCY is valid, unless documented otherwise."""
    emcy.watch()
    emcy.enable()
    before = node.number(index)
    word = before & ~_CAN_ID | FREE_CAN_ID

    written = node.try_download(index, 0, DataType.UNSIGNED32.encode(word))

    after = node.number(index)
    judge(
        spec,
        verdict,
        f"download of {word:08X}h to {address(index)}",
        (_outcome(written.confirmed, written.refused), f"{after:08X}h"),
        lambda producer: {
            ("refused", f"{before:08X}h")
            if producer.change_while_valid == "refused"
            else ("confirmed", f"{word:08X}h")
        },
        show=", then ".join,
    )


def _outcome(confirmed: bool, refused: bool) -> str:
    return "confirmed" if confirmed else "refused" if refused else "not answered"


def _restricted(spec: DeviceSpec) -> Iterable[Case]:
    for case in _movable_producers(spec):
        for can_ids in _runs([can_id for can_id in _ALL if is_restricted(can_id)]):
            label = f"{case.label}/{can_ids[0]:03X}h-{can_ids[-1]:03X}h"
            yield Case(label, can_ids, case.section)


def _runs(numbers: Sequence[int]) -> Iterable[range]:
    """Return ascending numbers as ranges without a gap."""
    start = 0
    for place, number in enumerate(numbers, start=1):
        if place == len(numbers) or numbers[place] != number + 1:
            yield range(numbers[start], number + 1)
            start = place


@requirement(
    "EMCY-22",
    level="shall",
    cases=("can_ids", _restricted),
    source=RESTRICTED,
    effects=("reads", "writes"),
)
def test_restricted_can_ids_are_refused(
    spec: DeviceSpec, emcy: EmcyPort, can_ids: range, verdict: Verdict
) -> None:
    """A CAN-ID kept for other services is refused for EMCY, unless documented otherwise."""
    emcy.watch()

    accepted = emcy.accepted(can_ids)

    some = (
        f"{len(accepted)} of {len(can_ids)} accepted, first {accepted[0]:03X}h" if accepted else ""
    )
    taken = "all accepted" if len(accepted) == len(can_ids) else some or "all refused"
    judge(
        spec,
        verdict,
        f"CAN-IDs {can_ids[0]:03X}h to {can_ids[-1]:03X}h",
        taken,
        lambda producer: {f"all {producer.restricted}"},
    )


def _enabled_by_a_bit(spec: DeviceSpec) -> Iterable[Case]:
    for bit in _bits(spec):
        for case in _movable_errors(spec):
            yield replace(case, label=f"{case.label}/bit-{bit}", subject=(bit, case.subject))


def _bits(spec: DeviceSpec) -> set[int]:
    """Return the bits that must be set for EMCY to be sent, by any reading."""
    producers_read = (services.emcy_producer for services, _ in spec.services_readings)
    return {it.enabled_by for it in producers_read if it and it.enabled_by is not None}


@requirement(
    "EMCY-34",
    level="manual",
    cases=("enabling", _enabled_by_a_bit),
    effects=("reads", "writes"),
)
def test_bit_of_the_cob_id_enables_emcy(
    spec: DeviceSpec, emcy: EmcyPort, enabling: tuple[int, AnyProvocation], verdict: Verdict
) -> None:
    """The bit of the COB-ID by which the manual has EMCY sent does not keep it from being sent."""
    bit, error = enabling
    emcy.calm()
    if not emcy.give_bit(bit, 1):
        verdict.holds(f"bit {bit}", expected="taken, or refused", actual="refused", ok=True)
        return
    enabled = emcy.provoke(error)
    emcy.end()
    emcy.give_bit(bit, 0)

    disabled = emcy.provoke(error)

    if enabled or disabled or came_about(spec, emcy, error, enabled, verdict):
        judge(
            spec,
            verdict,
            f"EMCYs with bit {bit} set, and clear",
            (bool(enabled), bool(disabled)),
            lambda producer: {(True, producer.enabled_by is None)},
            show=lambda sent: ", ".join("some" if one else "none" for one in sent),
        )
