from __future__ import annotations

from collections.abc import Callable

import pytest

from conformance.simulator.device import SimulatedDevice
from conformance.simulator.interface import SimulatorBus
from conformance.wire.frame import Frame

Ask = Callable[..., str]
Tell = Callable[..., None]


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("40 00 10 00 00000000", "43 00 10 00 9A 01 04 00"),
        ("40 17 10 00 00000000", "4B 17 10 00 00 00 00 00"),
        ("40 18 10 00 00000000", "4F 18 10 00 04 00 00 00"),
        ("40 14 10 00 00000000", "43 14 10 00 8A 00 00 00"),
        ("40 06 20 00 00000000", "4B 06 20 00 FB FF 00 00"),
        ("40 08 20 00 00000000", "4F 08 20 00 01 00 00 00"),
        ("40 09 20 00 00000000", "43 09 20 00 00 00 00 3F"),
        ("40 09 10 00 00000000", "4B 09 10 00 31 2E 00 00"),
    ],
)
def test_an_upload_of_up_to_four_bytes_is_expedited(
    bus: SimulatorBus, ask: Ask, request_: str, answer: str
) -> None:
    assert ask(bus, request_) == answer


@pytest.mark.parametrize(
    ("request_", "code"),
    [
        pytest.param("40 00 30 00 00000000", "00 00 02 06", id="unknown object"),
        pytest.param("40 00 10 01 00000000", "11 00 09 06", id="unknown sub-index"),
        pytest.param("40 18 10 05 00000000", "11 00 09 06", id="unknown sub-index of a record"),
        pytest.param("40 00 18 04 00000000", "11 00 09 06", id="reserved sub-index"),
        pytest.param("40 0A 20 00 00000000", "00 00 02 06", id="reserved object"),
        pytest.param("40 07 20 00 00000000", "01 00 01 06", id="write-only"),
        pytest.param("23 00 10 00 9A010400", "02 00 01 06", id="read-only"),
        pytest.param("2F 18 10 00 04000000", "02 00 01 06", id="constant"),
        pytest.param("23 17 10 00 64000000", "12 00 07 06", id="too long"),
        pytest.param("2F 17 10 00 64000000", "13 00 07 06", id="too short"),
        pytest.param("21 17 10 00 04000000", "12 00 07 06", id="too long announced"),
        pytest.param("2B 17 10 00 09000000", "30 00 09 06", id="between two ranges"),
        pytest.param("2B 06 20 00 65000000", "31 00 09 06", id="above the range"),
        pytest.param("2B 06 20 00 9BFF0000", "32 00 09 06", id="below the range"),
        pytest.param("2F 04 20 00 02000000", "30 00 09 06", id="not in the enumeration"),
        pytest.param(
            "2B 05 20 00 65000000", "31 00 09 06", id="beyond the limit by another object"
        ),
        pytest.param("2F 08 20 00 02000000", "30 00 09 06", id="no boolean"),
        pytest.param("27 03 20 00 01020300", "30 00 09 06", id="no text"),
        pytest.param("E0 00 10 00 00000000", "01 00 04 05", id="unknown command"),
        pytest.param("A0 00 10 00 14000000", "01 00 04 05", id="block upload"),
        pytest.param("C2 17 10 00 02000000", "01 00 04 05", id="block download"),
        pytest.param("60 00 00 00 00000000", "01 00 04 05", id="segment without an upload"),
        pytest.param("01 00 00 00 00000000", "01 00 04 05", id="segment without a download"),
    ],
)
def test_an_access_that_is_not_allowed_is_aborted(
    bus: SimulatorBus, ask: Ask, request_: str, code: str
) -> None:
    multiplexer = request_[3:11]
    assert ask(bus, request_) == f"80 {multiplexer} {code}"


def test_a_downloaded_value_is_read_back(bus: SimulatorBus, ask: Ask) -> None:
    assert ask(bus, "2B 06 20 00 9C FF 00 00") == "60 06 20 00 00 00 00 00"
    assert ask(bus, "40 06 20 00 00 00 00 00") == "4B 06 20 00 9C FF 00 00"


def test_an_expedited_download_without_size_takes_what_the_type_needs(
    bus: SimulatorBus, ask: Ask
) -> None:
    assert ask(bus, "22 06 20 00 07 00 AA BB") == "60 06 20 00 00 00 00 00"
    assert ask(bus, "40 06 20 00 00 00 00 00") == "4B 06 20 00 07 00 00 00"


def test_limits_follow_the_object_that_sets_them(bus: SimulatorBus, ask: Ask) -> None:
    assert ask(bus, "2F 04 20 00 05 00 00 00")[:2] == "60"
    assert ask(bus, "2B 05 20 00 E8 03 00 00")[:2] == "60"
    assert ask(bus, "2F 04 20 00 00 00 00 00")[:2] == "60"
    assert ask(bus, "2B 05 20 00 FF FF 00 00")[:2] == "60", "no limits documented with this filter"


def test_a_long_text_is_uploaded_in_segments(bus: SimulatorBus, ask: Ask) -> None:
    assert ask(bus, "40 08 10 00 00 00 00 00") == "41 08 10 00 0B 00 00 00"
    assert ask(bus, "60 00 00 00 00 00 00 00") == "00 54 49 4C 54 59 2D 32"
    assert ask(bus, "70 00 00 00 00 00 00 00") == "17 30 30 30 58 00 00 00"
    assert ask(bus, "60 00 00 00 00 00 00 00") == "80 00 00 00 01 00 04 05"


def test_a_text_is_downloaded_in_segments(bus: SimulatorBus, ask: Ask) -> None:
    assert ask(bus, "21 03 20 00 09 00 00 00") == "60 03 20 00 00 00 00 00"
    assert ask(bus, "00 41 42 43 44 45 46 47") == "20 00 00 00 00 00 00 00"
    assert ask(bus, "1B 48 49 00 00 00 00 00") == "30 00 00 00 00 00 00 00"
    assert ask(bus, "40 03 20 00 00 00 00 00") == "41 03 20 00 09 00 00 00"
    assert ask(bus, "60 00 00 00 00 00 00 00") == "00 41 42 43 44 45 46 47"
    assert ask(bus, "70 00 00 00 00 00 00 00") == "1B 48 49 00 00 00 00 00"


def test_an_integer_may_be_downloaded_in_segments_with_or_without_size(
    bus: SimulatorBus, ask: Ask
) -> None:
    assert ask(bus, "21 17 10 00 02 00 00 00") == "60 17 10 00 00 00 00 00"
    assert ask(bus, "0B 00 00 00 00 00 00 00") == "20 00 00 00 00 00 00 00"
    assert ask(bus, "20 06 20 00 00 00 00 00") == "60 06 20 00 00 00 00 00"
    assert ask(bus, "0B 08 00 00 00 00 00 00") == "20 00 00 00 00 00 00 00"
    assert ask(bus, "40 06 20 00 00 00 00 00") == "4B 06 20 00 08 00 00 00"


def test_a_toggle_bit_that_does_not_alternate_ends_the_transfer(
    bus: SimulatorBus, ask: Ask
) -> None:
    ask(bus, "40 08 10 00 00 00 00 00")
    assert ask(bus, "70 00 00 00 00 00 00 00") == "80 08 10 00 00 00 03 05"
    assert ask(bus, "60 00 00 00 00 00 00 00") == "80 00 00 00 01 00 04 05"
    ask(bus, "21 03 20 00 09 00 00 00")
    ask(bus, "00 41 42 43 44 45 46 47")
    assert ask(bus, "0B 48 49 00 00 00 00 00") == "80 03 20 00 00 00 03 05"


def test_a_total_unlike_the_size_announced_is_refused_and_changes_nothing(
    bus: SimulatorBus, ask: Ask
) -> None:
    ask(bus, "21 03 20 00 05 00 00 00")
    assert ask(bus, "09 41 42 43 00 00 00 00") == "80 03 20 00 10 00 07 06"
    assert ask(bus, "40 03 20 00 00 00 00 00") == "43 03 20 00 6E 6F 6E 65"


def test_more_bytes_than_the_object_holds_are_refused_on_the_way(
    bus: SimulatorBus, ask: Ask
) -> None:
    ask(bus, "20 03 20 00 00 00 00 00")
    assert ask(bus, "00 41 41 41 41 41 41 41")[:2] == "20"
    assert ask(bus, "10 41 41 41 41 41 41 41")[:2] == "30"
    assert ask(bus, "00 41 41 41 41 41 41 41") == "80 03 20 00 12 00 07 06"


def test_the_client_may_abort_and_gets_no_answer(bus: SimulatorBus, ask: Ask) -> None:
    ask(bus, "40 08 10 00 00 00 00 00")
    assert ask(bus, "80 08 10 00 00 00 00 08") == "silence"
    assert ask(bus, "60 00 00 00 00 00 00 00") == "80 00 00 00 01 00 04 05"


def test_a_new_request_takes_the_place_of_a_transfer_under_way(bus: SimulatorBus, ask: Ask) -> None:
    ask(bus, "21 03 20 00 09 00 00 00")
    assert ask(bus, "40 17 10 00 00 00 00 00") == "4B 17 10 00 00 00 00 00"
    assert ask(bus, "00 41 42 43 44 45 46 47") == "80 41 42 43 01 00 04 05"


@pytest.mark.parametrize("length", range(8))
def test_a_request_of_fewer_than_eight_bytes_is_ignored(
    bus: SimulatorBus, ask: Ask, length: int
) -> None:
    assert ask(bus, "4017100000000000"[: 2 * length]) == "silence"


def test_frames_to_other_nodes_and_with_long_identifiers_are_ignored(
    bus: SimulatorBus, tell: Tell, ask: Ask
) -> None:
    tell(bus, "60B#4017100000000000", "0000060A#4017100000000000", "60A#R", "7FF#01")
    assert ask(bus, "40 18 10 01 00 00 00 00") == "43 18 10 01 11 00 00 00"


def test_requests_are_answered_in_their_order(bus: SimulatorBus, tell: Tell) -> None:
    tell(bus, "60A#4017100000000000", "60A#4018100100000000", "60A#4018100200000000")
    answers = [bus.recv(0.1) for _ in range(3)]
    assert [a and bytes(a.data[1:4]).hex() for a in answers] == ["171000", "181001", "181002"]


def test_an_answer_leaves_three_tenths_of_a_millisecond_after_its_request(
    make_device: Callable[..., SimulatedDevice],
) -> None:
    device = make_device()
    request = Frame(0x60A, bytes.fromhex("4017100000000000"))
    assert device.step(1_000_000_000, [request]) == []
    assert device.deadline_ns == 1_000_300_000
    assert device.step(1_000_299_999) == []
    assert device.step(1_000_300_000) == [Frame(0x58A, bytes.fromhex("4B17100000000000"))]
    assert device.deadline_ns is None


def test_an_object_locked_by_the_state_is_refused(bus: SimulatorBus, tell: Tell, ask: Ask) -> None:
    tell(bus, "000#010A")
    assert ask(bus, "23 05 10 00 81 00 00 00") == "80 05 10 00 22 00 00 08"
    tell(bus, "000#800A")
    assert ask(bus, "23 05 10 00 81 00 00 00") == "60 05 10 00 00 00 00 00"


@pytest.mark.parametrize(
    "cob_id",
    [
        "7F000000",
        "01010000",
        "80010000",
        "81050000",
        "01060000",
        "E0060000",
        "01070000",
        "FF070000",
    ],
)
@pytest.mark.parametrize("target", ["05 10 00", "14 10 00", "00 18 01"])
def test_a_restricted_identifier_is_refused(
    bus: SimulatorBus, ask: Ask, target: str, cob_id: str
) -> None:
    assert ask(bus, f"23 {target} {cob_id}") == f"80 {target} 30 00 09 06"


@pytest.mark.parametrize(
    ("target", "word"),
    [
        pytest.param("05 10 00", "80000040", id="SYNC producer"),
        pytest.param("05 10 00", "80000020", id="SYNC with 29 bits"),
        pytest.param("14 10 00", "8A000020", id="EMCY with 29 bits"),
        pytest.param("14 10 00", "8B000000", id="EMCY moved while valid"),
        pytest.param("00 18 01", "8B010000", id="TPDO moved while valid"),
        pytest.param("00 18 01", "8A010020", id="TPDO with 29 bits"),
        pytest.param("00 18 01", "8A110080", id="bits 11 to 28"),
    ],
)
def test_a_cob_id_that_the_node_cannot_use_is_refused(
    bus: SimulatorBus, ask: Ask, target: str, word: str
) -> None:
    assert ask(bus, f"23 {target} {word}") == f"80 {target} 30 00 09 06"


def test_a_cob_id_may_move_while_not_valid(bus: SimulatorBus, ask: Ask) -> None:
    assert ask(bus, "23 00 18 01 8A 01 00 80")[:2] == "60"
    assert ask(bus, "23 00 18 01 90 01 00 80")[:2] == "60"
    assert ask(bus, "23 00 18 01 90 01 00 40")[:2] == "60"
    assert ask(bus, "40 00 18 01 00 00 00 00") == "43 00 18 01 90 01 00 40"
