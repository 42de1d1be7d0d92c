"""PDO mapping entries and the bits they lay out (CiA 301 v4.2.0, 7.5.2.36 and 7.5.2.38).

Fields follow each other from bit 0 of byte 0 upwards, each with its least significant bit first.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from conformance.wire.errors import WireError
from conformance.wire.guard import check_range
from conformance.wire.notation import hex32, hex_bytes


@dataclass(frozen=True, slots=True)
class MappingEntry:
    """One mapped object: index, sub-index and length in bits, all up to FFh or FFFFh."""

    index: int
    sub: int
    bits: int

    def __post_init__(self) -> None:
        check_range("mapped index", self.index, 0, 0xFFFF)
        check_range("mapped sub-index", self.sub, 0, 0xFF)
        check_range("mapped length", self.bits, 0, 0xFF)

    @classmethod
    def from_word(cls, word: int) -> Self:
        """Decode an UNSIGNED32 such as 3010 0110h: 3010h:01, 16 bits."""
        check_range("mapping entry", word, 0, 0xFFFF_FFFF)
        return cls(word >> 16, word >> 8 & 0xFF, word & 0xFF)

    def to_word(self) -> int:
        """Encode as UNSIGNED32."""
        return self.index << 16 | self.sub << 8 | self.bits

    def __str__(self) -> str:
        return hex32(self.to_word())


def pack(fields: Sequence[tuple[int, int]]) -> bytes:
    """Return the PDO of `fields`, each an unsigned raw value and its length in bits.

    Raises:
        WireError: A value exceeds its length, or the sum exceeds 64 bits.
    """
    _check_total([bits for _, bits in fields], 64)
    word = position = 0
    for value, bits in fields:
        check_range(f"PDO field of {bits} bits", value, 0, (1 << bits) - 1)
        word |= value << position
        position += bits
    return word.to_bytes((position + 7) // 8, "little")


def unpack(data: bytes, bits: Sequence[int]) -> tuple[int, ...]:
    """Return the unsigned raw values of the fields of a PDO; bytes behind the last are ignored.

    Args:
        data: 0 to 8 bytes.
        bits: Length of each field in bits.

    Raises:
        WireError: `data` is shorter than the fields, or longer than 8 bytes.
    """
    if len(data) > 8:
        raise WireError(f"PDO: expected at most 8 bytes, got {len(data)} ({hex_bytes(data)})")
    _check_total(bits, 8 * len(data))
    word = int.from_bytes(data, "little")
    values = []
    for width in bits:
        values.append(word & (1 << width) - 1)
        word >>= width
    return tuple(values)


def _check_total(lengths: Sequence[int], available: int) -> None:
    for length in lengths:
        check_range("length of a PDO field", length, 1, 64)
    if sum(lengths) > available:
        raise WireError(f"PDO: expected at most {available} bits, got {sum(lengths)} in fields")
