"""Libraries that drive python-can run on the simulated bus and its virtual clock, in one thread.

A library meets a `can.BusABC` here that sends, and a `can.Notifier` that hands each frame over at
the instant at which it ends on the bus. Nothing of the simulated device is involved: the bus gives
frames their duration and lets identifiers arbitrate, and time goes on to whatever is due next, so
that a run is fast and comes out the same each time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, cast
from unittest import mock

import can
from can.interfaces import BACKENDS

from conformance.simulator.agenda import Agenda
from conformance.simulator.bus import SimulatedBus
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.segment import SECOND
from conformance.simulator.sharing import SharedBus, join, leave
from conformance.wire.frame import Frame

INTERFACE = "independent_node"
"""Name of the python-can interface by which the suite reaches the bus."""


class Station:
    """What the simulated bus asks of a participant, in front of a library."""

    def __init__(self, bitrate: int) -> None:
        self.bitrate = bitrate
        self.agenda = Agenda()
        self.listeners: list[can.Listener] = []
        self._out: list[Frame] = []

    @property
    def deadline_ns(self) -> int | None:
        return self.agenda.now_ns if self._out else self.agenda.deadline_ns

    def power_on(self, now_ns: int) -> None:
        self.agenda.run(now_ns)

    def power_off(self) -> None:
        self.agenda.clear()

    def step(self, now_ns: int, frames: Sequence[Frame]) -> Sequence[Frame]:
        self.agenda.run(now_ns)
        for frame in frames:
            message = can.Message(
                timestamp=now_ns / SECOND,
                arbitration_id=frame.can_id,
                is_extended_id=frame.extended,
                is_remote_frame=frame.remote,
                dlc=frame.dlc,
                data=None if frame.remote else frame.data,
            )
            for listener in self.listeners:
                listener.on_message_received(message)
        sent, self._out = self._out, []
        return sent

    def send(self, message: can.Message) -> None:
        frame = Frame(
            message.arbitration_id,
            bytes(message.data),
            remote=message.is_remote_frame,
            extended=message.is_extended_id,
            dlc=message.dlc,
        )
        self._out.append(frame)


class LibraryBus(can.BusABC):
    """The python-can bus that a library gets."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.channel_info = "simulated bus"
        super().__init__("simulated bus")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 - never blocks
        self.station.send(msg)

    def _send_periodic_internal(
        self,
        msgs: Sequence[can.Message] | can.Message,
        period: float,
        duration: float | None = None,
        autostart: bool = True,
        modifier_callback: Callable[[can.Message], None] | None = None,
    ) -> can.broadcastmanager.CyclicSendTaskABC:
        assert duration is None
        assert autostart
        assert modifier_callback is None
        return Periodic(self.station, msgs, period)


class Periodic(can.broadcastmanager.ModifiableCyclicTaskABC):
    """Sends a message at once and then again and again, as python-can's own threads do."""

    def __init__(
        self, station: Station, messages: Sequence[can.Message] | can.Message, period_s: float
    ) -> None:
        super().__init__(messages, period_s)
        self._station = station
        self._timer = station.agenda.timer(self._fire)
        self._fire(station.agenda.now_ns)

    def _fire(self, due_ns: int) -> None:
        for message in self.messages:
            self._station.send(message)
        self._timer.start(due_ns + self.period_ns)

    def stop(self) -> None:
        self._timer.stop()


class Notifier:
    """Stands in for `can.Notifier`, which has a thread."""

    exception = None

    def __init__(
        self, bus: LibraryBus, listeners: Iterable[can.Listener], *_: Any, **__: Any
    ) -> None:
        self._bus = bus
        self._listeners = list(listeners)
        bus.station.listeners += self._listeners

    def stop(self, timeout: float = 5) -> None:  # noqa: ARG002 - python-can's signature
        for listener in self._listeners:
            self._bus.station.listeners.remove(listener)


@contextmanager
def on_the_bus(station: Station, channel: str) -> Iterator[None]:
    """Let a station be on a simulated bus of this process, for `interface` and `channel` of a bench."""
    bus = SimulatedBus(station.bitrate)

    def build() -> SharedBus:
        return SharedBus(bus, real_time=False)

    shared = join(channel, build)
    BACKENDS[INTERFACE] = ("conformance.simulator.interface", "SimulatorBus")
    try:
        with mock.patch("can.Notifier", Notifier):
            # The bus asks its nodes for bit rate, deadline, step and power, which a station has.
            bus.add_node(cast("SimulatedDevice", station))
            yield
    finally:
        leave(channel, shared)
