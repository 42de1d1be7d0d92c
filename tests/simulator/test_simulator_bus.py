from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conformance.simulator.bus import SimulatedBus
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.faults import Faults
from conformance.spec.load import load_spec
from conformance.wire.frame import Frame, bit_length, priority

INVENTED = Path(__file__).parent / "invented.yaml"
Heard = list[tuple[int, str]]


def listener(bus: SimulatedBus, bitrate: int | None = None) -> tuple[Heard, Callable[[str], None]]:
    """Return what a new client hears, and a function that sends an empty frame for it."""
    heard: Heard = []

    def deliver(end_ns: int, frame: Frame, own: bool) -> None:
        if not own:
            heard.append((end_ns, f"{frame.can_id:03X}"))

    client = bus.connect(deliver, bitrate)
    return heard, lambda name: bus.send(client, Frame(int(name, 16)))


def test_a_frame_takes_its_bits_and_is_heard_at_its_end() -> None:
    bus = SimulatedBus(500_000)
    heard, _ = listener(bus)
    _, send = listener(bus)
    send("2AA")
    bus.run_until(10**9)
    assert heard == [(bit_length(Frame(0x2AA)) * 2000, "2AA")]
    assert bus.now_ns == 10**9


def test_the_lowest_identifier_wins_when_the_bus_becomes_idle() -> None:
    bus = SimulatedBus(125_000)
    heard, _ = listener(bus)
    senders = [listener(bus)[1] for _ in range(3)]
    senders[0]("300")
    bus.advance(0)
    senders[1]("200")
    senders[2]("100")
    senders[0]("080")
    bus.run_until(10**9)
    assert [name for _, name in heard] == ["300", "080", "100", "200"]


def test_a_participant_sends_its_frames_in_their_order() -> None:
    bus = SimulatedBus(125_000)
    heard, _ = listener(bus)
    _, one = listener(bus)
    _, other = listener(bus)
    for name in ("700", "001"):
        one(name)
    other("400")
    bus.run_until(10**9)
    assert [name for _, name in heard] == ["400", "700", "001"]


def test_frames_follow_each_other_without_a_gap() -> None:
    bus = SimulatedBus(125_000)
    heard, _ = listener(bus)
    _, send = listener(bus)
    for _ in range(3):
        send("155")
    bus.run_until(10**9)
    frame_ns = bit_length(Frame(0x155)) * 8000
    assert [end_ns for end_ns, _ in heard] == [frame_ns, 2 * frame_ns, 3 * frame_ns]


def test_arbitration_prefers_data_to_remote_and_short_to_long_identifiers() -> None:
    ordered = [
        Frame(0x100),
        Frame(0x100, remote=True),
        Frame(0x100 << 18, extended=True),
        Frame((0x100 << 18) + 1, extended=True),
        Frame(0x101),
    ]
    assert sorted({*ordered}, key=priority) == ordered


def test_only_participants_with_the_same_bit_rate_hear_each_other() -> None:
    bus = SimulatedBus(125_000)
    slow, send = listener(bus)
    same, _ = listener(bus)
    fast, _ = listener(bus, 250_000)
    send("155")
    bus.run_until(10**9)
    assert len(same) == 1
    assert slow == fast == []


def test_the_load_is_that_of_the_last_second() -> None:
    bus = SimulatedBus(125_000)
    _, send = listener(bus)
    assert bus.load() == 0
    for _ in range(1000):
        send("155")
    bus.run_until(10**8)
    assert bus.load() == pytest.approx(1.0, abs=0.01)
    bus.run_until(10**9)
    busy_ns = 1000 * bit_length(Frame(0x155)) * 8000
    assert bus.load() == pytest.approx(busy_ns / 10**9)
    assert bus.frame_count == 1000
    bus.run_until(3 * 10**9)
    assert bus.load() == 0


def test_several_nodes_boot_in_the_order_of_their_identifiers() -> None:
    spec = load_spec(INVENTED)
    bus = SimulatedBus(250_000)
    heard, _ = listener(bus)
    for node_id in (9, 3, 5):
        bus.add_node(SimulatedDevice(spec, node_id=node_id))
    bus.run_until(10**9)
    assert [name for _, name in heard] == ["703", "705", "709"]


def test_a_node_that_is_off_neither_hears_nor_sends() -> None:
    bus = SimulatedBus(250_000)
    heard, send = listener(bus)
    device = SimulatedDevice(load_spec(INVENTED))
    bus.add_node(device)
    bus.run_until(10**8)
    bus.power_off(device)
    assert not device.powered
    send("000")
    bus.run_until(10**9)
    assert heard == []
    bus.power_on(device)
    bus.run_until(2 * 10**9)
    assert [name for _, name in heard] == ["70A"]


def test_the_same_seed_gives_the_same_frames(open_trace: Callable[[int], Heard]) -> None:
    assert open_trace(1) == open_trace(1)
    assert open_trace(1) != open_trace(2)


@pytest.fixture
def open_trace() -> Callable[[int], Heard]:
    """Returns what a device that sends garbage sends with a seed."""

    def trace(seed: int) -> Heard:
        bus = SimulatedBus(250_000)
        heard, send = listener(bus)
        bus.add_node(SimulatedDevice(load_spec(INVENTED), faults=Faults(garbage=True), seed=seed))
        bus.run_until(10**9)
        for _ in range(5):
            send("60A")
        bus.run_until(2 * 10**9)
        return heard

    return trace
