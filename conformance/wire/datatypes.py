"""Data types and their encoding, little-endian (CiA 301 v4.2.0, 7.1 and 7.4.7)."""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar, Final, Protocol, TypeAlias

from conformance.wire.errors import WireError
from conformance.wire.guard import check_length
from conformance.wire.notation import hex_bytes

Value: TypeAlias = bool | int | float | str | bytes


class DataType(IntEnum):
    """A data type by its index in the object dictionary (CiA 301 v4.2.0, 7.4.7)."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    UNICODE_STRING = 0x0B
    TIME_OF_DAY = 0x0C
    TIME_DIFFERENCE = 0x0D
    DOMAIN = 0x0F
    INTEGER24 = 0x10
    REAL64 = 0x11
    INTEGER40 = 0x12
    INTEGER48 = 0x13
    INTEGER56 = 0x14
    INTEGER64 = 0x15
    UNSIGNED24 = 0x16
    UNSIGNED40 = 0x18
    UNSIGNED48 = 0x19
    UNSIGNED56 = 0x1A
    UNSIGNED64 = 0x1B

    @property
    def bits(self) -> int | None:
        """Width in a PDO; None for a type of variable length."""
        return _CODECS[self].bits

    @property
    def size(self) -> int | None:
        """Bytes in an SDO; None for a type of variable length."""
        return None if self.bits is None else (self.bits + 7) // 8

    @property
    def is_integer(self) -> bool:
        """True for INTEGERn and UNSIGNEDn."""
        return isinstance(_CODECS[self], _Integer)

    @property
    def minimum(self) -> int:
        """Smallest value of an integer type."""
        return self._integer().minimum

    @property
    def maximum(self) -> int:
        """Largest value of an integer type."""
        return self._integer().maximum

    def encode(self, value: Value) -> bytes:
        """Return `value` as an SDO carries it.

        Raises:
            WireError: `value` is of another kind or out of range.
        """
        return _CODECS[self].encode(self.name, value)

    def decode(self, data: bytes) -> Value:
        """Return the value of `data` as an SDO carries it.

        TIME_OF_DAY, TIME_DIFFERENCE, OCTET_STRING and DOMAIN stay bytes.

        Raises:
            WireError: `data` has the wrong length or a content the type excludes.
        """
        if self.size is not None:
            check_length(self.name, data, self.size)
        return _CODECS[self].decode(self.name, data)

    def _integer(self) -> "_Integer":
        codec = _CODECS[self]
        if not isinstance(codec, _Integer):
            raise WireError(f"{self.name}: expected an integer type, which alone has limits")
        return codec


class _Codec(Protocol):
    @property
    def bits(self) -> int | None: ...
    def encode(self, name: str, value: Value) -> bytes: ...
    def decode(self, name: str, data: bytes) -> Value: ...


class _Boolean:
    bits: ClassVar[int | None] = 1

    def encode(self, name: str, value: Value) -> bytes:
        if value not in (0, 1):
            raise WireError(f"{name}: expected 0 or 1, got {value!r}")
        return b"\1" if value else b"\0"

    def decode(self, name: str, data: bytes) -> Value:
        if data[0] > 1:
            raise WireError(f"{name}: expected 00 or 01, got {hex_bytes(data)}")
        return data == b"\1"


@dataclass(frozen=True, slots=True)
class _Integer:
    bits: int
    signed: bool

    @property
    def minimum(self) -> int:
        return -(1 << self.bits - 1) if self.signed else 0

    @property
    def maximum(self) -> int:
        return (1 << self.bits - self.signed) - 1

    def encode(self, name: str, value: Value) -> bytes:
        try:
            if type(value) is int:
                return value.to_bytes(self.bits // 8, "little", signed=self.signed)
        except OverflowError:
            pass  # said below
        raise WireError(
            f"{name}: expected an integer {self.minimum} to {self.maximum}, got {value!r}",
        )

    def decode(self, _name: str, data: bytes) -> Value:
        return int.from_bytes(data, "little", signed=self.signed)


@dataclass(frozen=True, slots=True)
class _Real:
    bits: int
    layout: str

    def encode(self, name: str, value: Value) -> bytes:
        if isinstance(value, (bool, str, bytes)):
            raise WireError(f"{name}: expected a number, got {value!r}")
        try:
            return struct.pack(self.layout, value)
        except (OverflowError, struct.error) as error:  # the latter from an int beyond a double
            raise WireError(f"{name}: expected {self.bits} bits to suffice, got {value}") from error

    def decode(self, _name: str, data: bytes) -> Value:
        (value,) = struct.unpack(self.layout, data)
        return float(value)


class _VisibleString:
    bits: ClassVar[int | None] = None

    def encode(self, name: str, value: Value) -> bytes:
        if not isinstance(value, str) or not _is_visible(value):
            raise WireError(
                f"{name}: expected text of characters 00h and 20h to 7Eh, got {value!r}"
            )
        return value.encode("ascii")

    def decode(self, name: str, data: bytes) -> Value:
        text = data.decode("latin-1")
        if not _is_visible(text):
            raise WireError(f"{name}: expected bytes 00h and 20h to 7Eh, got {hex_bytes(data)}")
        return text


def _is_visible(text: str) -> bool:
    """Tell whether all are VISIBLE_CHAR: 00h and 20h to 7Eh (CiA 301 v4.2.0, 7.1.6.1)."""
    return all(character == "\0" or " " <= character <= "~" for character in text)


class _UnicodeString:
    bits: ClassVar[int | None] = None

    def encode(self, name: str, value: Value) -> bytes:
        if not isinstance(value, str):
            raise WireError(f"{name}: expected text, got {value!r}")
        try:
            return value.encode("utf-16-le")
        except UnicodeEncodeError as error:
            raise WireError(f"{name}: expected Unicode text, got {value!r}") from error

    def decode(self, name: str, data: bytes) -> Value:
        try:
            return data.decode("utf-16-le")
        except UnicodeDecodeError as error:
            raise WireError(f"{name}: expected UTF-16, got {hex_bytes(data)}") from error


@dataclass(frozen=True, slots=True)
class _Octets:
    bits: int | None = None

    def encode(self, name: str, value: Value) -> bytes:
        if not isinstance(value, bytes):
            raise WireError(f"{name}: expected bytes, got {value!r}")
        if self.bits is not None:
            check_length(name, value, self.bits // 8)
        return value

    def decode(self, _name: str, data: bytes) -> Value:
        return data


_CODECS: Final[dict[DataType, _Codec]] = {
    DataType.BOOLEAN: _Boolean(),
    DataType.REAL32: _Real(32, "<f"),
    DataType.REAL64: _Real(64, "<d"),
    DataType.VISIBLE_STRING: _VisibleString(),
    DataType.OCTET_STRING: _Octets(),
    DataType.UNICODE_STRING: _UnicodeString(),
    DataType.TIME_OF_DAY: _Octets(48),
    DataType.TIME_DIFFERENCE: _Octets(48),
    DataType.DOMAIN: _Octets(),
    **{DataType[f"INTEGER{bits}"]: _Integer(bits, signed=True) for bits in range(8, 65, 8)},
    **{DataType[f"UNSIGNED{bits}"]: _Integer(bits, signed=False) for bits in range(8, 65, 8)},
}
