from __future__ import annotations

from collections.abc import Callable

import pytest

from conformance.simulator.interface import SimulatorBus

Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]

TILT_X, TILT_Y, HEADING = "40 10 60 00", "40 20 60 00", "40 11 61 00"


def number(bus: SimulatorBus, ask: Ask, request: str, bits: int = 16) -> int:
    data = bytes.fromhex(ask(bus, f"{request} 00 00 00 00"))
    return int.from_bytes(data[4 : 4 + bits // 8], "little", signed=True)


def test_a_measured_value_is_in_the_scale_of_its_entry(bus: SimulatorBus, ask: Ask) -> None:
    bus.set_tilt(0.0, 60.0)
    assert number(bus, ask, TILT_Y) == 6000
    assert number(bus, ask, "40 21 20 00") == 500, "cosine of 60 degrees in thousandths of g"


@pytest.mark.parametrize(("tilt", "shown"), [(120.0, 9000), (-120.0, -9000)])
def test_a_value_beyond_the_range_is_shown_as_its_end(
    bus: SimulatorBus, ask: Ask, tilt: float, shown: int
) -> None:
    bus.set_tilt(tilt, 0.0)
    assert number(bus, ask, TILT_X) == shown


@pytest.mark.parametrize(("tilt", "shown"), [(-0.01, 35999), (360.0, 0), (725.5, 550)])
def test_a_range_of_a_whole_turn_wraps(
    bus: SimulatorBus, ask: Ask, tilt: float, shown: int
) -> None:
    bus.set_tilt(tilt, 0.0)
    assert number(bus, ask, HEADING, 32) == shown


def test_a_temperature_beyond_its_type_is_clipped(bus: SimulatorBus, ask: Ask) -> None:
    bus.set_temperature(200)
    assert number(bus, ask, "40 22 20 00", 8) == 127


@pytest.mark.parametrize(("command", "x", "y"), [("01", 0, -425), ("02", 1050, 0), ("03", 0, 0)])
def test_a_zero_command_makes_its_axes_zero(
    bus: SimulatorBus, ask: Ask, command: str, x: int, y: int
) -> None:
    assert ask(bus, f"2F 11 20 00 {command} 00 00 00") == "60 11 20 00 00 00 00 00"
    assert (number(bus, ask, TILT_X), number(bus, ask, TILT_Y)) == (x, y)
    bus.set_tilt(11.5, -3.25)
    assert (number(bus, ask, TILT_X), number(bus, ask, TILT_Y)) == (
        100 if x == 0 else 1150,
        100 if y == 0 else -325,
    )


def test_the_offset_is_a_setting_that_can_be_read_written_and_stored(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    ask(bus, "2F 11 20 00 01 00 00 00")
    assert number(bus, ask, "40 12 20 00") == -1050
    ask(bus, "2B 12 20 00 64 00 00 00")
    assert number(bus, ask, TILT_X) == 1150
    ask(bus, "23 10 10 01 73 61 76 65")
    tell(bus, "000#810A")
    hear(bus, 0.3)
    assert number(bus, ask, TILT_X) == 1150


def test_an_offset_without_an_object_is_gone_after_a_reset(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    ask(bus, "2F 11 20 00 02 00 00 00")
    tell(bus, "000#810A")
    hear(bus, 0.3)
    assert number(bus, ask, TILT_Y) == -425


def test_an_undocumented_zero_command_is_refused(bus: SimulatorBus, ask: Ask) -> None:
    assert ask(bus, "2F 11 20 00 04 00 00 00") == "80 11 20 00 30 00 09 06"


def test_the_serial_number_is_the_same_as_number_and_as_text(
    open_bus: Callable[..., SimulatorBus], ask: Ask, hear: Hear
) -> None:
    bus = open_bus(serial_number=4711)
    hear(bus, 0.3)
    assert ask(bus, "40 18 10 04 00 00 00 00") == "43 18 10 04 67 12 00 00"
    assert ask(bus, "40 23 20 00 00 00 00 00") == "41 23 20 00 08 00 00 00"
    assert ask(bus, "60 00 00 00 00 00 00 00") == "00 30 30 30 30 34 37 31"
    assert ask(bus, "70 00 00 00 00 00 00 00") == "1D 31 00 00 00 00 00 00"


def test_a_boot_without_an_error_sends_no_emcy(
    open_bus: Callable[..., SimulatorBus], hear: Hear
) -> None:
    assert hear(open_bus(), 1.0) == ["70A#00"]


def test_an_axis_beyond_its_range_sends_an_emcy_once_and_another_when_it_is_back(
    bus: SimulatorBus, ask: Ask, hear: Hear
) -> None:
    bus.set_tilt(95.0, 0.0)
    assert hear(bus, 0.1) == ["08A#1050810000000000"]
    bus.set_tilt(96.0, 0.0)
    assert hear(bus, 0.1) == []
    assert ask(bus, "40 01 10 00 00 00 00 00") == "4F 01 10 00 81 00 00 00"
    bus.set_tilt(96.0, 97.0)
    assert hear(bus, 0.1) == ["08A#2050810000000000"]
    bus.set_tilt(0.0, 97.0)
    assert hear(bus, 0.1) == ["08A#0000810000000000"], "the other error remains"
    bus.set_tilt(0.0, 0.0)
    assert hear(bus, 0.1) == ["08A#0000000000000000"]
    assert ask(bus, "40 01 10 00 00 00 00 00") == "4F 01 10 00 00 00 00 00"


def test_a_communication_error_sets_its_own_bit(bus: SimulatorBus, hear: Hear) -> None:
    bus.raise_error(0x8120)
    assert hear(bus, 0.1) == ["08A#2081110000000000"]
    bus.raise_error(0x3100)
    assert hear(bus, 0.1) == ["08A#0031910000000000"]
    bus.clear_error(0x8120)
    bus.clear_error(0x8120)
    assert hear(bus, 0.1) == ["08A#0000810000000000"]


def test_the_history_keeps_the_latest_errors_in_front(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    assert ask(bus, "40 03 10 01 00 00 00 00") == "80 03 10 01 24 00 00 08", "no default, no data"
    assert ask(bus, "40 03 10 02 00 00 00 00") == "43 03 10 02 00 00 00 00", "default 0"
    for code in (0x3100, 0x8120, 0x5010):
        bus.raise_error(code)
    assert ask(bus, "40 03 10 00 00 00 00 00") == "4F 03 10 00 02 00 00 00"
    assert ask(bus, "40 03 10 01 00 00 00 00") == "43 03 10 01 10 50 00 00"
    assert ask(bus, "40 03 10 02 00 00 00 00") == "43 03 10 02 20 81 00 00"
    tell(bus, "000#810A")
    hear(bus, 0.3)
    assert ask(bus, "40 03 10 00 00 00 00 00") == "4F 03 10 00 02 00 00 00", "it is persistent"
    assert ask(bus, "2F 03 10 00 01 00 00 00") == "80 03 10 00 30 00 09 06"
    assert ask(bus, "2F 03 10 00 00 00 00 00") == "60 03 10 00 00 00 00 00"
    assert ask(bus, "40 03 10 00 00 00 00 00") == "4F 03 10 00 00 00 00 00"


def test_no_emcy_in_stopped_nor_with_bit_31_set(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    tell(bus, "000#020A")
    hear(bus, 0.1)
    bus.raise_error(0x3100)
    assert hear(bus, 0.1) == []
    tell(bus, "000#800A")
    hear(bus, 0.1)
    ask(bus, "23 14 10 00 8A 00 00 80")
    bus.raise_error(0x8120)
    assert hear(bus, 0.1) == []
    ask(bus, "23 14 10 00 90 00 00 00")
    bus.raise_error(0x5010)
    assert hear(bus, 0.1) == ["090#1050910000000000"]


def test_lss_selects_one_slave_by_its_address(bus: SimulatorBus, tell: Tell, hear: Hear) -> None:
    address = ["40 11000000", "41 22000000", "42 33000000", "43 01000000"]
    tell(bus, *[f"7E5#{part}000000" for part in address[:3]], "7E5#4302000000000000")
    assert hear(bus, 0.1) == [], "another serial number"
    tell(bus, "7E5#5E00000000000000")
    assert hear(bus, 0.1) == [], "still waiting"
    tell(bus, *[f"7E5#{part}000000" for part in address])
    assert hear(bus, 0.1) == ["7E4#4400000000000000"]
    tell(bus, "7E5#5E00000000000000")
    assert hear(bus, 0.1) == ["7E4#5E0A000000000000"]


def test_lss_identifies_slaves_by_ranges(bus: SimulatorBus, tell: Tell, hear: Hear) -> None:
    parts = ["46 11", "47 22", "48 30", "49 40", "4A 00", "4B 01"]
    tell(bus, *[f"7E5#{part}000000000000" for part in parts])
    assert hear(bus, 0.1) == ["7E4#4F00000000000000"]
    parts[3] = "49 32"
    tell(bus, *[f"7E5#{part}000000000000" for part in parts])
    assert hear(bus, 0.1) == []


def test_lss_answers_in_configuration_only(bus: SimulatorBus, tell: Tell, hear: Hear) -> None:
    requests = ["5A", "5B", "5C", "5D", "5E", "17"]
    tell(bus, *[f"7E5#{command}00000000000000" for command in requests])
    assert hear(bus, 0.1) == []
    tell(bus, "7E5#0401000000000000", *[f"7E5#{command}00000000000000" for command in requests])
    assert hear(bus, 0.1) == [
        "7E4#5A11000000000000",
        "7E4#5B22000000000000",
        "7E4#5C33000000000000",
        "7E4#5D01000000000000",
        "7E4#5E0A000000000000",
        "7E4#1700000000000000",
    ]
    tell(bus, "7E5#0400000000000000", "7E5#5E00000000000000", "7E5#FF00000000000000", "7E5#5E")
    assert hear(bus, 0.1) == []


@pytest.mark.parametrize("stored", [False, True])
def test_lss_changes_the_node_id(bus: SimulatorBus, tell: Tell, hear: Hear, stored: bool) -> None:
    tell(bus, "7E5#0401000000000000", "7E5#1180000000000000", "7E5#1121000000000000")
    assert hear(bus, 0.1) == ["7E4#1101000000000000", "7E4#1100000000000000"]
    if stored:
        tell(bus, "7E5#1700000000000000")
        assert hear(bus, 0.1) == ["7E4#1700000000000000"]
    tell(bus, "000#820A")
    assert hear(bus, 0.3) == ["721#00"]
    bus.power_off()
    bus.power_on()
    assert hear(bus, 0.3) == ["721#00" if stored else "70A#00"]


def test_lss_changes_the_bit_rate(
    bus: SimulatorBus, open_bus: Callable[..., SimulatorBus], tell: Tell, hear: Hear, ask: Ask
) -> None:
    fast = open_bus(bitrate=1_000_000)
    tell(bus, "7E5#0401000000000000", "7E5#1300040000000000", "7E5#1300000000000000")
    assert hear(bus, 0.1) == ["7E4#1301000000000000", "7E4#1300000000000000"]
    tell(bus, "7E5#1700000000000000", "7E5#1564000000000000")
    assert hear(bus, 0.099) == ["7E4#1700000000000000"]
    assert hear(fast, 0.01) == []
    assert ask(fast, "40 01 20 00 00 00 00 00") == "4F 01 20 00 03 00 00 00"
    bus.power_off()
    bus.power_on()
    assert hear(fast, 0.3) == ["70A#00"]
    assert ask(fast, "40 01 20 00 00 00 00 00") == "4F 01 20 00 09 00 00 00"
