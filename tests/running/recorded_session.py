"""A master as customers have one, and what a recorder writes of its work with a simulated device."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import can

from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec
from conformance.wire import cob_id, nmt, sdo
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand

SPECS = Path(__file__).parents[2] / "device_specs"
PERIOD_MS = 100
CLOSE_S = 1e-6
"""What is nearer on the virtual clock than this is now."""


class Master:
    """A master that reads and sets a device up, and starts and stops it.

    Args:
        device: Built-in name.
        faults: Of the simulated device.
        readings: That it follows.
    """

    def __init__(
        self, device: str, faults: Sequence[str] = (), readings: Mapping[str, int] | None = None
    ) -> None:
        self.spec: DeviceSpec = load_spec(SPECS / f"{device}.yaml").resolve(None, None)
        self.messages: list[can.Message] = []
        self._bus = can.Bus(
            interface="canopen_simulator",
            channel=device,
            faults=list(faults),
            readings=readings,
            receive_own_messages=True,
            ignore_config=True,
        )

    def close(self) -> list[can.Message]:
        """Return what was recorded."""
        self._bus.shutdown()
        return self.messages

    def listen(self, duration_s: float) -> None:
        """Record for a while."""
        end_s = self._bus.now() + duration_s  # type: ignore[attr-defined]  # the simulator's own
        while (left_s := end_s - self._bus.now()) > CLOSE_S:  # type: ignore[attr-defined]
            self._receive(left_s)

    def _receive(self, timeout_s: float) -> Frame | None:
        message = self._bus.recv(timeout_s)
        if message is None:
            return None
        message.channel = 0
        self.messages.append(message)
        return Frame(message.arbitration_id, bytes(message.data))

    def send(self, frame: Frame) -> None:
        """Send a frame; it is recorded like those of others."""
        self._bus.send(
            can.Message(arbitration_id=frame.can_id, data=frame.data, is_extended_id=False)
        )

    def command(self, command: NmtCommand, then_s: float) -> None:
        """Send an NMT command and record for a while."""
        self.send(nmt.encode_request(nmt.NmtRequest(command, self.spec.node_id)))
        self.listen(then_s)

    def _ask(self, request: sdo.Request) -> sdo.Response | None:
        node_id = self.spec.node_id
        self.send(Frame(cob_id.sdo_request(node_id), sdo.encode(request)))
        for _ in range(20):
            frame = self._receive(0.2)
            if frame is None:
                return None
            if frame.can_id == cob_id.sdo_response(node_id):
                return sdo.decode_response(frame.data) if len(frame.data) == 8 else None
        return None

    def upload(self, index: int, sub: int) -> None:
        """Read an object, in segments where it must be."""
        reply = self._ask(sdo.InitiateUpload(index, sub))
        toggle = False
        while isinstance(reply, sdo.InitiateUploadReply | sdo.UploadSegmentReply):
            if isinstance(reply, sdo.InitiateUploadReply) and reply.expedited:
                return
            if isinstance(reply, sdo.UploadSegmentReply):
                if reply.last:
                    return
                toggle = not toggle
            reply = self._ask(sdo.UploadSegment(toggle))

    def download(self, index: int, sub: int, value: int) -> None:
        """Write a number."""
        data = self.spec.entries[index, sub].type.encode(value)
        self._ask(sdo.InitiateDownload(index, sub, data))


def session(
    device: str, faults: Sequence[str] = (), readings: Mapping[str, int] | None = None
) -> list[can.Message]:
    """Return what a recorder sees of a master that takes a device into use."""
    master = Master(device, faults, readings)
    spec = master.spec
    producer, tpdo = spec.services.heartbeat_producer, spec.services.tpdo
    for _ in range(2):
        master.command(NmtCommand.RESET_NODE, 2.0)
        for entry in spec.entries.values():
            if entry.readable:
                master.upload(entry.index, entry.sub)
        master.listen(0.5)
        assert producer is not None
        assert tpdo is not None
        master.download(producer.object, 0, PERIOD_MS)
        timer = spec.entry(tpdo.communication, 5)
        if timer is not None and timer.writable:
            master.download(*timer.key, PERIOD_MS)
        master.listen(1.5)
        for entry in (spec.entries[0x1018, 1], spec.entries[0x1000, 0]):
            master.download(*entry.key, 1)
        for command in (NmtCommand.START, NmtCommand.STOP, NmtCommand.ENTER_PRE_OPERATIONAL):
            master.command(command, 1.5)
    return master.close()


def write(messages: Sequence[can.Message], path: Path) -> Path:
    """Write a recording by python-can, in the format that the file's name tells."""
    with can.Logger(path) as logger:
        for message in messages:
            logger(message)
    return path
