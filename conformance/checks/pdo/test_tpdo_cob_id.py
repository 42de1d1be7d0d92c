"""TPDO and SYNC COB-ID: what it may be, when it may change, what it does.

CiA 301 v4.2.0, 7.5.2.5 (SYNC), 7.5.2.37 (TPDO), 7.3.5 (restricted CAN-IDs).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.services.mapping import NOT_VALID
from conformance.checks import cases
from conformance.checks.pdo import mapping
from conformance.checks.pdo.tpdos import disablable, listen, paced, set_up
from conformance.checks.steps import COB_ID_SUB
from conformance.errors import NodeTimeout
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import Services
from conformance.spec.model import DeviceSpec, Entry, Key, address
from conformance.verdict import Verdict
from conformance.wire.cob_id import RESTRICTED
from conformance.wire.datatypes import DataType

COB_ID = f"{CIA301}, 7.5.2.37"
RESTRICTED_IDS = f"{CIA301}, 7.3.5"
FREE_CAN_ID = 0x6A0
"""No service of the predefined connection set has it, and none is kept from it."""
FREE_29_BITS = 0x1234_56A1
_CAN_ID = 0x7FF
_BIT_29, _BIT_30 = 1 << 29, 1 << 30


class Restricted(NamedTuple):
    """A COB-ID and CAN-IDs that are kept from it."""

    key: Key
    can_ids: range


def _cob_ids(spec: DeviceSpec) -> Iterator[tuple[Entry, int]]:
    """Return the COB-IDs of TPDOs that can be written, with the number of the TPDO."""
    tpdo = spec.services.tpdo
    for number in range(1, (tpdo.count if tpdo is not None else 0) + 1):
        entry = tpdo and spec.entry(tpdo.communication + number - 1, COB_ID_SUB)
        if entry and entry.writable and not entry.optional:
            yield entry, number


def _movable(spec: DeviceSpec) -> Iterable[Case]:
    return (Case(entry.address, number, entry.source) for entry, number in _cob_ids(spec))


@requirement(
    "TPDO-60",
    level="shall",
    cases=("number", disablable),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_tpdo_uses_its_cob_id(node: Node, number: int, verdict: Verdict) -> None:
    """With another CAN-ID in its COB-ID a TPDO is sent on that one, and no longer on the old."""
    port, pace = mapping.port_of(node, number), paced(node, number)
    set_up(node, port, pace.transmission_type, pace.event_ms)
    before = port.cob_id() & _CAN_ID
    port.disable()
    word = port.cob_id() & ~_CAN_ID | FREE_CAN_ID
    port.write_cob_id(word)
    port.write_cob_id(word & ~NOT_VALID)
    moved = mapping.port_of(node, number)
    port.start()
    mark = node.link.mark()

    seen = listen(node, moved, pace)

    old = node.link.since(mark, lambda frame: frame.can_id == before)
    verdict.equal(f"TPDOs on {FREE_CAN_ID:03X}h", "some" if seen else "none", "some")
    verdict.equal(f"TPDOs on {before:03X}h", len(old), 0)


@requirement(
    "TPDO-61",
    level="shall",
    cases=("number", _movable),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_can_id_is_fixed_while_valid(node: Node, number: int, verdict: Verdict) -> None:
    """The CAN-ID of a TPDO does not change while the TPDO is valid, unless documented otherwise."""
    port = mapping.port_of(node, number)
    port.enable()
    before = port.cob_id()
    word = before & ~_CAN_ID | FREE_CAN_ID

    written = port.try_cob_id(word)

    after = port.cob_id()
    mapping.judge_by_reading(
        node.spec,
        verdict,
        f"download of {word:08X}h to {address(*port.cob_id_key)}",
        f"{mapping.outcome(written)}, then {after:08X}h",
        lambda services: (
            f"confirmed, then {word:08X}h"
            if services.tpdo and services.tpdo.change_while_valid == "accepted"
            else f"refused, then {before:08X}h"
        ),
    )


def _restricted_for_tpdos(spec: DeviceSpec) -> Iterable[Case]:
    for entry, _ in _cob_ids(spec):
        yield from _restricted(entry)


def _restricted(entry: Entry) -> Iterator[Case]:
    for can_ids in RESTRICTED:
        label = f"{entry.address}/{can_ids[0]:03X}h-{can_ids[-1]:03X}h"
        yield Case(label, Restricted(entry.key, can_ids), entry.source)


@requirement(
    "TPDO-62",
    level="shall",
    cases=("restricted", _restricted_for_tpdos),
    source=RESTRICTED_IDS,
    effects=("reads", "writes"),
)
def test_restricted_can_ids_are_refused(
    node: Node, restricted: Restricted, verdict: Verdict
) -> None:
    """A CAN-ID kept for other services is refused for a TPDO, unless documented otherwise."""
    accepted = _accepted(node, restricted, NOT_VALID)

    _judge_restricted(
        node.spec,
        verdict,
        restricted,
        accepted,
        lambda services: services.tpdo.restricted if services.tpdo else "refused",
    )


def _restricted_for_sync(spec: DeviceSpec) -> Iterable[Case]:
    sync = spec.services.sync_consumer
    entry = None if sync is None or sync.object is None else spec.entry(sync.object)
    if entry is not None and entry.writable and not entry.optional:
        yield from _restricted(entry)


@requirement(
    "TPDO-65",
    level="shall",
    cases=("restricted", _restricted_for_sync),
    source=RESTRICTED_IDS,
    effects=("reads", "writes"),
)
def test_restricted_can_ids_are_refused_for_sync(
    node: Node, restricted: Restricted, verdict: Verdict
) -> None:
    """A CAN-ID kept for other services is refused for SYNC, unless documented otherwise."""
    accepted = _accepted(node, restricted, 0)

    _judge_restricted(
        node.spec,
        verdict,
        restricted,
        accepted,
        lambda services: services.sync_consumer.restricted if services.sync_consumer else "refused",
    )


def _tried(can_ids: range) -> list[int]:
    """Return the first, the middle and the last of some CAN-IDs."""
    return sorted({can_ids[0], can_ids[len(can_ids) // 2], can_ids[-1]})


def _accepted(node: Node, restricted: Restricted, off: int) -> list[int]:
    """Return which restricted CAN-IDs the node takes; ``off`` is set before, so that it may."""
    taken = []
    for can_id in _tried(restricted.can_ids):
        if off:
            node.download(*restricted.key, node.number(*restricted.key) | off)
        answer = node.try_download(*restricted.key, DataType.UNSIGNED32.encode(can_id))
        if not answer.answered:
            raise NodeTimeout(f"download of {can_id:08X}h to {address(*restricted.key)}: {answer}")
        if answer.confirmed:
            taken.append(can_id)
    return taken


def _judge_restricted(
    spec: DeviceSpec,
    verdict: Verdict,
    restricted: Restricted,
    accepted: Sequence[int],
    wanted: Callable[[Services], str],
) -> None:
    tried = _tried(restricted.can_ids)
    some = f"{_list(accepted)} accepted, others refused"
    taken = "refused" if not accepted else "accepted" if len(accepted) == len(tried) else some
    mapping.judge_by_reading(spec, verdict, f"CAN-IDs {_list(tried)}", taken, wanted)


def _list(can_ids: Iterable[int]) -> str:
    return ", ".join(f"{can_id:03X}h" for can_id in can_ids)


@requirement(
    "TPDO-63",
    level="shall",
    cases=("number", disablable),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_bit_29_is_refused_or_heeded(node: Node, number: int, verdict: Verdict) -> None:
    """A COB-ID with bit 29 set is refused as invalid, or the TPDO is sent with 29-bit identifier."""
    port, pace = mapping.port_of(node, number), paced(node, number)
    set_up(node, port, pace.transmission_type, pace.event_ms)
    port.disable()
    word = _BIT_29 | FREE_29_BITS

    answer = port.try_cob_id(word)
    port.start()
    mark = node.link.mark()
    listen(node, port, pace)

    what = f"download of {word:08X}h to {address(*port.cob_id_key)}"
    if not answer.confirmed:
        mapping.judge_code(verdict, what, answer, cases.OUT_OF_RANGE)
        return
    sent = node.link.since(mark, lambda frame: frame.extended and frame.can_id == FREE_29_BITS)
    short = node.link.since(
        mark, lambda frame: not frame.extended and frame.can_id == FREE_29_BITS & _CAN_ID
    )
    seen = "some" if sent else "none"
    verdict.equal(f"TPDOs on {FREE_29_BITS:08X}h, which is confirmed", seen, "some")
    verdict.equal(f"TPDOs on {FREE_29_BITS & _CAN_ID:03X}h", len(short), 0)


def _with_bit_30(spec: DeviceSpec) -> Iterable[Case]:
    """Return the COB-IDs whose bit 30 every reading documents."""
    for entry, number in _cob_ids(spec):
        if all(30 in (reading.bits or {}) for reading in entry.readings):
            yield Case(entry.address, number, entry.source_of("bits"))


@requirement(
    "TPDO-64",
    level="manual",
    cases=("number", _with_bit_30),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_bit_30_takes_both_values(node: Node, number: int, verdict: Verdict) -> None:
    """Bit 30 of a TPDO's COB-ID can be set and cleared, and is read back."""
    port = mapping.port_of(node, number)
    port.disable()
    for _ in range(2):
        word = port.cob_id() ^ _BIT_30

        answer = port.try_cob_id(word)

        verdict.holds(
            f"download of {word:08X}h to {address(*port.cob_id_key)}",
            expected="confirmed",
            actual=str(answer),
            ok=answer.confirmed,
        )
        verdict.equal("COB-ID as read back", port.cob_id(), word, show=_word)


def _word(word: int) -> str:
    return f"{word:08X}h"
