"""A classical CAN frame and its length on the bus (ISO 11898-1, CAN 2.0 A and B)."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from conformance.wire.errors import WireError
from conformance.wire.guard import check_length, check_range
from conformance.wire.notation import hex_bytes, hex_can_id

_BASE_ID_MAX: Final = 0x7FF
_EXTENDED_ID_MAX: Final = 0x1FFF_FFFF
_UNSTUFFED_BITS: Final = 1 + 2 + 7 + 3
"""CRC delimiter, ACK slot and delimiter, end of frame, intermission."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One data or remote frame.

    Attributes:
        can_id: 11-bit identifier, or 29-bit if `extended`.
        data: 0 to 8 bytes; empty in a remote frame.
        remote: True for a remote transmission request.
        extended: True for the 29-bit format.
        dlc: Data length code, 0 to 8. Follows from `data` in a data frame; 0 by default in a
            remote frame.
    """

    can_id: int
    data: bytes = b""
    remote: bool = False
    extended: bool = False
    dlc: int = -1

    def __post_init__(self) -> None:
        most = _EXTENDED_ID_MAX if self.extended else _BASE_ID_MAX
        if not 0 <= self.can_id <= most:
            check_range("CAN-ID", self.can_id, 0, most)
        length = len(self.data)
        if self.dlc == -1:
            object.__setattr__(self, "dlc", length)
        if self.remote:
            check_length("CAN data field", self.data, 0)
            check_range("DLC of a remote frame", self.dlc, 0, 8)
        elif not length == self.dlc <= 8:
            check_length("CAN data field", self.data, *range(9))
            raise WireError(
                f"DLC: expected {len(self.data)} for {hex_bytes(self.data)}, got {self.dlc}",
            )

    def __str__(self) -> str:
        name = hex_can_id(self.can_id, extended=self.extended)
        if self.remote:
            return f"{name} RTR dlc {self.dlc}"
        return f"{name} {hex_bytes(self.data)}" if self.data else name


def data_of(what: str, frame: Frame, *lengths: int) -> bytes:
    """Return the data of `frame`.

    Raises:
        WireError: It is a remote or extended frame, or has none of the `lengths` (bytes).
    """
    if frame.remote or frame.extended:
        raise WireError(f"{what}: expected a data frame with 11-bit CAN-ID, got {frame}")
    check_length(what, frame.data, *lengths)
    return frame.data


def priority(frame: Frame) -> tuple[int, int, int, int]:
    """Return what decides arbitration, lowest first: identifier, RTR or SRR, IDE, extension."""
    if frame.extended:
        return frame.can_id >> 18, 1, 1, (frame.can_id & 0x3_FFFF) << 1 | frame.remote
    return frame.can_id, int(frame.remote), 0, 0


@lru_cache(maxsize=4096)
def bit_length(frame: Frame) -> int:
    """Return the bit times `frame` takes on the bus, with its stuff bits and the intermission."""
    header, width = _header(frame)
    content = header << 8 * len(frame.data) | int.from_bytes(frame.data, "big")
    width += 8 * len(frame.data) + 15
    return width + _stuff_bits(content << 15 | _crc15(content), width) + _UNSTUFFED_BITS


def _header(frame: Frame) -> tuple[int, int]:
    """Return the bits from SOF to DLC and their number."""
    tail = frame.remote << 6 | frame.dlc  # RTR, two dominant bits (IDE r0, or r1 r0), DLC
    if not frame.extended:
        return frame.can_id << 7 | tail, 19
    base, extension = frame.can_id >> 18, frame.can_id & 0x3_FFFF
    return base << 27 | 0b11 << 25 | extension << 7 | tail, 39  # recessive SRR and IDE


def _crc15_step(remainder: int) -> int:
    for _ in range(8):
        remainder = remainder << 1 ^ (0x4599 if remainder & 0x4000 else 0)
    return remainder & 0x7FFF


_CRC15_TABLE: Final = tuple(_crc15_step(byte << 7) for byte in range(256))


def _crc15(bits: int) -> int:
    """Return the CRC sequence; leading zeros, SOF too, leave it unchanged."""
    crc = 0
    for byte in bits.to_bytes((bits.bit_length() + 7) // 8, "big"):
        crc = crc << 8 & 0x7FFF ^ _CRC15_TABLE[crc >> 7 ^ byte]
    return crc


def _stuffing_step(state: int, byte: int) -> int:
    """Return 8 * stuff bits + new state; a state is 4 * last bit + equal bits so far - 1."""
    stuffed, last, run = 0, state >> 2, (state & 3) + 1
    for place in range(7, -1, -1):
        bit = byte >> place & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed, last, run = stuffed + 1, 1 - bit, 1
    return stuffed << 3 | last << 2 | run - 1


_STUFFING_TABLE: Final = tuple(
    _stuffing_step(state, byte) for state in range(8) for byte in range(256)
)
_ALTERNATING: Final = 0b010101
"""Before SOF, up to a whole byte: bits that stuff nothing."""


def _stuff_bits(bits: int, width: int) -> int:
    """Return how many stuff bits a sequence gets that begins with SOF."""
    more = -width % 8
    padded = (_ALTERNATING & (1 << more) - 1) << width | bits
    stuffed, state = 0, 4
    for byte in padded.to_bytes((width + more) // 8, "big"):
        step = _STUFFING_TABLE[state << 8 | byte]
        stuffed += step >> 3
        state = step & 7
    return stuffed
