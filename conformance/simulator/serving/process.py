"""Simulated devices where others reach them: a loop, a segment and the lines to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

import can

from conformance.errors import BenchError, first_line
from conformance.simulator.bus import SimulatedBus
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.live_segment import LiveSegment
from conformance.simulator.serving.control import ControlSession
from conformance.simulator.serving.lines import (
    Address,
    BusWire,
    LibraryLine,
    PtyLine,
    Speak,
    TcpServer,
    Write,
)
from conformance.simulator.serving.loop import Loop
from conformance.simulator.serving.slcan import SlcanAdapter
from conformance.simulator.serving.socketcand import HELLO, SocketcandSession
from conformance.wire.frame import Frame


class Process:
    """Simulated devices that live in real time, and the lines to them.

    Args:
        stack: Closes the lines in the end.
        devices: The devices, switched off.
    """

    def __init__(self, stack: ExitStack, devices: Sequence[SimulatedDevice]) -> None:
        self._stack = stack
        self._devices = devices
        self.places: list[str] = []

    def on_library_bus(self, interface: str, channel: str) -> Loop:
        """Put the devices on a python-can bus.

        Raises:
            BenchError: It cannot be opened.
        """
        bitrate = self._devices[0].bitrate
        try:
            bus = can.Bus(channel or None, interface, ignore_config=True, bitrate=bitrate)
        except Exception as error:
            raise BenchError(
                f"cannot open the bus (interface {interface}, channel {channel}): "
                f"{first_line(error)}"
            ) from error

        def send(frame: Frame) -> None:
            line.send(frame)

        def hear(frame: Frame) -> None:
            with loop.present():
                segment.hear(frame)

        segment = LiveSegment(send, bitrate)
        loop = Loop(segment)
        line = LibraryLine(loop, bus, hear)
        self._stack.callback(line.close)
        self.places.append(f"{interface} {channel}".strip())
        self._connect(loop)
        return loop

    def on_own_bus(self, link: Path | None, address: Address | None) -> Loop:
        """Put the devices on a simulated bus, with an slcan adapter and a socketcand server at it.

        Args:
            link: Of the adapter's serial line; no adapter when None.
            address: Of the server; no server when None.

        Raises:
            BenchError: A line cannot be had.
        """
        bus = SimulatedBus(self._devices[0].bitrate)
        loop = Loop(bus)
        if link is not None:
            line = PtyLine(loop, link)
            self._stack.callback(line.close)
            wire = BusWire(loop, bus, line.write)
            line.speaker = wire.speaker = SlcanAdapter(wire)
            self.places.append(f"slcan {link}")
        if address is not None:

            def speak(
                write: Write,
            ) -> tuple[Callable[[bytes], bytes], bytes, Callable[[], None]]:
                wire = BusWire(loop, bus, write, loop.epoch_s)
                wire.speaker = session = SocketcandSession(wire, bus.bitrate)
                return session.feed, HELLO, wire.close

            self._serve(loop, "socketcand", address, speak)
        self._connect(loop)
        return loop

    def controlled(self, loop: Loop, address: Address) -> None:
        """Take power, tilt and faults from others.

        Raises:
            BenchError: The address cannot be listened on.
        """
        self._serve(
            loop, "control", address, lambda _: (ControlSession(loop).feed, b"", lambda: None)
        )

    def _serve(
        self,
        loop: Loop,
        name: str,
        address: Address,
        speak: Speak,
    ) -> None:
        server = TcpServer(loop, address, f"--{name}", speak)
        self._stack.callback(server.close)
        self.places.append(f"{name} {address[0]}:{server.port}")

    def _connect(self, loop: Loop) -> None:
        with loop.present() as segment:
            for device in self._devices:
                segment.add_node(device)
