from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from conformance.simulator.device import SimulatedDevice
from conformance.simulator.fault_files import load_faults
from conformance.simulator.interface import SimulatorBus
from conformance.wire.frame import Frame

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]
Times = Callable[[SimulatorBus, float, str], list[int]]

TILT = "18A#1A0457FE"
"""10.50 and -4.25 degrees in hundredths."""
BLANK = "tpdo-blanks-one-object"


def gaps(times: list[int]) -> set[int]:
    return {b - a for a, b in pairwise(times)}


def write(bus: SimulatorBus, ask: Ask, *downloads: str) -> None:
    for data in downloads:
        assert ask(bus, data)[:2] == "60", data


def test_an_event_timer_of_zero_sends_nothing(bus: SimulatorBus, tell: Tell, hear: Hear) -> None:
    tell(bus, "000#010A")
    assert hear(bus, 2.0) == []


def test_the_event_timer_sends_on_entering_operational_and_then_at_its_period(
    bus: SimulatorBus, tell: Tell, ask: Ask, times: Times
) -> None:
    write(bus, ask, "2B 00 18 05 14 00 00 00")
    tell(bus, "000#010A")
    start = round(bus.now() * 1e9)
    sent = times(bus, 1.0, "18A")
    assert sent[0] - start < 1_000_000
    assert len(sent) == 50
    assert gaps(sent) == {20_000_000}


def test_a_tpdo_carries_its_mapped_objects_in_order(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2B 00 18 05 14 00 00 00")
    tell(bus, "000#010A")
    assert hear(bus, 0.01) == [TILT]
    bus.set_tilt(-1.0, 2.0)
    assert hear(bus, 0.02) == ["18A#9CFFC800"]


@pytest.mark.parametrize("command", ["80", "02"])
def test_tpdos_end_with_operational(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, command: str
) -> None:
    write(bus, ask, "2B 00 18 05 14 00 00 00")
    assert hear(bus, 0.1) == [], "nothing in Pre-operational"
    tell(bus, "000#010A", f"000#{command}0A")
    assert hear(bus, 0.01) == [TILT]
    assert hear(bus, 1.0) == []


def test_starting_an_operational_node_again_changes_nothing(
    bus: SimulatorBus, tell: Tell, ask: Ask, times: Times, hear: Hear
) -> None:
    write(bus, ask, "2B 00 18 05 14 00 00 00")
    tell(bus, "000#010A")
    hear(bus, 0.025)
    tell(bus, "000#010A")
    assert gaps(times(bus, 0.5, "18A")) == {20_000_000}


def test_a_new_event_time_takes_effect_when_the_timer_next_runs_out(
    bus: SimulatorBus, tell: Tell, ask: Ask, times: Times, hear: Hear
) -> None:
    write(bus, ask, "2B 00 18 05 64 00 00 00")
    tell(bus, "000#010A")
    hear(bus, 0.01)
    write(bus, ask, "2B 00 18 05 0A 00 00 00")
    sent = times(bus, 0.2, "18A")
    assert round(bus.now() * 1e9) - sent[0] == pytest.approx(110_000_000, abs=3_000_000)
    assert gaps(sent) == {10_000_000}
    write(bus, ask, "2B 00 18 05 00 00 00 00")
    assert hear(bus, 1.0) == []
    write(bus, ask, "2B 00 18 05 0A 00 00 00")
    assert len(times(bus, 0.1, "18A")) == 10


def test_bit_31_stops_and_starts_a_tpdo_at_once(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2B 00 18 05 14 00 00 00")
    tell(bus, "000#010A")
    hear(bus, 0.01)
    write(bus, ask, "23 00 18 01 8A 01 00 80")
    assert hear(bus, 0.5) == []
    tell(bus, "60A#230018018B010000")
    assert hear(bus, 0.03) == ["18B#1A0457FE", "58A#6000180100000000", "18B#1A0457FE"]


@pytest.mark.parametrize("every", [1, 2, 3, 240])
def test_a_synchronous_tpdo_follows_every_nth_sync(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, every: int
) -> None:
    write(bus, ask, f"2F 00 18 02 {every:02X} 00 00 00")
    tell(bus, "000#010A")
    answered = []
    for number in range(1, 2 * every + 1):
        tell(bus, "080#")
        if hear(bus, 0.01):
            answered.append(number)
    assert answered == [every, 2 * every]


def test_the_sync_count_begins_anew_with_operational(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2F 00 18 02 03 00 00 00")
    tell(bus, "080#", "000#010A", "080#", "080#", "000#800A", "000#010A", "080#", "080#")
    assert hear(bus, 0.1) == []
    tell(bus, "080#")
    assert hear(bus, 0.1) == [TILT]


def test_a_synchronous_tpdo_leaves_at_the_end_of_the_sync(
    make_device: Callable[..., SimulatedDevice],
) -> None:
    device = make_device()
    device.step(300_000_000, [Frame(0x60A, bytes.fromhex("2F00180201000000"))])
    device.step(400_000_000, [Frame(0x000, b"\x01\x0a")])
    assert device.step(500_000_000, [Frame(0x080)]) == [Frame(0x18A, bytes.fromhex("1A0457FE"))]
    assert device.step(600_000_000, [Frame(0x080, b"\x01")]) != [], "SYNC with counter"
    assert device.step(700_000_000, [Frame(0x080, b"\x01\x02")]) == []
    assert device.step(800_000_000, [Frame(0x081)]) == []


def test_the_identifier_of_sync_can_be_changed(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "23 05 10 00 90 00 00 00", "2F 00 18 02 01 00 00 00")
    tell(bus, "000#010A", "080#")
    assert hear(bus, 0.1) == []
    tell(bus, "090#")
    assert hear(bus, 0.1) == [TILT]


def test_an_acyclic_tpdo_follows_a_sync_only_after_a_change(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2F 00 18 02 00 00 00 00")
    tell(bus, "000#010A", "080#", "080#")
    assert hear(bus, 0.1) == [TILT]
    bus.set_tilt(1.0, 0.0)
    assert hear(bus, 0.1) == []
    tell(bus, "080#", "080#")
    assert hear(bus, 0.1) == ["18A#64000000"]


def test_type_fdh_samples_at_the_remote_request(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2F 00 18 02 FD 00 00 00")
    tell(bus, "18A#R")
    assert hear(bus, 0.1) == [], "not in Pre-operational"
    tell(bus, "000#010A", "080#")
    assert hear(bus, 0.1) == []
    bus.set_tilt(1.0, 0.0)
    tell(bus, "18A#R", "18B#R")
    assert hear(bus, 0.1) == ["18A#64000000"]


def test_type_fch_samples_at_sync_and_sends_at_the_remote_request(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2F 00 18 02 FC 00 00 00")
    tell(bus, "000#010A", "080#")
    assert hear(bus, 0.1) == []
    bus.set_tilt(1.0, 0.0)
    tell(bus, "18A#R")
    assert hear(bus, 0.1) == [TILT]
    tell(bus, "080#", "18A#R")
    assert hear(bus, 0.1) == ["18A#64000000"]


def test_bit_30_forbids_remote_requests(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2F 00 18 02 FD 00 00 00", "23 00 18 01 8A 01 00 40")
    tell(bus, "000#010A", "18A#R")
    assert hear(bus, 0.1) == []


def test_the_inhibit_time_holds_back_the_event_timer(
    bus: SimulatorBus, tell: Tell, ask: Ask, times: Times
) -> None:
    write(bus, ask, "23 00 18 01 8A 01 00 80", "2B 00 18 03 2C 01 00 00")  # 300 times 100 us
    write(bus, ask, "23 00 18 01 8A 01 00 00", "2B 00 18 05 14 00 00 00")
    tell(bus, "000#010A")
    assert min(gaps(times(bus, 1.0, "18A"))) >= 30_000_000


def test_the_inhibit_time_may_not_change_while_valid(bus: SimulatorBus, ask: Ask) -> None:
    assert ask(bus, "2B 00 18 03 2C 01 00 00") == "80 00 18 03 30 00 09 06"
    assert ask(bus, "2B 00 18 03 00 00 00 00")[:2] == "60", "the same value"


@pytest.mark.parametrize("kind", [241, 251])
def test_a_transmission_type_that_the_spec_does_not_list_is_refused(
    bus: SimulatorBus, ask: Ask, kind: int
) -> None:
    assert ask(bus, f"2F 00 18 02 {kind:02X} 00 00 00") == "80 00 18 02 30 00 09 06"


def test_other_transmission_types_are_accepted_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = with_reading("INV-05=2")
    write(bus, ask, "2F 00 18 02 F5 00 00 00")
    tell(bus, "000#010A", "080#", "18A#R")
    assert hear(bus, 0.5) == []


def test_a_mapping_is_changed_by_the_book(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(
        bus,
        ask,
        "23 00 18 01 8A 01 00 80",
        "2F 00 1A 00 00 00 00 00",
        "23 00 1A 01 08 00 22 20",
        "23 00 1A 02 20 00 11 61",
        "23 00 1A 03 01 00 08 20",
        "2F 00 1A 00 03 00 00 00",
        "2F 00 18 02 01 00 00 00",
        "23 00 18 01 8A 01 00 00",
    )
    tell(bus, "000#010A", "080#")
    assert hear(bus, 0.1) == ["18A#191A04000001"], "25 degC, heading 10.50 degrees, switch on"


@pytest.mark.parametrize(
    ("download", "code"),
    [
        pytest.param("23 00 1A 01 10 00 10 60", "00 00 01 06", id="entry"),
        pytest.param("2F 00 1A 00 00 00 00 00", "00 00 01 06", id="count"),
    ],
)
def test_the_mapping_of_a_valid_tpdo_is_locked(
    bus: SimulatorBus, ask: Ask, download: str, code: str
) -> None:
    assert ask(bus, download) == f"80 {download[3:11]} {code}"


def test_a_mapping_entry_is_locked_while_the_count_is_not_zero(bus: SimulatorBus, ask: Ask) -> None:
    write(bus, ask, "23 00 18 01 8A 01 00 80")
    assert ask(bus, "23 00 1A 01 10 00 10 60") == "80 00 1A 01 00 00 01 06"


@pytest.mark.parametrize(
    ("word", "code"),
    [
        pytest.param("10 00 50 50", "00 00 02 06", id="unknown object"),
        pytest.param("10 05 10 60", "00 00 02 06", id="unknown sub-index"),
        pytest.param("10 00 17 10", "41 00 04 06", id="not mappable"),
        pytest.param("08 00 10 60", "41 00 04 06", id="wrong length"),
        pytest.param("20 00 07 20", "41 00 04 06", id="write-only"),
    ],
)
def test_a_mapping_word_that_names_no_mappable_object_is_refused(
    bus: SimulatorBus, ask: Ask, word: str, code: str
) -> None:
    write(bus, ask, "23 00 18 01 8A 01 00 80", "2F 00 1A 00 00 00 00 00")
    assert ask(bus, f"23 00 1A 01 {word}") == f"80 00 1A 01 {code}"


def test_a_count_is_refused_when_the_sum_or_an_entry_does_not_fit(
    bus: SimulatorBus, ask: Ask
) -> None:
    write(bus, ask, "23 00 18 01 8A 01 00 80", "2F 00 1A 00 00 00 00 00")
    for sub in (1, 2, 3):
        write(bus, ask, f"23 00 1A {sub:02X} 20 00 11 61")
    assert ask(bus, "2F 00 1A 00 03 00 00 00") == "80 00 1A 00 42 00 04 06", "96 bits"
    assert ask(bus, "2F 00 1A 00 05 00 00 00") == "80 00 1A 00 42 00 04 06", "5 of 4 entries"
    write(bus, ask, "23 00 1A 02 00 00 00 00")
    assert ask(bus, "2F 00 1A 00 02 00 00 00") == "80 00 1A 00 00 00 02 06", "empty entry"
    write(bus, ask, "2F 00 1A 00 01 00 00 00")


def test_empty_entries_may_be_counted_where_the_factory_counts_them(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2F 01 1A 00 00 00 00 00", "2F 01 1A 00 04 00 00 00")
    write(bus, ask, "23 01 18 01 8A 02 00 00")
    tell(bus, "000#010A", "080#")
    assert hear(bus, 0.1) == ["28A#1A040000"]


def test_a_tpdo_without_mapping_is_not_sent(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    write(bus, ask, "2F 01 1A 00 00 00 00 00", "23 01 18 01 8A 02 00 00")
    tell(bus, "000#010A", "080#")
    assert hear(bus, 0.1) == []


@pytest.mark.parametrize(("fault", "data"), [(None, "D200ABFF"), (BLANK, "D2000000")])
def test_a_device_without_the_first_object_to_be_blank_blanks_the_next(
    dst: Callable[..., Wired], fault: str | None, data: str
) -> None:
    heard = dst(faults=fault and load_faults([fault])).nmt(1, 0.01)
    assert heard == [f"1FF#{data}"]
