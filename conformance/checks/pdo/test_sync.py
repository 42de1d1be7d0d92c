"""SYNC: what a consumer takes for it, and what it does not do (CiA 301 v4.2.0, 7.2.5 and 7.5.2.5)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort
from conformance.bench.settings.in_force import InForce
from conformance.checks.pdo.tpdo_cases import (
    Numbered,
    first_synchronous,
    outcome_of,
    synchronous,
)
from conformance.checks.pdo.tpdos import (
    others_off,
    port_of,
    require_acts,
    set_up,
    sync_id,
    waiting,
)
from conformance.checks.steps import ENTER, require_alive, state_word
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire.cob_id import SYNC
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState

COB_ID = f"{CIA301}, 7.5.2.5"
EVERY_SYNC = 1
ANSWER_S = 0.1
FREE_CAN_ID = 0x6B0
"""An identifier that neither CiA 301 nor the predefined connection set uses."""

GENERATES = 1 << 30
CAN_ID = 0x7FF
LISTENED_S = 1.0
LENGTHS = (1, 8)
"""Of SYNC with its counter, and the most."""


def _answered(node: Node, port: TpdoPort, frame: Frame) -> int:
    """Send a frame and count the TPDOs that follow."""
    node.send(frame)
    return len(port.listen(ANSWER_S))


def _follows_sync(node: Node, number: int, in_force: InForce, verdict: Verdict) -> TpdoPort:
    """Return a TPDO that is sent after every SYNC.

    Raises:
        SetupRefused: It is not.
    """
    port = port_of(node, number)
    others_off(node, number)
    before_ms = port.period_ms
    set_up(node, port, EVERY_SYNC)
    port.start()
    require_acts(in_force, port, before_ms, verdict)
    if _answered(node, port, Frame(sync_id(node))) != 1:
        raise SetupRefused("the TPDO does not follow SYNC, see TPDO-03")
    return port


def _cob_id(spec: DeviceSpec) -> Entry | None:
    consumer = spec.services.sync_consumer
    return None if consumer is None or consumer.object is None else spec.entry(consumer.object)


def _movable(spec: DeviceSpec) -> Iterable[Case]:
    entry = _cob_id(spec)
    if entry is not None and all(reading.writable for reading in entry.readings):
        for case in first_synchronous(spec):
            yield Case(entry.address, case.subject, entry.source)


@requirement(
    "SYNC-01",
    level="shall",
    cases=("number", waiting(_movable)),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_sync_is_taken_on_its_cob_id(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """With another COB-ID of SYNC the node follows that identifier, and no longer the one before."""
    port = _follows_sync(node, number, in_force, verdict)
    node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    before, entry = sync_id(node), _cob_id(node.spec)
    if entry is None:
        raise SetupRefused("the manual documents no COB-ID of SYNC")

    answer = node.try_download(*entry.key, entry.type.encode(FREE_CAN_ID))
    port.start()
    old, new = (_answered(node, port, Frame(can_id)) for can_id in (before, FREE_CAN_ID))

    verdict.equal(f"download of {FREE_CAN_ID:X}h", outcome_of(answer), "accepted")
    verdict.equal(f"TPDOs after {before:03X}h", old, 0)
    verdict.equal(f"TPDOs after {FREE_CAN_ID:X}h", new, 1)


@requirement(
    "SYNC-02",
    level="shall",
    cases=("number", waiting(synchronous)),
    source=f"{CIA301}, 7.3.2.2.5",
    effects=("reads", "writes"),
)
def test_sync_sends_in_operational_only(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """A SYNC sends no TPDO in Pre-operational or in Stopped."""
    port, frame = _follows_sync(node, number, in_force, verdict), Frame(sync_id(node))

    for state in (NmtState.STOPPED, NmtState.PRE_OPERATIONAL):
        node.nmt(ENTER[state])
        port.listen(ANSWER_S)
        seen = _answered(node, port, frame) + _answered(node, port, frame)
        verdict.equal(f"TPDOs after two SYNCs in {state_word(state)}", seen, 0)
    require_alive(node)


def _lengths(spec: DeviceSpec) -> Iterable[Case]:
    for case in first_synchronous(spec):
        for length in LENGTHS:
            numbered = Numbered(case.subject, length)
            yield Case(f"{case.label}/{length}-octets", numbered, case.section)


@requirement(
    "SYNC-03",
    level="shall",
    cases=("sync", waiting(_lengths)),
    source=f"{CIA301}, 7.2.5",
    effects=("reads", "writes"),
)
def test_node_outlives_sync_with_data(
    node: Node, sync: Numbered, in_force: InForce, verdict: Verdict
) -> None:
    """After a SYNC with a counter or of a wrong length the node follows the next proper one."""
    port = _follows_sync(node, sync.number, in_force, verdict)

    node.send(Frame(sync_id(node), bytes([1] * sync.figure)))
    port.listen(ANSWER_S)
    port.start()
    seen = _answered(node, port, Frame(sync_id(node)))

    verdict.equal(f"TPDOs after a SYNC behind one of {sync.figure} octets", seen, 1)


def _consumer_only(spec: DeviceSpec) -> Iterable[Case]:
    entry = _cob_id(spec)
    if entry is not None:
        defaults = [reading.default for reading in entry.readings]
        if all(isinstance(it, int) and not it & GENERATES for it in defaults):
            yield Case(entry.address, entry, entry.source)
        return
    consumers = [services.sync_consumer for services, _ in spec.services_readings]
    if (
        all(it is not None and it.object is None for it in consumers)
        and spec.services.sync_consumer
    ):
        yield Case(f"{SYNC:03X}h", None, spec.services.sync_consumer.source)


@requirement(
    "SYNC-04",
    level="shall",
    cases=("entry", _consumer_only),
    source=COB_ID,
)
def test_consumer_sends_no_sync(node: Node, entry: Entry | None, verdict: Verdict) -> None:
    """With bit 30 of its COB-ID clear, or without one, the node does not send SYNC."""
    word = SYNC if entry is None else node.number(*entry.key)
    if entry is not None and word & GENERATES:
        raise SetupRefused(f"{entry.address} holds {word:08X}h, by which the node generates SYNC")
    node.nmt(NmtCommand.START)

    seen = node.link.listen(LISTENED_S, lambda frame: frame.can_id == word & CAN_ID)
    node.nmt(NmtCommand.STOP)
    if seen and node.link.listen(LISTENED_S, lambda frame: frame.can_id == word & CAN_ID):
        raise SetupRefused("SYNC comes while the node is stopped too, so another node sends it")
    node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)

    verdict.equal(f"frames on {word & CAN_ID:03X}h", len(seen), 0)
    require_alive(node)


@requirement(
    "SYNC-05",
    level="shall",
    cases=("number", waiting(first_synchronous)),
    source=COB_ID,
    effects=("reads", "writes"),
)
def test_sync_has_11_bits(node: Node, number: int, in_force: InForce, verdict: Verdict) -> None:
    """A frame with a 29-bit identifier of the same number is no SYNC."""
    port = _follows_sync(node, number, in_force, verdict)

    extended = _answered(node, port, Frame(sync_id(node), extended=True))
    proper = _answered(node, port, Frame(sync_id(node)))

    verdict.equal("TPDOs after the frame with 29 bits", extended, 0)
    verdict.equal("TPDOs after the next SYNC", proper, 1)
