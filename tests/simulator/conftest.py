"""Frames written by hand: ``60A#4000100000000000``, and ``18A#R`` for a remote frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import pytest

from conformance.simulator.device import SimulatedDevice
from conformance.simulator.faults import Faults
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import load_spec

INVENTED = Path(__file__).parent / "invented.yaml"
NODE = 0x0A


def to_message(text: str) -> can.Message:
    name, _, data = text.replace(" ", "").partition("#")
    return can.Message(
        arbitration_id=int(name, 16),
        is_extended_id=len(name) > 3,
        is_remote_frame=data == "R",
        data=b"" if data == "R" else bytes.fromhex(data),
    )


def to_text(message: can.Message) -> str:
    data = "R" if message.is_remote_frame else bytes(message.data).hex().upper()
    width = 8 if message.is_extended_id else 3
    return f"{message.arbitration_id:0{width}X}#{data}"


@pytest.fixture
def invented() -> str:
    """The channel name of the invented device."""
    return str(INVENTED)


@pytest.fixture
def open_bus() -> Iterator[Callable[..., SimulatorBus]]:
    opened: list[can.BusABC] = []

    def open_it(channel: str = str(INVENTED), **options: Any) -> SimulatorBus:
        bus = can.Bus(interface="canopen_simulator", channel=channel, ignore_config=True, **options)
        assert isinstance(bus, SimulatorBus)
        opened.append(bus)
        return bus

    yield open_it
    for bus in opened:
        bus.shutdown()


@pytest.fixture
def bus(open_bus: Callable[..., SimulatorBus]) -> SimulatorBus:
    """The invented device, just booted."""
    return booted(open_bus())


@pytest.fixture
def with_faults(open_bus: Callable[..., SimulatorBus]) -> Callable[..., SimulatorBus]:
    """Opens the invented device with faults, booted."""
    return lambda *names, **options: booted(open_bus(faults=names, **options))


@pytest.fixture
def with_reading(open_bus: Callable[..., SimulatorBus]) -> Callable[[str], SimulatorBus]:
    """Opens the invented device that follows a reading, booted."""
    return lambda reading: booted(open_bus(readings=reading))


def booted(bus: SimulatorBus) -> SimulatorBus:
    bus.recv(0.5)
    return bus


@pytest.fixture
def tell() -> Callable[..., None]:
    """Sends frames."""

    def send(bus: SimulatorBus, *frames: str) -> None:
        for frame in frames:
            bus.send(to_message(frame))

    return send


@pytest.fixture
def hear() -> Callable[[SimulatorBus, float], list[str]]:
    """Returns every frame of so many seconds."""

    def listen(bus: SimulatorBus, seconds: float) -> list[str]:
        end = bus.now() + seconds
        frames = []
        while (left := end - bus.now()) > 1e-9:
            message = bus.recv(left)
            if message is not None:
                frames.append(to_text(message))
        return frames

    return listen


@pytest.fixture
def times() -> Callable[[SimulatorBus, float, str], list[int]]:
    """Returns when in ns the frames with a CAN-ID end, over so many seconds."""

    def listen(bus: SimulatorBus, seconds: float, name: str) -> list[int]:
        end = bus.now() + seconds
        found = []
        while (left := end - bus.now()) > 1e-9:
            message = bus.recv(left)
            if message is not None and message.arbitration_id == int(name, 16):
                found.append(round(message.timestamp * 1e9))
        return found

    return listen


@pytest.fixture
def ask() -> Callable[..., str]:
    """Sends an SDO request and returns the answer's data, or ``silence`` after 0.1 s."""

    def request(bus: SimulatorBus, data: str, node: int = NODE) -> str:
        bus.send(to_message(f"{0x600 + node:03X}#{data}"))
        end = bus.now() + 0.1
        while (left := end - bus.now()) > 1e-9:
            message = bus.recv(left)
            if message is not None and message.arbitration_id == 0x580 + node:
                return bytes(message.data).hex(" ").upper()
        return "silence"

    return request


@pytest.fixture
def make_device() -> Callable[..., SimulatedDevice]:
    """Builds the invented device without a bus, switched on at 0 and booted."""

    def make(faults: Faults | None = None) -> SimulatedDevice:
        device = SimulatedDevice(load_spec(INVENTED), faults=faults)
        device.power_on(0)
        device.step(200_000_000)
        return device

    return make
