"""A CAN segment with simulated devices: who is on it, and when each is stepped next."""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from itertools import count
from typing import Protocol

from conformance.simulator.device import SimulatedDevice
from conformance.wire.frame import Frame

SECOND = 1_000_000_000
LOAD_WINDOW_NS = SECOND
"""The bus load is that of the last so many nanoseconds."""

MOST_FRAMES = 22_000
"""At 1 Mbit/s no more frames fit into that time, of 47 bits at least."""


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


class Station:
    """A simulated participant at the bus.

    Args:
        participant: The participant.
    """

    def __init__(self, participant: Participant) -> None:
        self.participant = participant
        self.pending: deque[Frame] = deque()
        self.wake_ns: int | None = None

    @property
    def bitrate(self) -> int:
        """In bit/s."""
        return self.participant.bitrate


class Segment(ABC):
    """The simulated devices of one CAN segment.

    Attributes:
        now_ns: The present, in nanoseconds since the beginning.
        frame_count: Frames so far.
    """

    def __init__(self) -> None:
        self.now_ns = 0
        self.frame_count = 0
        self._nodes: list[SimulatedDevice] = []
        self._stations: list[Station] = []
        self._wakes: list[tuple[int, int, Station]] = []
        self._order = count()
        self._busy: deque[tuple[int, int]] = deque(maxlen=MOST_FRAMES)

    @abstractmethod
    def run_until(self, limit_ns: int) -> None:
        """Let time pass."""

    @abstractmethod
    def next_event_ns(self) -> int | None:
        """Return when something next happens, None when only somebody else can make it happen."""

    @abstractmethod
    def _enqueue(self, station: Station, frames: Sequence[Frame]) -> None:
        """Take in what a station wants to send."""

    @abstractmethod
    def _discard(self, station: Station) -> None:
        """Lose what a station has not sent yet."""

    @property
    def nodes(self) -> tuple[SimulatedDevice, ...]:
        """The devices, in the order they were added."""
        return tuple(self._nodes)

    def add_node(self, device: SimulatedDevice) -> None:
        """Connect a device; it is switched on now."""
        self._nodes.append(device)
        self._stations.append(Station(device))
        self.power_on(device)

    def add_deaf(self, participant: Participant) -> None:
        """Connect what sends by the clock alone, for good; no frame is handed to it."""
        self._rewake(Station(participant))

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
        self._discard(station)
        self._rewake(station)

    def stimulate(self, device: SimulatedDevice, act: Callable[[SimulatedDevice], None]) -> None:
        """Do something to a device from outside; it sends what follows from that."""
        station = self._station(device)
        self._step(station, ())
        act(device)
        self._step(station, ())

    def load(self) -> float:
        """Return the share of the last second that frames took, 0.0 to 1.0."""
        oldest_ns = self.now_ns - LOAD_WINDOW_NS
        busy_ns = sum(duration_ns for end_ns, duration_ns in self._busy if end_ns > oldest_ns)
        return busy_ns / min(LOAD_WINDOW_NS, max(self.now_ns, 1))

    def _next_wake_ns(self) -> int | None:
        wakes = self._wakes
        while wakes and wakes[0][0] != wakes[0][2].wake_ns:
            heapq.heappop(wakes)
        return wakes[0][0] if wakes else None

    def _step_the_woken(self) -> None:
        """Step the stations whose time has come."""
        while self._wakes and self._wakes[0][0] <= self.now_ns:
            wake_ns, _, station = heapq.heappop(self._wakes)
            if station.wake_ns == wake_ns:
                station.wake_ns = None
                self._step(station, ())

    def _step(self, station: Station, frames: tuple[Frame, ...]) -> None:
        sent = station.participant.step(self.now_ns, frames)
        if sent:
            self._enqueue(station, sent)
        self._rewake(station)

    def _rewake(self, station: Station) -> None:
        deadline_ns = station.participant.deadline_ns
        if deadline_ns != station.wake_ns:
            station.wake_ns = deadline_ns
            if deadline_ns is not None:
                heapq.heappush(self._wakes, (deadline_ns, next(self._order), station))

    def _station(self, device: SimulatedDevice) -> Station:
        return next(it for it in self._stations if it.participant is device)
