from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from pathlib import Path

import can
import canopen
import pytest
from canopen.objectdictionary import ODRecord, ODVariable
from canopen.objectdictionary.datatypes import INTEGER16, UNSIGNED8, UNSIGNED16, UNSIGNED32

from conformance.errors import SpecError
from conformance.simulator.channel import NodeName, parse_channel
from conformance.simulator.interface import SimulatorBus

Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]
Open = Callable[..., SimulatorBus]


def test_waiting_takes_simulated_time_only(open_bus: Open) -> None:
    bus = open_bus()
    bus.recv(1)
    began = time.monotonic()
    assert bus.recv(3600) is None
    assert time.monotonic() - began < 1
    assert bus.now() == pytest.approx(3600.2, abs=0.001)


def test_a_timeout_of_zero_takes_no_time(bus: SimulatorBus, tell: Tell) -> None:
    start = bus.now()
    tell(bus, "60A#4000100000000000")
    assert bus.recv(0) is None
    assert bus.recv(-1) is None
    assert bus.now() == start
    assert bus.recv(0.1) is not None


def test_sending_takes_no_time(bus: SimulatorBus, tell: Tell) -> None:
    start, count = bus.now(), bus.frame_count
    tell(bus, *["60A#4000100000000000"] * 100)
    assert (bus.now(), bus.frame_count) == (start, count)


def test_a_message_tells_all_that_python_can_knows(open_bus: Open) -> None:
    bus = open_bus()
    message = bus.recv(1)
    assert message is not None
    assert message.channel == bus.channel
    assert (message.is_rx, message.is_extended_id, message.is_remote_frame) == (True, False, False)
    assert message.dlc == 1
    assert message.timestamp == pytest.approx(bus.now())


def test_own_messages_come_back_when_asked_for(open_bus: Open, tell: Tell) -> None:
    bus = open_bus(receive_own_messages="true")
    bus.recv(0.5)
    tell(bus, "123#R")
    message = bus.recv(0.1)
    assert message is not None
    assert (message.arbitration_id, message.is_rx, message.is_remote_frame) == (0x123, False, True)


def test_filters_hide_frames_without_ending_the_wait(open_bus: Open, tell: Tell) -> None:
    bus = open_bus(can_filters=[{"can_id": 0x58A, "can_mask": 0x7FF, "extended": False}])
    tell(bus, "000#810A")
    assert bus.recv(1.0) is None
    assert bus.now() == pytest.approx(1.0)
    tell(bus, "60A#4000100000000000")
    assert bus.recv(1.0) is not None


def test_two_objects_with_one_channel_share_the_bus(open_bus: Open, tell: Tell, hear: Hear) -> None:
    first, second = open_bus(), open_bus()
    assert hear(first, 0.3) == ["70A#00"]
    assert hear(second, 0.001) == ["70A#00"]
    tell(first, "123#01")
    assert hear(second, 0.1) == ["123#01"]
    assert hear(first, 0.1) == []


def test_the_bus_ends_with_its_last_object(open_bus: Open, hear: Hear) -> None:
    first = open_bus()
    hear(first, 5.0)
    second = open_bus()
    assert second.now() == pytest.approx(5.0)
    first.shutdown()
    assert second.now() == pytest.approx(5.0)
    second.shutdown()
    assert open_bus().now() == 0.0


def test_a_frame_handed_over_is_sent_though_its_sender_leaves(
    open_bus: Open, tell: Tell, hear: Hear
) -> None:
    first, second = open_bus(), open_bus()
    tell(first, "123#01", "124#01")
    first.shutdown()
    assert hear(second, 0.1) == ["123#01", "124#01"]


def test_frames_handed_over_can_be_flushed(open_bus: Open, tell: Tell, hear: Hear) -> None:
    first, second = open_bus(), open_bus()
    tell(first, "123#01", "124#01")
    first.flush_tx_buffer()
    first.flush_tx_buffer()
    assert hear(second, 0.1) == []


def test_nothing_works_after_shutdown(open_bus: Open) -> None:
    bus = open_bus()
    bus.shutdown()
    bus.shutdown()
    for act in (
        lambda: bus.send(can.Message(arbitration_id=1, is_extended_id=False)),
        lambda: bus.recv(0.1),
        bus.now,
    ):
        with pytest.raises(can.CanOperationError, match="shut down"):
            act()


@pytest.mark.parametrize(
    "message",
    [
        can.Message(arbitration_id=0x800, is_extended_id=False),
        can.Message(arbitration_id=1, is_fd=True, data=bytes(12)),
        can.Message(arbitration_id=1, is_error_frame=True),
    ],
)
def test_a_frame_that_can_is_not_able_to_carry_is_refused(
    bus: SimulatorBus, message: can.Message
) -> None:
    with pytest.raises(can.CanOperationError):
        bus.send(message)


def test_several_nodes_stand_in_the_channel_name(
    invented: str, open_bus: Open, hear: Hear, ask: Ask
) -> None:
    bus = open_bus(f"{invented}:one@3, {invented}@0x04,{invented}", serial_number="100")
    assert hear(bus, 0.3) == ["703#00", "704#00", "70A#00"]
    assert ask(bus, "40 00 10 00 00 00 00 00", node=3) == "43 00 10 00 9A 01 03 00"
    assert ask(bus, "40 00 10 00 00 00 00 00", node=4) == "43 00 10 00 9A 01 04 00"
    assert ask(bus, "40 18 10 04 00 00 00 00", node=4) == "43 18 10 04 65 00 00 00"


def test_options_may_be_text_as_from_a_configuration_file(
    open_bus: Open, ask: Ask, hear: Hear
) -> None:
    bus = open_bus(
        variant="one",
        node_id="5",
        bitrate="250000",
        readings="INV-06=2, INV-04=2",
        faults="boot-up-twice,tpdo-short",
        seed="7",
    )
    assert hear(bus, 0.3) == ["705#00", "705#00"]
    assert ask(bus, "40 00 10 00 00 00 00 00", node=5) == "43 00 10 00 9A 01 03 00"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"channel": "no_such_device"}, "no_such_device"),
        ({"channel": ""}, "expected NAME"),
        ({"channel": "a@b"}, "expected a number, got 'b'"),
        ({"variant": "three"}, "expected one of two, one"),
        ({"node_id": 128}, "expected 1 to 127, got 128"),
        ({"node_id": "ten"}, "expected a number, got 'ten'"),
        ({"bitrate": "fast"}, "expected a number, got 'fast'"),
        ({"readings": "INV-99=1"}, "INV-99"),
        ({"readings": "INV-01"}, "expected ID=NUMBER"),
        ({"faults": ["no-such-fault"]}, "no-such-fault"),
        ({"clock": "sundial"}, "expected virtual or real, got 'sundial'"),
        ({"varaint": "one"}, "varaint"),
    ],
)
def test_a_mistake_in_an_option_is_told_in_one_sentence(
    open_bus: Open, options: dict[str, object], message: str
) -> None:
    with pytest.raises(SpecError, match=message) as caught:
        open_bus(**options)
    assert "\n" not in str(caught.value)
    assert open_bus().now() == 0.0, "no half-built bus is left behind"


def test_one_node_id_cannot_be_for_several_nodes(invented: str, open_bus: Open) -> None:
    with pytest.raises(SpecError, match="behind each name"):
        open_bus(f"{invented}@3,{invented}", node_id=5)


def test_a_path_of_windows_keeps_its_colon() -> None:
    assert parse_channel(r"C:\specs\x.yaml:one@3") == [NodeName(r"C:\specs\x.yaml", "one", 3)]
    assert parse_channel(r"C:\specs\x.yaml") == [NodeName(r"C:\specs\x.yaml")]


def test_the_rig_moves_the_sensor_and_counts_the_frames(bus: SimulatorBus, ask: Ask) -> None:
    bus.set_tilt(12.34, -56.78)
    bus.set_temperature(-20)
    bus.set_supply_voltage(12.5)
    count = bus.frame_count
    assert ask(bus, "40 10 60 00 00 00 00 00") == "4B 10 60 00 D2 04 00 00"
    assert ask(bus, "40 20 60 00 00 00 00 00") == "4B 20 60 00 D2 E9 00 00"
    assert ask(bus, "40 22 20 00 00 00 00 00") == "4F 22 20 00 EC 00 00 00"
    assert ask(bus, "40 20 20 00 00 00 00 00") == "4B 20 20 00 D4 30 00 00"
    assert bus.frame_count == count + 8
    assert 0 < bus.bus_load() < 0.05


def test_a_thread_that_waits_for_ever_is_woken_by_another_that_sends(
    bus: SimulatorBus, tell: Tell
) -> None:
    found: list[can.Message | None] = []
    thread = threading.Thread(target=lambda: found.append(bus.recv(None)))
    thread.start()
    time.sleep(0.02)
    assert not found
    tell(bus, "60A#4000100000000000")
    thread.join(5)
    assert found[0] is not None
    assert found[0].arbitration_id == 0x58A


def test_shutdown_ends_the_wait_of_another_thread(bus: SimulatorBus) -> None:
    errors: list[Exception] = []

    def wait() -> None:
        try:
            bus.recv(None)
        except can.CanOperationError as error:
            errors.append(error)

    thread = threading.Thread(target=wait)
    thread.start()
    time.sleep(0.02)
    bus.shutdown()
    thread.join(5)
    assert len(errors) == 1


def test_the_real_clock_takes_real_time(open_bus: Open, ask: Ask) -> None:
    began = time.monotonic()
    bus = open_bus(clock="real")
    message = bus.recv(2.0)
    assert time.monotonic() - began == pytest.approx(0.2, abs=0.15)
    assert message is not None
    assert message.timestamp == pytest.approx(0.2, abs=0.001), "simulated time is exact"
    assert bus.recv(0.05) is None
    assert ask(bus, "40 00 10 00 00 00 00 00") == "43 00 10 00 9A 01 04 00"
    assert bus.now() == pytest.approx(time.monotonic() - began, abs=0.15)


def test_what_was_sent_on_the_real_clock_is_not_late_when_received_late(
    open_bus: Open, tell: Tell
) -> None:
    bus = open_bus(clock="real")
    bus.recv(1.0)
    sent = bus.now()
    tell(bus, "60A#4000100000000000")
    time.sleep(0.1)
    message = bus.recv(1.0)
    assert message is not None
    assert message.timestamp - sent < 0.05


def dictionary() -> canopen.ObjectDictionary:
    """Return the part of the invented device that python-canopen needs for these tests."""
    result = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]  # canopen lacks the annotation
    result.node_id = 0x0A

    def variable(name: str, index: int, sub: int, kind: int) -> ODVariable:
        entry = ODVariable(name, index, sub)
        entry.data_type = kind
        entry.pdo_mappable = True
        return entry

    for name, index, kind in (
        ("Device type", 0x1000, UNSIGNED32),
        ("Heartbeat", 0x1017, UNSIGNED16),
        ("Device name", 0x1008, 0x9),
        ("Note", 0x2003, 0x9),
        ("Tilt X", 0x6010, INTEGER16),
        ("Tilt Y", 0x6020, INTEGER16),
    ):
        result.add_object(variable(name, index, 0, kind))
    for index, kinds in (
        (0x1800, (UNSIGNED8, UNSIGNED32, UNSIGNED8, UNSIGNED16, UNSIGNED8, UNSIGNED16)),
        (0x1A00, (UNSIGNED8, UNSIGNED32, UNSIGNED32, UNSIGNED32, UNSIGNED32)),
    ):
        record = ODRecord(f"Record {index:X}", index)
        for sub, kind in enumerate(kinds):
            record.add_member(variable(f"Entry {sub}", index, sub, kind))
        result.add_object(record)
    return result


@pytest.mark.parametrize("clock", ["virtual", "real"])
def test_python_canopen_works_with_its_notifier_thread(open_bus: Open, clock: str) -> None:
    bus = open_bus(clock=clock)
    network = canopen.Network(bus)
    node = canopen.RemoteNode(0x0A, dictionary())
    network.add_node(node)
    waiter = threading.Thread(target=node.nmt.wait_for_bootup, args=(5,))
    waiter.start()
    time.sleep(0.1)  # it must wait before time passes: simulated time does not wait for it
    network.connect()
    try:
        waiter.join(5)
        assert node.nmt.state == "PRE-OPERATIONAL"
        assert node.sdo[0x1000].raw == 0x0004019A
        assert node.sdo[0x1008].raw == "TILTY-2000X"
        node.sdo[0x2003].raw = "a note of 18 bytes"
        assert node.sdo[0x2003].raw == "a note of 18 bytes"
        with pytest.raises(canopen.SdoAbortedError, match="0x06010002"):
            node.sdo[0x1000].raw = 1
        node.tpdo.read()  # type: ignore[no-untyped-call]  # canopen lacks the annotation
        node.tpdo[1].event_timer = 10
        node.tpdo[1].save()
        node.nmt.state = "OPERATIONAL"
        assert node.tpdo[1].wait_for_reception(5) is not None
        assert (node.tpdo[1]["Tilt X"].raw, node.tpdo[1]["Tilt Y"].raw) == (1050, -425)
        for _ in range(200):
            assert node.sdo[0x1000].raw == 0x0004019A
    finally:
        network.disconnect()


def test_the_plug_in_is_found_by_name() -> None:
    assert "canopen_simulator" in can.interfaces.VALID_INTERFACES


def test_no_device_is_named_in_the_code(invented: str) -> None:
    root = Path(invented).parents[2]
    specs = [path.stem for path in (root / "device_specs").glob("*.yaml")]
    names = {part for spec in specs for part in spec.split(".")[0].split("_")}
    for module in (root / "conformance" / "simulator").glob("*.py"):
        words = set(re.findall(r"[a-z0-9]+", module.read_text(encoding="utf-8").lower()))
        assert not names & words, module


def test_the_virtual_clock_is_fast(bus: SimulatorBus) -> None:
    message = can.Message(
        arbitration_id=0x60A, is_extended_id=False, data=bytes.fromhex("4000100000000000")
    )
    count = 5000
    began = time.perf_counter()
    for _ in range(count):
        bus.send(message)
        assert bus.recv(0.1) is not None
    assert count / (time.perf_counter() - began) > 3000, "some 40,000 on a machine with time"
