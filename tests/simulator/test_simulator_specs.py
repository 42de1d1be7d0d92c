"""Every device spec of the house, through the simulated device."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from conformance.resources import data, names
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import SpecFile, load_spec
from conformance.spec.model import Entry
from conformance.wire.frame import Frame

Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]

MS = 1_000_000
SPECS = names("device_specs")


def spec_file(name: str) -> SpecFile:
    return load_spec(data("device_specs") / f"{name}.yaml")


def variants() -> Iterator[tuple[str, str]]:
    for name in SPECS:
        for variant in spec_file(name).variants:
            yield name, variant


def readings() -> Iterator[tuple[str, str, int]]:
    for name in SPECS:
        for ambiguity in spec_file(name).document.ambiguities:
            for number, reading in enumerate(ambiguity.readings, 1):
                if reading.changes:
                    yield name, ambiguity.id, number


class Client:
    """Uploads from a device without a bus between."""

    def __init__(self, device: SimulatedDevice) -> None:
        self.device = device
        self.now_ns = 0
        device.power_on(0)
        self.heard = device.step(300 * MS)
        self.now_ns = 300 * MS

    def request(self, data_: bytes) -> bytes:
        self.device.step(self.now_ns, [Frame(0x600 + self.device.node_id, data_)])
        self.now_ns += MS
        answers = self.device.step(self.now_ns)
        return next(f.data for f in answers if f.can_id == 0x580 + self.device.node_id)

    def upload(self, index: int, sub: int) -> bytes:
        multiplexer = index.to_bytes(2, "little") + bytes((sub,))
        answer = self.request(b"\x40" + multiplexer + bytes(4))
        if answer[0] == 0x42:
            return answer[4:]
        if answer[0] & 0xE3 == 0x43:
            return answer[4 : 8 - (answer[0] >> 2 & 3)]
        assert answer[0] == 0x41, answer.hex(" ")
        size = int.from_bytes(answer[4:], "little")
        result = b""
        for toggle in range(1000):
            segment = self.request(bytes((0x60 | (toggle & 1) << 4,)) + bytes(7))
            result += segment[1 : 8 - (segment[0] >> 1 & 7)]
            if segment[0] & 1:
                break
        assert len(result) == size
        return result


@pytest.mark.parametrize(("name", "variant"), list(variants()))
def test_every_readable_entry_gives_its_default(name: str, variant: str) -> None:
    device = SimulatedDevice(spec_file(name), variant=variant, serial_number=1234)
    client = Client(device)
    assert client.heard == [Frame(0x700 + device.node_id, b"\0")]

    def expected(entry: Entry) -> bool:
        return entry.default is not None and entry.type.is_integer and entry.follows is None

    for entry in device.spec.entries.values():
        if entry.readable:
            uploaded = client.upload(entry.index, entry.sub)
            if expected(entry):
                assert entry.type.decode(uploaded) == entry.default, entry.address


@pytest.mark.parametrize(("name", "ambiguity", "number"), list(readings()))
def test_every_reading_makes_a_device_that_answers(name: str, ambiguity: str, number: int) -> None:
    client = Client(SimulatedDevice(spec_file(name), readings={ambiguity: number}))
    assert len(client.upload(0x1000, 0)) == 4


@pytest.mark.parametrize("name", SPECS)
def test_a_hundred_and_twenty_six_nodes_live_on_one_bus(
    open_bus: Callable[..., SimulatorBus], hear: Hear, name: str
) -> None:
    bus = open_bus(",".join(f"{name}@{node_id}" for node_id in range(1, 127)))
    assert hear(bus, 0.5) == [f"{0x700 + node_id:03X}#00" for node_id in range(1, 127)]


def test_the_ims360_follows_the_example_of_its_manual(
    open_bus: Callable[..., SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = open_bus("siko_ims360:two-axis")
    assert hear(bus, 0.3) == ["732#00"]
    for download in (
        "23 01 18 01 B2 02 00 80",
        "2F 01 1A 00 00 00 00 00",
        "23 01 1A 01 10 01 20 30",
        "23 01 1A 02 10 02 20 30",
        "23 01 1A 03 10 03 20 30",
        "2F 01 1A 00 03 00 00 00",
        "23 01 18 01 B2 02 00 00",
        "2B 01 18 05 64 00 00 00",
    ):
        assert ask(bus, download, node=0x32)[:2] == "60"
    tell(bus, "000#0132")
    assert hear(bus, 0.15) == ["2B2#000000000000"] * 2


def test_the_ims360_maps_both_axes_by_default(
    open_bus: Callable[..., SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = open_bus("siko_ims360:two-axis")
    bus.set_tilt(1.0, -1.0)
    hear(bus, 1.0)
    assert ask(bus, "2B 00 18 05 0A 00 00 00", node=0x32)[:2] == "60"
    tell(bus, "000#0132")
    assert hear(bus, 0.005) == ["1B2#640000009CFFFFFF"]


def test_the_ims360_zeroes_and_stores_its_axes(
    open_bus: Callable[..., SimulatorBus], ask: Ask, hear: Hear
) -> None:
    bus = open_bus("siko_ims360:two-axis")
    hear(bus, 0.3)
    assert ask(bus, "2F 00 32 00 03 00 00 00", node=0x32)[:2] == "60"
    assert ask(bus, "40 10 61 00 00 00 00 00", node=0x32) == "43 10 61 00 00 00 00 00"
    assert ask(bus, "40 20 61 00 00 00 00 00", node=0x32) == "43 20 61 00 00 00 00 00"
    assert ask(bus, "40 10 32 00 00 00 00 00", node=0x32) == "43 10 32 00 E6 FB FF FF"
    assert ask(bus, "23 10 10 01 73 61 76 65", node=0x32)[:2] == "60"
    bus.power_off()
    bus.power_on()
    hear(bus, 0.3)
    assert ask(bus, "40 10 61 00 00 00 00 00", node=0x32) == "43 10 61 00 00 00 00 00"


def test_the_ims360_follows_a_reading(open_bus: Callable[..., SimulatorBus], ask: Ask) -> None:
    """The manual calls 1800h:04 reserved and gives it a default; one reading has it read 0."""
    path = "objects/0x1800/subs/4/reserved"
    readings_ = {
        ambiguity.id: number
        for ambiguity in spec_file("siko_ims360").document.ambiguities
        for number, reading in enumerate(ambiguity.readings, 1)
        if path in reading.changes
    }
    bus = open_bus("siko_ims360", readings=readings_)
    bus.recv(0.3)
    assert ask(bus, "40 00 18 04 00 00 00 00", node=0x32) == "4F 00 18 04 00 00 00 00"
