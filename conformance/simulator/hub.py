"""A simulated bus on the virtual clock for several processes: time passes while all of them wait."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any, Final, TypeAlias

from conformance.errors import ConformanceError
from conformance.simulator.bus import Client, SimulatedBus
from conformance.simulator.rig import SimulatorRig
from conformance.simulator.segment import SECOND
from conformance.wire.frame import Frame

Received: TypeAlias = tuple[int, Frame]
"""The end of a frame in ns, and the frame."""

NEVER: Final = 1 << 62
_NODE_ID: Final = 0x7F


class _Port:
    """One process at the hub.

    Args:
        connection: To it.
    """

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.client: Client | None = None
        self.received: list[Received] = []
        self.until_ns: int | None = None
        self.node_id = 0
        self.alone = True
        self.awake = False

    def deliver(self, end_ns: int, frame: Frame, own: bool) -> None:
        """Keep a frame for the process; wake it if it may wait for that one."""
        if not own:
            self.received.append((end_ns, frame))
            self.awake |= self.alone or frame.can_id & _NODE_ID in (self.node_id, 0)

    @property
    def runs(self) -> bool:
        """It is on the bus and waits for nothing, so that time may not pass."""
        return self.client is not None and self.until_ns is None


class Hub(SimulatorRig):
    """Serves a simulated bus to other processes, from a thread of its own.

    Args:
        ports: How many processes there are to be.

    Attributes:
        ends: A connection for each of them, to be handed to `HubBus`.
    """

    def __init__(self, ports: int) -> None:
        self._bus = SimulatedBus(0)
        pairs = [Pipe() for _ in range(ports)]
        self.ends: Sequence[Connection] = [end for _, end in pairs]
        self._ports = {own: _Port(own) for own, _ in pairs}
        self._thread = threading.Thread(target=self._serve, name="hub", daemon=True)
        self._thread.start()

    def put(self, bus: SimulatedBus) -> None:
        """Serve another bus from now on; no process may be on the former one."""
        self._bus = bus

    def close(self) -> None:
        """Let go of this process' ends, and wait until all others have."""
        for end in self.ends:
            end.close()
        self._thread.join()

    @contextmanager
    def present(self) -> Iterator[SimulatedBus]:
        """Hold the bus; the hub's own thread alone may."""
        yield self._bus

    def _serve(self) -> None:
        while self._ports:
            there = [it for it in self._ports.values() if it.client is not None]
            if there and not any(it.runs for it in there):
                self._advance(there)
                continue
            watched = [it.connection for it in self._ports.values() if it.until_ns is None]
            for ready in wait(watched):
                self._hear(self._ports[ready])  # type: ignore[index]  # what was watched

    def _advance(self, there: Sequence[_Port]) -> None:
        """Let time pass until something is there for a process, or its wait is over."""
        bus = self._bus
        limit_ns = min(it.until_ns or 0 for it in there)
        for port in there:
            port.alone = len(there) == 1
        going = not any(it.awake for it in there)
        while going:
            going = bus.advance(limit_ns) and not any(it.awake for it in there)
        for port in there:
            if port.awake or (port.until_ns or 0) <= bus.now_ns:
                self._answer(port)

    def _answer(self, port: _Port) -> None:
        received, port.received, port.until_ns, port.awake = port.received, [], None, False
        self._tell(port, (self._bus.now_ns, received))

    def _tell(self, port: _Port, answer: object) -> None:
        try:
            port.connection.send(answer)
        except OSError:
            self._gone(port)

    def _gone(self, port: _Port) -> None:
        """Forget a process that has ended."""
        self._leave(port)
        self._ports.pop(port.connection, None)
        port.connection.close()

    def _leave(self, port: _Port) -> None:
        if port.client is not None:
            self._bus.disconnect(port.client)
        port.client, port.until_ns, port.received, port.awake = None, None, [], False

    def _hear(self, port: _Port) -> None:
        try:
            told = port.connection.recv()
        except (EOFError, OSError):
            self._gone(port)
            return
        for what, *arguments in told:
            getattr(self, f"_on_{what}")(port, *arguments)

    def _on_join(self, port: _Port, bitrate: int, node_id: int) -> None:
        port.node_id = node_id
        port.client = self._bus.connect(port.deliver, bitrate)
        self._tell(port, self._bus.now_ns)

    def _on_leave(self, port: _Port) -> None:
        self._leave(port)

    def _on_send(self, port: _Port, frame: Frame) -> None:
        if port.client is not None:
            self._bus.send(port.client, frame)

    def _on_recv(self, port: _Port, timeout_ns: int | None) -> None:
        port.until_ns = NEVER if timeout_ns is None else self._bus.now_ns + timeout_ns

    def _on_bitrate(self, port: _Port, bitrate: int) -> None:
        if port.client is not None:
            port.client.bitrate = bitrate

    def _on_call(self, port: _Port, name: str, arguments: Sequence[Any]) -> None:
        value = getattr(self, name)
        try:
            answer = value(*arguments) if callable(value) else value
        except (ConformanceError, IndexError) as error:
            answer = error
        self._tell(port, answer)


def nanoseconds(timeout_s: float) -> int:
    """Return a timeout in ns, not below 0."""
    return max(0, round(timeout_s * SECOND))
