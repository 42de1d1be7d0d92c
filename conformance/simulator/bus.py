"""A simulated CAN bus: arbitration by identifier, frames with their duration, virtual time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from conformance.simulator.segment import SECOND, Segment, Station
from conformance.wire.frame import Frame, bit_length, priority

Deliver = Callable[[int, Frame, bool], None]
"""Called with the end of a frame in ns, the frame, and whether the receiver itself sent it."""


class Client:
    """A participant outside the simulation, such as a CAN adapter.

    Args:
        bitrate: In bit/s; it hears, and is heard by, only those with the same one.
        deliver: Called at the end of each frame, its own included.
    """

    def __init__(self, bitrate: int, deliver: Deliver) -> None:
        self.bitrate = bitrate
        self.deliver = deliver
        self.pending: deque[Frame] = deque()


class SimulatedBus(Segment):
    """One CAN segment with its nodes and clients.

    Each participant sends its frames in order. When the bus is idle the lowest identifier among
    their first frames wins. A frame reaches the others at its end.

    Args:
        bitrate: Of clients that name none, in bit/s.
    """

    def __init__(self, bitrate: int) -> None:
        super().__init__()
        self.bitrate = bitrate
        self._clients: list[Client] = []
        self._talking: list[Station | Client] = []
        self._sender: Station | Client | None = None
        self._frame = Frame(0)
        self._frame_bitrate = bitrate
        self._frame_end_ns = 0

    def connect(self, deliver: Deliver, bitrate: int | None = None) -> Client:
        """Connect a client."""
        client = Client(bitrate or self.bitrate, deliver)
        self._clients.append(client)
        return client

    def disconnect(self, client: Client) -> None:
        """Disconnect a client; what it has handed over is still sent."""
        self._clients.remove(client)

    def send(self, client: Client, frame: Frame) -> None:
        """Hand a client's frame over; it takes part in arbitration from now on."""
        if not client.pending:
            self._talking.append(client)
        client.pending.append(frame)

    def flush(self, client: Client) -> None:
        """Drop what a client has handed over and not yet begun to send."""
        if client.pending:
            client.pending.clear()
            self._talking.remove(client)

    def run_until(self, limit_ns: int) -> None:
        """Let time pass."""
        while self.advance(limit_ns):
            pass

    def next_event_ns(self) -> int | None:
        """Return when something next happens, None when only a client can make it happen."""
        if self._sender is None and self._talking:
            self._start_frame()
        wake_ns = self._next_wake_ns()
        if self._sender is None:
            return wake_ns
        return self._frame_end_ns if wake_ns is None else min(wake_ns, self._frame_end_ns)

    def advance(self, limit_ns: int | None) -> bool:
        """Go on to the next instant at which something happens.

        Args:
            limit_ns: No further than this; None for no limit.

        Returns:
            Whether something happened. Otherwise it is ``limit_ns`` now.
        """
        event_ns = self.next_event_ns()
        if event_ns is None or (limit_ns is not None and event_ns > limit_ns):
            if limit_ns is not None and limit_ns > self.now_ns:
                self.now_ns = limit_ns
            return False
        self.now_ns = event_ns
        self._step_the_woken()
        if self._sender is not None and self._frame_end_ns <= event_ns:
            self._end_frame()
        return True

    def _start_frame(self) -> None:
        talking = self._talking
        winner = talking[0] if len(talking) == 1 else min(talking, key=_priority_of_first)
        frame = winner.pending.popleft()
        if not winner.pending:
            talking.remove(winner)
        self._sender = winner
        self._frame = frame
        self._frame_bitrate = winner.bitrate
        duration_ns = bit_length(frame) * SECOND // winner.bitrate
        self._frame_end_ns = self.now_ns + duration_ns
        self._busy.append((self._frame_end_ns, duration_ns))

    def _end_frame(self) -> None:
        sender, frame, bitrate = self._sender, self._frame, self._frame_bitrate
        self._sender = None
        self.frame_count += 1
        received = (frame,)
        for station in self._stations:
            if station is not sender and station.bitrate == bitrate:
                self._step(station, received)
        for client in self._clients:
            if client.bitrate == bitrate:
                client.deliver(self.now_ns, frame, client is sender)

    def _enqueue(self, station: Station, frames: Sequence[Frame]) -> None:
        if not station.pending:
            self._talking.append(station)
        station.pending.extend(frames)

    def _discard(self, station: Station) -> None:
        station.pending.clear()
        if station in self._talking:
            self._talking.remove(station)


def _priority_of_first(participant: Station | Client) -> tuple[int, int, int, int]:
    return priority(participant.pending[0])
