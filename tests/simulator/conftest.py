"""Frames written by hand: ``60A#4000100000000000``, and ``18A#R`` for a remote frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import can
import pytest

from conformance.simulator.device import SimulatedDevice
from conformance.simulator.faults import Faults
from conformance.simulator.interface import SimulatorBus
from conformance.spec.fields import key_of
from conformance.spec.load import load_spec
from conformance.spec.model import Entry
from conformance.wire import cob_id, sdo
from conformance.wire.datatypes import Value
from conformance.wire.frame import Frame

INVENTED = Path(__file__).parent / "invented.yaml"
SPECS = Path(__file__).parents[2] / "device_specs"
NODE = 0x0A
MS = 1_000_000

Address: TypeAlias = int | str
"""``0x6010`` or ``"0x1800:5"``."""


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


class Wired:
    """A simulated device and its master, sans-IO: every frame arrives at once.

    What fails is told in words: an SDO abort as ``abort 06090030h``, no answer as ``silence``.
    """

    def __init__(self, device: SimulatedDevice) -> None:
        self.device = device
        self.now_ns = 0
        self.heard: list[tuple[int, Frame]] = []
        device.power_on(0)
        self.run(0.3)

    def run(self, seconds: float, *frames: str) -> list[str]:
        """Send frames and return those of the next seconds."""
        before = len(self.heard)
        sent = [to_frame(frame) for frame in frames]
        self._hear(self.device.step(self.now_ns, sent))
        end_ns = self.now_ns + round(seconds * 1000) * MS
        while (due_ns := self.device.deadline_ns) is not None and due_ns <= end_ns:
            self.now_ns = due_ns
            self._hear(self.device.step(due_ns))
        self.now_ns = end_ns
        self._hear(self.device.step(end_ns))
        return [from_frame(frame) for _, frame in self.heard[before:]]

    def _hear(self, frames: list[Frame]) -> None:
        self.heard += [(self.now_ns, frame) for frame in frames]

    def periods_ms(self, seconds: float, name: str) -> list[float]:
        """Return the different times between the frames with a CAN-ID over so many seconds."""
        before = len(self.heard)
        self.run(seconds)
        seen = [at for at, frame in self.heard[before:] if frame.can_id == int(name, 16)]
        gaps = {(b - a) / MS for a, b in pairwise(seen)}
        return sorted(gaps)

    def ask(self, data: str | bytes) -> str:
        """Send the data of an SDO request and return those of the answer."""
        data = bytes.fromhex(data) if isinstance(data, str) else data
        before, node_id = len(self.heard), self.device.node_id
        self.run(0.001, f"{cob_id.sdo_request(node_id):03X}#{data.hex()}")
        answers = [
            frame.data
            for _, frame in self.heard[before:]
            if frame.can_id == cob_id.sdo_response(node_id)
        ]
        return answers[0].hex(" ").upper() if answers else "silence"

    def _asked(self, request: sdo.Request) -> sdo.Response | str:
        answer = self.ask(sdo.encode(request))
        if answer == "silence":
            return answer
        response = sdo.decode_response(bytes.fromhex(answer))
        return f"abort {response.code:08X}h" if isinstance(response, sdo.Abort) else response

    def _entry(self, address: Address) -> Entry:
        return self.device.spec.entries[key_of(address)]

    def read(self, address: Address) -> Value:
        """Return what an entry of up to four octets holds."""
        entry = self._entry(address)
        answer = self._asked(sdo.InitiateUpload(*entry.key))
        if not isinstance(answer, sdo.InitiateUploadReply):
            return str(answer)
        return entry.type.decode(answer.data)

    def write(self, address: Address, value: int) -> str:
        """Write an entry; return ``ok`` or how it was refused."""
        entry = self._entry(address)
        answer = self._asked(sdo.InitiateDownload(*entry.key, entry.type.encode(value)))
        return "ok" if isinstance(answer, sdo.InitiateDownloadAck) else str(answer)

    def set(self, **values: int) -> None:
        """Write entries that must accept it: ``set(x6000=10, x1800_5=20)``."""
        for name, value in values.items():
            address = "0" + name.replace("_", ":")
            assert self.write(address, value) == "ok", f"{address} = {value}"

    def save(self, sub: int = 1, *, wait_s: float = 0.7) -> None:
        """Store the parameters and give the node the time for it."""
        self._sign(f"23 10 10 {sub:02X} 73 61 76 65", wait_s)

    def load(self, sub: int = 1, *, wait_s: float = 0.7) -> None:
        """Restore the parameters and give the node the time for it."""
        self._sign(f"23 11 10 {sub:02X} 6C 6F 61 64", wait_s)

    def _sign(self, request: str, wait_s: float) -> None:
        assert self.ask(request).startswith("60")
        self.run(wait_s)

    def nmt(self, command: int, seconds: float = 0.0) -> list[str]:
        """Command the node and return the frames of the next seconds."""
        return self.run(seconds, f"000#{command:02X}{self.device.node_id:02X}")

    def reset(self, how: str = "reset node") -> list[str]:
        """Start the node anew and return the frames of the next 0.3 s."""
        if how == "power cycle":
            self.device.power_off()
            self.device.power_on(self.now_ns)
            return self.run(0.3)
        return self.nmt({"reset node": 0x81, "reset communication": 0x82}[how], 0.3)

    def save_and_reset(self, how: str = "reset node") -> list[str]:
        self.save()
        return self.reset(how)

    def state(self) -> str:
        """Return the NMT state that the next heartbeats tell."""
        period, name = self._heartbeat(), f"{cob_id.heartbeat(self.device.node_id):03X}#"
        seen = [frame for frame in self.run(0.11) if frame.startswith(name)]
        self._heartbeat(period)
        states = {"04": "stopped", "05": "operational", "7F": "pre-operational"}
        return states[seen[-1][-2:]]

    def _heartbeat(self, period: int = 100) -> int:
        """Set the heartbeat time and return what it was; from inside, for Stopped has no SDO."""
        assert self.device._firmware is not None
        dictionary = self.device._firmware.node.dictionary
        before = dictionary.number(0x1017)
        dictionary.set((0x1017, 0), period)
        return before

    def tilt(self, x_deg: float, y_deg: float = 0.0, seconds: float = 0.01) -> list[str]:
        """Tilt the sensor and return the frames of the next seconds."""
        self.device.world.tilt_x_deg, self.device.world.tilt_y_deg = x_deg, y_deg
        self.device.world_changed()
        return self.run(seconds)

    def fail(self, code: int, bit: int | None = None, seconds: float = 0.0) -> list[str]:
        """Let an error occur and return the frames of the next seconds."""
        self.device.raise_error(code, bit)
        return self.run(seconds)

    def recover(self, code: int, bit: int | None = None, seconds: float = 0.0) -> list[str]:
        """Let an error go and return the frames of the next seconds."""
        self.device.clear_error(code, bit)
        return self.run(seconds)


def to_frame(text: str) -> Frame:
    name, _, data = text.partition("#")
    return Frame(int(name, 16), bytes.fromhex(data))


def from_frame(frame: Frame) -> str:
    return f"{frame.can_id:03X}#{frame.data.hex().upper()}"


@pytest.fixture(scope="session")
def wire() -> Callable[..., Wired]:
    """Builds a documented device, switched on and booted: name, variant, and readings by id."""

    def build(name: str, variant: str | None = None, **options: Any) -> Wired:
        path = Path(name) if name.endswith(".yaml") else SPECS / f"{name}.yaml"
        return Wired(SimulatedDevice(load_spec(path), variant=variant, **options))

    return build


@pytest.fixture(scope="session")
def gim(wire: Callable[..., Wired]) -> Callable[..., Wired]:
    """Builds a GIM140R of two axes that follows readings: ``gim({"GIM-45": 2})``."""
    return lambda readings=None, **options: wire(
        "baumer_gim140r",
        **{"variant": "two-dimensional", "readings": readings, **options},
    )


@pytest.fixture(scope="session")
def dst(wire: Callable[..., Wired]) -> Callable[..., Wired]:
    """Builds a DST X730 XY-45 that follows readings."""
    return lambda readings=None, **options: wire(
        "danfoss_dst_x730", **{"variant": "xy-45", "readings": readings, **options}
    )


@pytest.fixture(scope="session")
def ims(wire: Callable[..., Wired]) -> Callable[..., Wired]:
    """Builds an IMS360 of two axes that follows readings."""
    return lambda readings=None, **options: wire(
        "siko_ims360", **{"variant": "two-axis", "readings": readings, **options}
    )


def _is_of_a_rule(path: str) -> bool:
    part, *_, attribute = path.split("/")
    rules = ("effective", "otherwise", "after_node_id_change", "writable_while", "conflict")
    return part in ("services", "behaviours") or attribute in rules


@pytest.fixture(scope="session")
def rule_readings() -> Callable[[str], set[tuple[str, int]]]:
    """Returns the readings of a spec that change a service or a rule between objects."""

    def find(name: str) -> set[tuple[str, int]]:
        return {
            (ambiguity.id, number)
            for ambiguity in load_spec(SPECS / f"{name}.yaml").document.ambiguities
            for number, reading in enumerate(ambiguity.readings, start=1)
            if any(_is_of_a_rule(path) for path in reading.changes)
        }

    return find
