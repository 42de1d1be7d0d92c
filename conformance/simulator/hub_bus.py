"""The bus of a hub as a python-can interface: ``can.Bus(interface="canopen_simulator_hub", …)``."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

import can

from conformance.interrupts import uninterrupted
from conformance.messages import to_frame
from conformance.rig_calls import RigCalls
from conformance.simulator.hub import Received, nanoseconds
from conformance.simulator.interface import to_simulated_message
from conformance.simulator.segment import SECOND
from conformance.wire.errors import WireError


class HubBus(RigCalls, can.BusABC):
    """A CAN adapter at the simulated bus of another process, on its virtual clock.

    Args:
        channel: What the bus is called.
        connection: To the hub; it outlives this object.
        bitrate: Of this adapter in bit/s.
        node_id: Of the node that it is for. While others are on the bus, frames of other nodes wait
            for one of this node, or for the end of a timeout.
    """

    def __init__(self, channel: str, connection: Connection, bitrate: int, node_id: int) -> None:
        self.channel = channel
        self.channel_info = f"simulated bus {channel}"
        self._connection = connection
        self._received: deque[Received] = deque()
        self._told: list[tuple[object, ...]] = []
        self._now_ns = int(self._ask("join", bitrate, node_id))
        super().__init__(channel)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 - never blocks
        """Hand a frame over to the bus; no simulated time passes."""
        try:
            self._tell("send", to_frame(msg))
        except WireError as error:
            raise can.CanOperationError(str(error)) from error

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame, None after the timeout in simulated seconds; None waits for ever.

        Without a timeout the hub is not asked: no time passes while this process waits for nothing.
        """
        wait_ns = None if timeout is None else nanoseconds(timeout)
        if not self._received and wait_ns != 0:
            with uninterrupted():
                self._now_ns, received = self._ask("recv", wait_ns)
                self._received.extend(received)
        if not self._received:
            return None
        end_ns, frame = self._received.popleft()
        return to_simulated_message(end_ns, frame, self.channel, own=False)

    def shutdown(self) -> None:
        """Leave the bus."""
        if not self._is_shutdown:
            super().shutdown()
            self._tell("leave")
            with suppress(can.CanError):  # it is gone
                self._say()

    # Its clock

    @property
    def real_time(self) -> bool:
        """Simulated time follows the clock of the computer: it does not."""
        return False

    def now(self) -> float:
        """Return the simulated time in seconds; it passes while all processes wait for frames."""
        return self._now_ns / SECOND

    def use_bitrate(self, bitrate: int) -> None:
        """Send and receive at another bit rate from now on, in bit/s."""
        self._tell("bitrate", bitrate)

    @property
    def frame_count(self) -> int:
        """Frames on the bus so far, of everybody."""
        return int(self._call("frame_count"))

    # To the hub

    def _call(self, name: str, *arguments: object) -> Any:
        answer = self._ask("call", name, arguments)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def _ask(self, what: str, *arguments: object) -> Any:
        """Return an answer; an interrupt before it is there would leave it to the next question."""
        with uninterrupted():
            self._tell(what, *arguments)
            self._say()
            try:
                return self._connection.recv()
            except (EOFError, OSError) as error:
                raise can.CanOperationError(f"{self.channel_info} is gone") from error

    def _tell(self, what: str, *arguments: object) -> None:
        """Keep what the hub has to do before it answers the next question; no time passes until then."""
        self._told.append((what, *arguments))

    def _say(self) -> None:
        told, self._told = self._told, []
        try:
            self._connection.send(told)
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info} is gone") from error
