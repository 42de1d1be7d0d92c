"""A simulated CAN bus: arbitration by identifier, frames with their duration, virtual time."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Sequence
from itertools import count
from typing import Protocol

from conformance.simulator.device import SimulatedDevice
from conformance.wire.frame import Frame, bit_length, priority

SECOND = 1_000_000_000
LOAD_WINDOW_NS = SECOND
"""The bus load is that of the last so many nanoseconds."""

MOST_FRAMES = 22_000
"""At 1 Mbit/s no more frames fit into that time, of 47 bits at least."""

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


class Participant(Protocol):
    """What sends frames by itself, or in answer to others."""

    @property
    def bitrate(self) -> int:
        """In bit/s."""

    @property
    def deadline_ns(self) -> int | None:
        """When it next wants to be stepped, None when only a frame can wake it."""

    def step(self, now_ns: int, frames: Sequence[Frame] = ()) -> list[Frame]:
        """Let time pass, take frames in and return the frames to send now."""


class _Station:
    """A simulated participant at the bus."""

    def __init__(self, participant: Participant) -> None:
        self.participant = participant
        self.pending: deque[Frame] = deque()
        self.wake_ns: int | None = None

    @property
    def bitrate(self) -> int:
        return self.participant.bitrate


class SimulatedBus:
    """One CAN segment with its nodes and clients.

    Each participant sends its frames in order. When the bus is idle the lowest identifier among
    their first frames wins. A frame reaches the others at its end.

    Args:
        bitrate: Of clients that name none, in bit/s.
    """

    def __init__(self, bitrate: int) -> None:
        self.bitrate = bitrate
        self.now_ns = 0
        self.frame_count = 0
        self._nodes: list[SimulatedDevice] = []
        self._stations: list[_Station] = []
        self._clients: list[Client] = []
        self._talking: list[_Station | Client] = []
        self._wakes: list[tuple[int, int, _Station]] = []
        self._order = count()
        self._sender: _Station | Client | None = None
        self._frame = Frame(0)
        self._frame_bitrate = bitrate
        self._frame_end_ns = 0
        self._busy: deque[tuple[int, int]] = deque(maxlen=MOST_FRAMES)

    @property
    def nodes(self) -> tuple[SimulatedDevice, ...]:
        """The devices, in the order they were added."""
        return tuple(self._nodes)

    def add_node(self, device: SimulatedDevice) -> None:
        """Connect a device; it is switched on now."""
        self._nodes.append(device)
        self._stations.append(_Station(device))
        self.power_on(device)

    def add_deaf(self, participant: Participant) -> None:
        """Connect what sends by the clock alone, for good; no frame is handed to it."""
        self._rewake(_Station(participant))

    def remove_node(self, device: SimulatedDevice) -> None:
        """Disconnect a device; it is switched off first."""
        self.power_off(device)
        self._nodes.remove(device)
        self._stations.remove(self._station(device))

    def power_on(self, device: SimulatedDevice) -> None:
        """Switch a device on."""
        station = self._station(device)
        device.power_on(self.now_ns)
        self._rewake(station)

    def power_off(self, device: SimulatedDevice) -> None:
        """Switch a device off; what it has not sent is lost."""
        station = self._station(device)
        device.power_off()
        station.pending.clear()
        if station in self._talking:
            self._talking.remove(station)
        self._rewake(station)

    def stimulate(self, device: SimulatedDevice, act: Callable[[SimulatedDevice], None]) -> None:
        """Do something to a device from outside; it sends what follows from that."""
        station = self._station(device)
        self._step(station, ())
        act(device)
        self._step(station, ())

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

    def load(self) -> float:
        """Return the share of the last second that frames took, 0.0 to 1.0."""
        oldest_ns = self.now_ns - LOAD_WINDOW_NS
        busy_ns = sum(duration_ns for end_ns, duration_ns in self._busy if end_ns > oldest_ns)
        return busy_ns / min(LOAD_WINDOW_NS, max(self.now_ns, 1))

    def run_until(self, limit_ns: int) -> None:
        """Let time pass."""
        while self.advance(limit_ns):
            pass

    def next_event_ns(self) -> int | None:
        """Return when something next happens, None when only a client can make it happen."""
        if self._sender is None and self._talking:
            self._start_frame()
        wakes = self._wakes
        while wakes and wakes[0][0] != wakes[0][2].wake_ns:
            heapq.heappop(wakes)
        wake_ns = wakes[0][0] if wakes else None
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
        while self._wakes and self._wakes[0][0] <= event_ns:
            wake_ns, _, station = heapq.heappop(self._wakes)
            if station.wake_ns == wake_ns:
                station.wake_ns = None
                self._step(station, ())
        if self._sender is not None and self._frame_end_ns <= event_ns:
            self._end_frame()
        return True

    def _station(self, device: SimulatedDevice) -> _Station:
        return next(it for it in self._stations if it.participant is device)

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

    def _step(self, station: _Station, frames: tuple[Frame, ...]) -> None:
        sent = station.participant.step(self.now_ns, frames)
        if sent:
            if not station.pending:
                self._talking.append(station)
            station.pending.extend(sent)
        self._rewake(station)

    def _rewake(self, station: _Station) -> None:
        deadline_ns = station.participant.deadline_ns
        if deadline_ns != station.wake_ns:
            station.wake_ns = deadline_ns
            if deadline_ns is not None:
                heapq.heappush(self._wakes, (deadline_ns, next(self._order), station))


def _priority_of_first(participant: _Station | Client) -> tuple[int, int, int, int]:
    return priority(participant.pending[0])
