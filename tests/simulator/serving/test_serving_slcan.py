from __future__ import annotations

import pytest

from conformance.simulator.serving.slcan import BIT_RATES, MOST, SlcanAdapter
from conformance.wire.frame import Frame


class RecordedWire:
    def __init__(self) -> None:
        self.done: list[object] = []

    def open(self, bitrate: int) -> None:
        self.done.append(bitrate)

    def close(self) -> None:
        self.done.append("closed")

    def send(self, frame: Frame) -> None:
        self.done.append(frame)


@pytest.fixture
def wire() -> RecordedWire:
    return RecordedWire()


@pytest.fixture
def adapter(wire: RecordedWire) -> SlcanAdapter:
    return SlcanAdapter(wire)


def test_the_digits_of_bit_rates_are_lawicels() -> None:
    assert BIT_RATES[4] == 125_000
    assert BIT_RATES[8] == 1_000_000
    assert BIT_RATES[7] == 800_000


def test_a_channel_is_opened_used_and_closed(adapter: SlcanAdapter, wire: RecordedWire) -> None:
    assert adapter.feed(b"S4\rO\rt1002112") == b"\r\r"
    assert adapter.feed(b"2\rC\r") == b"z\r\r"
    assert wire.done == [125_000, Frame(0x100, b"\x11\x22"), "closed"]


@pytest.mark.parametrize(
    ("text", "frame", "answer"),
    [
        (b"t10021133\r", Frame(0x100, b"\x11\x33"), b"z\r"),
        (b"t0000\r", Frame(0), b"z\r"),
        (b"T0000010021133\r", Frame(0x100, b"\x11\x33", extended=True), b"Z\r"),
        (b"r1812\r", Frame(0x181, remote=True, dlc=2), b"z\r"),
        (b"R000001812\r", Frame(0x181, remote=True, extended=True, dlc=2), b"Z\r"),
    ],
)
def test_frames_go_out_and_come_in_alike(
    adapter: SlcanAdapter, wire: RecordedWire, text: bytes, frame: Frame, answer: bytes
) -> None:
    adapter.feed(b"S4\rO\r")
    assert adapter.feed(text) == answer
    assert wire.done[-1] == frame
    assert adapter.deliver(0, frame) == text


@pytest.mark.parametrize(
    "text",
    [
        *(b"t100", b"t10021", b"t100211", b"t1002112233", b"t8000", b"t1009", b"r1812FF"),
        *(b"T100", b"O", b"O1", b"S4", b"S9", b"sFF", b"Z1", b"xyz", b"\xff"),
    ],
)
def test_what_is_wrong_is_answered_by_bell(
    adapter: SlcanAdapter, wire: RecordedWire, text: bytes
) -> None:
    adapter.feed(b"S4\rO\r")
    assert adapter.feed(text + b"\r") == b"\a"
    assert wire.done == [125_000]


@pytest.mark.parametrize("text", [b"t1000", b"O", b"L", b"C", b"F", b"S", b"S9", b"Sx"])
def test_a_closed_channel_without_a_bit_rate_takes_little(
    adapter: SlcanAdapter, text: bytes
) -> None:
    assert adapter.feed(text + b"\r") == b"\a"


def test_registers_set_the_bit_rate(adapter: SlcanAdapter, wire: RecordedWire) -> None:
    # the values that CiA recommends of an SJA1000 with 16 MHz, for 125 and 500 kbit/s
    assert adapter.feed(b"s031C\rO\rC\rs001C\rO\r") == b"\r" * 5
    assert wire.done == [125_000, "closed", 500_000]


def test_a_listening_channel_sends_nothing(adapter: SlcanAdapter, wire: RecordedWire) -> None:
    assert adapter.feed(b"S4\rL\rt1000\r") == b"\r\r\a"
    assert wire.done == [125_000]
    assert adapter.deliver(0, Frame(0x100)) == b"t1000\r"


def test_nothing_is_delivered_while_closed(adapter: SlcanAdapter) -> None:
    assert adapter.deliver(0, Frame(0x100)) == b""


def test_timestamps_count_milliseconds_of_a_minute(adapter: SlcanAdapter) -> None:
    adapter.feed(b"Z1\rS4\rO\r")
    assert adapter.deliver(61_002_999_999, Frame(0x100, b"\1")) == b"t10010103EA\r"


def test_empty_commands_and_version_are_answered(adapter: SlcanAdapter) -> None:
    assert adapter.feed(b"\r\rV\rN\r") == b"\r\rV1013\rNCC01\r"


def test_endless_commands_take_no_memory(adapter: SlcanAdapter) -> None:
    assert adapter.feed(b"t" * (MOST + 1)) == b"\a"
    assert adapter.feed(b"V\r") == b"V1013\r"
