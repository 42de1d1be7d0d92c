"""Frames and their length on the bus."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.wire.errors import WireError
from conformance.wire.frame import Frame, _stuff_bits, bit_length, data_of, priority

# Whole frames as sent, stuff bits included: Nik89/CanOverhead, unit tests of CanFrame11Bit.
PUBLISHED = [
    (
        Frame(0x000),
        "0  000 01000 00100  0  0  01  0000  0100 00010 0000 10000  1  1  1  111 1111  111",
    ),
    (
        Frame(0x000, bytes(1)),
        "0  000 01000 00100  0  0  01  0001  0000 01000  100 0100 0010 0110  1  1  1  111 1111  111",
    ),
    (
        Frame(0x133, bytes.fromhex("FF 00 00 00 00 00 00 FF")),
        (
            "0  001 0011 0011  0  0  0  1000  1111 10111  0000 01000  00100 00010  00001 0000"
            "01000 00100  00010 00001  0000 01000  1111 10111  001 1000 0101 11110"
            "1  1  1  111 1111  111"
        ),
    ),
]

# Header, data and CRC without stuff bits: a frame recorded in a car, dominic-meads/CAN_2.0.
RECORDED = Frame(0x0C1, bytes.fromhex("40 01 08 75 00 00 00 00"))
RECORDED_BITS = (
    "0 00011000001 0 0 0 1000"
    "0100000000000001000010000111010100000000000000000000000000000000"
    "101101101000000"
)


def crc15_bits(bits: str) -> str:
    """ISO 11898-1, bit by bit."""
    crc = 0
    for bit in bits:
        invert = int(bit) ^ crc >> 14
        crc = (crc << 1 & 0x7FFF) ^ (0x4599 if invert else 0)
    return f"{crc:015b}"


def stuffed(bits: str) -> str:
    """ISO 11898-1, bit by bit: after five equal bits their complement, which counts as well."""
    sent = ""
    for bit in bits:
        sent += bit
        if sent[-5:] in ("00000", "11111"):
            sent += "1" if bit == "0" else "0"
    return sent


def bits_from_sof(frame: Frame) -> str:
    rtr = str(int(frame.remote))
    if frame.extended:
        identifier = f"{frame.can_id:029b}"
        head = f"0{identifier[:11]}11{identifier[11:]}{rtr}00"
    else:
        head = f"0{frame.can_id:011b}{rtr}00"
    bits = f"{head}{frame.dlc:04b}" + "".join(f"{byte:08b}" for byte in frame.data)
    return bits + crc15_bits(bits)


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    extended = draw(st.booleans())
    can_id = draw(st.integers(0, 0x1FFF_FFFF if extended else 0x7FF))
    if draw(st.booleans()):
        return Frame(can_id, remote=True, extended=extended, dlc=draw(st.integers(0, 8)))
    runs = st.lists(st.sampled_from([0x00, 0xFF, 0x0F, 0xF8, 0x83, 0x5A]), max_size=8).map(bytes)
    return Frame(can_id, draw(runs | st.binary(max_size=8)), extended=extended)


@pytest.mark.parametrize(("frame", "bits"), PUBLISHED, ids=str)
def test_bit_length_equals_the_published_frame(frame: Frame, bits: str) -> None:
    assert bit_length(frame) == len(bits.replace(" ", ""))


def test_bit_length_equals_a_frame_recorded_in_a_car() -> None:
    bits = RECORDED_BITS.replace(" ", "")
    assert bits_from_sof(RECORDED) == bits
    assert bit_length(RECORDED) == len(stuffed(bits)) + 13


@given(frames())
def test_bit_length_counts_each_bit_as_iso_11898_sends_it(frame: Frame) -> None:
    assert bit_length(frame) == len(stuffed(bits_from_sof(frame))) + 13


@pytest.mark.parametrize("first", ["1", "0"])
@pytest.mark.parametrize("length", range(45))
def test_runs_of_four_after_a_run_of_five_need_a_stuff_bit_each(first: str, length: int) -> None:
    other = "0" if first == "1" else "1"
    bits = (first + (first * 4 + other * 4) * 6)[:length]
    from_sof = bits if first == "0" else f"0{bits}"
    stuff_bits = _stuff_bits(int(from_sof or "0", 2), len(from_sof))
    assert stuff_bits == max(0, (length - 1) // 4)
    assert len(stuffed(from_sof)) == len(from_sof) + stuff_bits


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_bit_length_of_a_base_frame_lies_between_its_bounds(can_id: int, data: bytes) -> None:
    shortest = 47 + 8 * len(data)
    stuff_bits = bit_length(Frame(can_id, data)) - shortest
    assert 0 <= stuff_bits <= (33 + 8 * len(data)) // 4


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (Frame(0x605, bytes.fromhex("4018100100000000")), "605h 40 18 10 01 00 00 00 00"),
        (Frame(0x1B2, remote=True, dlc=8), "1B2h RTR dlc 8"),
        (Frame(0x080), "080h"),
        (Frame(0x18FF50E5, b"\x01", extended=True), "18FF50E5h 01"),
    ],
    ids=str,
)
def test_a_frame_prints_as_the_standard_does(frame: Frame, text: str) -> None:
    assert str(frame) == text


def test_the_dlc_follows_from_the_data() -> None:
    assert Frame(0x181, bytes(3)).dlc == 3
    assert Frame(0x181, bytes(3), dlc=3) == Frame(0x181, bytes(3))
    assert Frame(0x181, remote=True).dlc == 0


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Frame(0x800), "CAN-ID: expected 0h to 7FFh, got 800h"),
        (lambda: Frame(-1), "CAN-ID: expected 0h to 7FFh, got -1h"),
        (lambda: Frame(1 << 29, extended=True), "expected 0h to 1FFFFFFFh, got 20000000h"),
        (lambda: Frame(0x181, bytes(9)), r"got 9 \(00 00 00 00 00 00 00 00 00\)"),
        (lambda: Frame(0x181, b"\1", remote=True), r"expected 0 bytes, got 1 \(01\)"),
        (lambda: Frame(0x181, remote=True, dlc=9), "DLC of a remote frame: .* got 9h"),
        (lambda: Frame(0x181, b"\1", dlc=2), "DLC: expected 1 for 01, got 2"),
    ],
)
def test_a_frame_that_cannot_be_sent_is_refused(build: Callable[[], Frame], message: str) -> None:
    with pytest.raises(WireError, match=message):
        build()


def test_data_of_returns_the_data_of_the_expected_length() -> None:
    assert data_of("SYNC", Frame(0x80, b"\x07"), 0, 1) == b"\x07"


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (Frame(0x80, b"ab"), r"SYNC: expected 0 or 1 bytes, got 2 \(61 62\)"),
        (Frame(0x80, remote=True), "SYNC: expected a data frame with 11-bit CAN-ID, got 080h RTR"),
        (Frame(0x80, extended=True), "got 00000080h"),
    ],
    ids=str,
)
def test_data_of_refuses_any_other_frame(frame: Frame, message: str) -> None:
    with pytest.raises(WireError, match=message):
        data_of("SYNC", frame, 0, 1)


def test_arbitration_is_won_by_the_dominant_bit() -> None:
    base = 0x123 << 18
    in_order = [
        Frame(0x122, b""),
        Frame(0x123, b""),
        Frame(0x123, b"", remote=True),
        Frame(base, b"", extended=True),
        Frame(base, b"", extended=True, remote=True),
        Frame(base | 1, b"", extended=True),
        Frame(0x124, b""),
    ]

    frames = list(reversed(in_order))
    frames.sort(key=priority)

    assert frames == in_order
