"""A master that tries what a device does: its heartbeat, its states, its LSS address, its errors."""

from __future__ import annotations

from collections.abc import Sequence

import can
from recorded_session import PERIOD_MS, Master

from conformance.wire import lss, nmt
from conformance.wire.cob_id import LSS_MASTER
from conformance.wire.frame import Frame
from conformance.wire.lss import LssCommand
from conformance.wire.nmt import NmtCommand

ROUNDS = 2
IDENTITY, EVENT_TIMER = 0x1018, 5
STEPS = (
    NmtCommand.START,
    NmtCommand.STOP,
    NmtCommand.START,
    NmtCommand.ENTER_PRE_OPERATIONAL,
    NmtCommand.STOP,
    NmtCommand.ENTER_PRE_OPERATIONAL,
)


def tour(device: str, faults: Sequence[str] = ()) -> list[can.Message]:
    """Return what a recorder sees of a master that tries a device out."""
    master = Master(device, faults)
    for _ in range(ROUNDS):
        master.command(NmtCommand.RESET_NODE, 2.0)
        for entry in master.spec.entries.values():
            if entry.readable:
                master.upload(entry.index, entry.sub)
        master.listen(4.0)
        _heartbeat(master)
        _states(master)
        _layer_settings(master)
        for entry in master.spec.entries.values():
            if entry.access == "ro" and entry.type.is_integer:
                master.download(entry.index, entry.sub, 1)
            elif not entry.readable:
                master.upload(entry.index, entry.sub)
    return master.close()


def _heartbeat(master: Master) -> None:
    producer = master.spec.services.heartbeat_producer
    assert producer is not None
    for period_ms in (producer.off, PERIOD_MS, producer.off, max(1, producer.min_ms - 1)):
        master.download(producer.object, 0, period_ms)
        master.listen(1.5)
        master.upload(0x1000, 0)
    master.download(producer.object, 0, PERIOD_MS)
    master.listen(1.0)


def _states(master: Master) -> None:
    tpdo = master.spec.services.tpdo
    timer = tpdo and master.spec.entry(tpdo.communication, EVENT_TIMER)
    if timer and timer.writable:
        master.download(*timer.key, PERIOD_MS)
    for node_id in (master.spec.node_id, 0):
        for command in STEPS:
            master.send(nmt.encode_request(nmt.NmtRequest(command, node_id)))
            master.listen(0.6)
            master.upload(0x1000, 0)
            master.listen(0.5)


def _layer_settings(master: Master) -> None:
    if master.spec.services.lss is None:
        return
    first = LssCommand.SWITCH_SELECTIVE_VENDOR
    for sub in range(1, 5):
        master.upload(IDENTITY, sub)
        number = int.from_bytes(master.messages[-1].data[4:8], "little")
        _tell(master, lss.SwitchSelective(LssCommand(first + sub - 1), number))
    for command in range(LssCommand.INQUIRE_VENDOR, LssCommand.INQUIRE_NODE_ID):
        _tell(master, lss.InquireIdentity(LssCommand(command)))
    _tell(master, lss.InquireNodeId())
    _tell(master, lss.SwitchStateGlobal(0))


def _tell(master: Master, message: lss.MasterMessage) -> None:
    master.send(Frame(LSS_MASTER, lss.encode(message)))
    master.listen(0.05)
