"""A device as the bus sees it with a man in the middle, and the witness of what he lets out."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import Any

from meddling import MS, SECOND, Mischief

from conformance.simulator.device import SimulatedDevice
from conformance.wire import cob_id
from conformance.wire.frame import Frame

ANSWER_NS = 300_000
SEEN_NS = 100 * MS
"""What went out so long before the last request was seen."""

LATE_NS = 12 * SECOND
"""After requests that overlapped, answers to any of them may come for so long."""


class Witness:
    """Sees what goes out, and what of it no conforming device could have sent.

    Only what is beyond doubt counts: an SDO response that has not 8 octets, a second response to one
    request, one to an upload or download that is neither its confirmation nor an abort, each with
    its object; a heartbeat that shows no NMT state. Nothing is sure after requests that overlapped. A frame at the very end of a run may come too late
    to be seen, and a device that has moved to another node-ID is left alone, as are block transfers.

    Args:
        node_id: The node-ID at which the device is judged.
    """

    def __init__(self, node_id: int) -> None:
        self._request_id = cob_id.sdo_request(node_id)
        self._response_id = cob_id.sdo_response(node_id)
        self._heartbeat_id = cob_id.heartbeat(node_id)
        self._open: list[bytes] = []
        self._doubtful = True
        self._doubtful_until_ns = 0
        self._illegal_ns: list[int] = []
        self._asked_ns = 0

    def hear(self, now_ns: int, frame: Frame) -> None:
        """Take note of what the bench asks."""
        if frame.can_id == 0:
            self._doubtful = True
        if frame.can_id != self._request_id or frame.extended or frame.remote:
            return
        self._asked_ns = now_ns
        command = frame.data[0] & 0xE0 if len(frame.data) == 8 else None
        self._doubtful = command not in (0x20, 0x40)
        if self._open:
            self._doubtful_until_ns = now_ns + LATE_NS
        self._open = [] if command == 0x80 else [*self._open, frame.data]

    def see(self, now_ns: int, frame: Frame) -> None:
        """Take note of what goes out."""
        if frame.remote or frame.extended:
            return
        if frame.can_id == self._heartbeat_id:
            legal = len(frame.data) == 1 and frame.data[0] & 0x7F in (0, 4, 5, 127)
        elif frame.can_id == self._response_id:
            doubtful = self._doubtful or now_ns < self._doubtful_until_ns
            legal = doubtful or self._answers(frame.data)
            self._open = []
        else:
            return
        if not legal:
            self._illegal_ns.append(now_ns)

    def _answers(self, data: bytes) -> bool:
        if len(data) != 8 or len(self._open) != 1:
            return False
        (request,) = self._open
        confirms = 0x60 if request[0] & 0xE0 == 0x20 else 0x40
        return data[0] & 0xE0 in (confirms, 0x80) and data[1:4] == request[1:4]

    @property
    def illegal(self) -> int:
        """Illegal frames that came while the bench was still at it."""
        return sum(it < self._asked_ns - SEEN_NS for it in self._illegal_ns)


class Meddler:
    """A device as the bus sees it, and what is done to its frames.

    Args:
        device: The device.
        mischief: What is done.
    """

    def __init__(self, device: SimulatedDevice, mischief: Mischief) -> None:
        self._device = device
        self._mischief = mischief
        self.witness = Witness(device.node_id)
        self._late: list[tuple[int, int, Frame]] = []
        self._order = 0
        self._ask_ns: int | None = None
        mischief.meet(device)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)

    @property
    def deadline_ns(self) -> int | None:
        late_ns = self._late[0][0] if self._late else None
        return min(filter(None, (self._device.deadline_ns, late_ns, self._ask_ns)), default=None)

    def power_on(self, now_ns: int) -> None:
        self._device.power_on(now_ns)
        self._ask_ns = now_ns + 1

    def power_off(self) -> None:
        self._device.power_off()
        self._late.clear()
        self._ask_ns = None

    def step(self, now_ns: int, frames: Sequence[Frame] = ()) -> list[Frame]:
        mischief = self._mischief
        mischief.node_id, mischief.now_ns = self._device.node_id, now_ns
        if not self._device.powered:
            return []
        for frame in frames:
            self.witness.hear(now_ns, frame)
        heard = [it for frame in frames for it in mischief.hear(frame)]
        for frame in self._device.step(now_ns, heard):
            for changed in mischief.answer(frame):
                self._send(now_ns + mischief.delay_ns(), changed)
        replies, mischief.replies = mischief.replies, []
        for frame in replies:
            self._send(now_ns + ANSWER_NS, frame)
        sent = []
        while self._late and self._late[0][0] <= now_ns:
            sent.append(heapq.heappop(self._late)[2])
        if self._ask_ns is not None and self._ask_ns <= now_ns:
            self._ask_ns, more = mischief.unasked(now_ns)
            sent += more
        for frame in sent:
            self.witness.see(now_ns, frame)
        return sent

    def _send(self, due_ns: int, frame: Frame) -> None:
        self._order += 1
        heapq.heappush(self._late, (due_ns, self._order, frame))
