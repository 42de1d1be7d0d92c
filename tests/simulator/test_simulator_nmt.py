from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest

from conformance.simulator.interface import SimulatorBus

Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]
Times = Callable[[SimulatorBus, float, str], list[int]]

START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = "01", "02", "80", "81", "82"
OPERATIONAL, STOPPED, PREOP = "70A#05", "70A#04", "70A#7F"


def test_the_boot_up_message_comes_two_tenths_of_a_second_after_power_on(
    open_bus: Callable[..., SimulatorBus],
) -> None:
    message = open_bus().recv(1)
    assert message is not None
    assert (message.arbitration_id, bytes(message.data)) == (0x70A, b"\0")
    assert message.timestamp == pytest.approx(0.2, abs=0.0003)


def test_nothing_is_heard_before_boot_up(
    open_bus: Callable[..., SimulatorBus], tell: Tell, hear: Hear
) -> None:
    bus = open_bus()
    tell(bus, "60A#4000100000000000", "000#0100")
    assert hear(bus, 0.5) == ["70A#00"]


@pytest.mark.parametrize("before", [[], [START], [STOP]])
@pytest.mark.parametrize(
    ("command", "state"),
    [(START, OPERATIONAL), (STOP, STOPPED), (PRE_OPERATIONAL, PREOP)],
)
def test_every_command_works_in_every_state(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, before: list[str], command: str, state: str
) -> None:
    assert ask(bus, "2B 17 10 00 64 00 00 00")[:2] == "60"
    for earlier in before:
        tell(bus, f"000#{earlier}0A")
    tell(bus, f"000#{command}0A")
    hear(bus, 0.01)
    assert hear(bus, 0.1) == [state]


@pytest.mark.parametrize("before", [PRE_OPERATIONAL, START, STOP])
@pytest.mark.parametrize("command", [RESET_NODE, RESET_COMMUNICATION])
@pytest.mark.parametrize("node", ["0A", "00"])
def test_both_resets_end_in_a_boot_up_and_pre_operational(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, before: str, command: str, node: str
) -> None:
    tell(bus, f"000#{before}0A", f"000#{command}{node}")
    assert hear(bus, 0.3) == ["70A#00"]
    ask(bus, "2B 17 10 00 64 00 00 00")
    assert hear(bus, 0.1) == [PREOP]


@pytest.mark.parametrize(
    "frame",
    [
        pytest.param("000#010B", id="other node"),
        pytest.param("000#030A", id="unknown command"),
        pytest.param("000#01", id="one byte"),
        pytest.param("000#010A00", id="three bytes"),
        pytest.param("000#", id="no byte"),
        pytest.param("000#018A", id="node-ID above 127"),
        pytest.param("000#R", id="remote frame"),
        pytest.param("00000000#010A", id="29-bit identifier"),
    ],
)
def test_what_is_no_command_to_this_node_is_ignored(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, frame: str
) -> None:
    tell(bus, frame)
    ask(bus, "2B 17 10 00 64 00 00 00")
    assert hear(bus, 0.1) == [PREOP]


def test_a_stopped_node_answers_no_sdo(bus: SimulatorBus, tell: Tell, ask: Ask) -> None:
    tell(bus, "000#020A")
    assert ask(bus, "40 00 10 00 00 00 00 00") == "silence"
    tell(bus, "000#800A")
    assert ask(bus, "40 00 10 00 00 00 00 00") == "43 00 10 00 9A 01 04 00"


def test_an_answer_under_way_is_dropped_when_the_node_is_stopped(
    bus: SimulatorBus, tell: Tell, hear: Hear
) -> None:
    tell(bus, "60A#4000100000000000", "000#020A")
    assert hear(bus, 0.1) == []


def test_the_heartbeat_starts_at_once_and_keeps_its_period_to_the_nanosecond(
    bus: SimulatorBus, tell: Tell, times: Times
) -> None:
    tell(bus, "60A#2B17100032000000")
    beats = times(bus, 1.0, "70A")
    assert len(beats) == 20
    assert {b - a for a, b in pairwise(beats[1:])} == {50_000_000}


def test_a_heartbeat_stops_when_zero_is_written(bus: SimulatorBus, ask: Ask, hear: Hear) -> None:
    ask(bus, "2B 17 10 00 0A 00 00 00")
    ask(bus, "2B 17 10 00 00 00 00 00")
    assert hear(bus, 1.0) == []


def test_a_stored_heartbeat_counts_from_the_boot_up_message(
    bus: SimulatorBus, tell: Tell, ask: Ask, times: Times
) -> None:
    ask(bus, "2B 17 10 00 64 00 00 00")
    ask(bus, "23 10 10 01 73 61 76 65")
    tell(bus, "000#810A")
    bus.recv(0.01)
    boot_up, first, *_ = times(bus, 0.5, "70A")[-4:]
    assert first - boot_up == pytest.approx(100_000_000, abs=100_000)


def test_a_reset_of_the_communication_leaves_the_application_alone(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    ask(bus, "2B 17 10 00 64 00 00 00")
    ask(bus, "2F 04 20 00 05 00 00 00")
    tell(bus, "000#820A")
    hear(bus, 0.3)
    assert ask(bus, "40 17 10 00 00 00 00 00") == "4B 17 10 00 00 00 00 00"
    assert ask(bus, "40 04 20 00 00 00 00 00") == "4F 04 20 00 05 00 00 00"
    tell(bus, "000#810A")
    hear(bus, 0.3)
    assert ask(bus, "40 04 20 00 00 00 00 00") == "4F 04 20 00 01 00 00 00"


def test_a_heartbeat_below_the_minimum_is_clamped_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus], ask: Ask
) -> None:
    bus = with_reading("INV-04=2")
    assert ask(bus, "2B 17 10 00 05 00 00 00")[:2] == "60"
    assert ask(bus, "40 17 10 00 00 00 00 00") == "4B 17 10 00 0A 00 00 00"


def test_a_heartbeat_below_the_minimum_is_accepted_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus], ask: Ask
) -> None:
    bus = with_reading("INV-04=3")
    assert ask(bus, "2B 17 10 00 05 00 00 00")[:2] == "60"
    assert ask(bus, "40 17 10 00 00 00 00 00") == "4B 17 10 00 05 00 00 00"


def test_a_device_may_start_by_itself(
    with_reading: Callable[[str], SimulatorBus], ask: Ask, hear: Hear
) -> None:
    bus = with_reading("INV-06=2")
    ask(bus, "2B 17 10 00 64 00 00 00")
    assert hear(bus, 0.1) == [OPERATIONAL]


def test_a_command_may_reset_the_controller_after_its_answer(
    bus: SimulatorBus, ask: Ask, hear: Hear
) -> None:
    assert ask(bus, "2F 10 20 00 01 00 00 00") == "60 10 20 00 00 00 00 00"
    assert hear(bus, 0.3) == ["70A#00"]
    assert ask(bus, "2F 10 20 00 02 00 00 00") == "60 10 20 00 00 00 00 00"
    assert hear(bus, 0.3) == []
    assert ask(bus, "2F 10 20 00 03 00 00 00") == "80 10 20 00 30 00 09 06"
