"""SDO messages of block transfers (CiA 301 v4.2.0, 7.2.4.3.8 to .16).

Upload and download mirror each other, so each layout is written once. Reserved bits and bytes are
sent as 0 and ignored on reception. A block size or sequence number that the standard forbids but
the field holds is carried: to judge it is the peer's part.
"""

import struct
from binascii import crc_hqx
from dataclasses import dataclass
from typing import ClassVar, Final, Self

from conformance.wire.guard import check_length, check_range

_CRC_SUPPORTED: Final = 0x04
_SIZE_INDICATED: Final = 0x02
_LAST: Final = 0x80

_WITH_SIZE: Final = struct.Struct("<BHBI")
_WITH_TWO_BYTES: Final = struct.Struct("<BHBBBxx")
_WITH_CRC: Final = struct.Struct("<BH5x")


def crc16_ccitt(data: bytes) -> int:
    """Return the CRC of a block transfer: x^16 + x^12 + x^5 + 1, initial value 0 (7.2.4.3.16)."""
    return crc_hqx(data, 0)


@dataclass(frozen=True, slots=True)
class _Announcement:
    """Start by the side that sends the data.

    Attributes:
        index: UNSIGNED16.
        sub: UNSIGNED8.
        crc: The sender can compute a CRC.
        size: Bytes to come, None if not announced.
    """

    index: int
    sub: int
    crc: bool
    size: int | None

    def to_bytes(self) -> bytes:
        flags = _CRC_SUPPORTED * self.crc | _SIZE_INDICATED * (self.size is not None)
        return _WITH_SIZE.pack(0xC0 | flags, self.index, self.sub, self.size or 0)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        command, index, sub, size = _WITH_SIZE.unpack(data)
        sized = bool(command & _SIZE_INDICATED)
        return cls(index, sub, bool(command & _CRC_SUPPORTED), size if sized else None)


class BlockDownloadInitiate(_Announcement):
    """Client: write an object in blocks."""

    __slots__ = ()


class BlockUploadInitiateReply(_Announcement):
    """Server: the object will be read in blocks."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class BlockUploadInitiate:
    """Client: read an object in blocks.

    Attributes:
        index: UNSIGNED16.
        sub: UNSIGNED8.
        crc: The client can compute a CRC.
        block_size: Segments per block, 1 to 127 allowed.
        protocol_switch_threshold: Up to this size in bytes the server may change the protocol;
            0 forbids it.
    """

    index: int
    sub: int
    crc: bool
    block_size: int
    protocol_switch_threshold: int = 0

    def to_bytes(self) -> bytes:
        """Encode in 8 bytes."""
        command = 0xA0 | _CRC_SUPPORTED * self.crc
        threshold = self.protocol_switch_threshold
        return _WITH_TWO_BYTES.pack(command, self.index, self.sub, self.block_size, threshold)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Decode 8 bytes of this kind."""
        command, index, sub, block_size, threshold = _WITH_TWO_BYTES.unpack(data)
        return cls(index, sub, bool(command & _CRC_SUPPORTED), block_size, threshold)


@dataclass(frozen=True, slots=True)
class BlockDownloadInitiateAck:
    """Server: the object may be written in blocks of `block_size` segments, 1 to 127 allowed."""

    index: int
    sub: int
    crc: bool
    block_size: int

    def to_bytes(self) -> bytes:
        """Encode in 8 bytes."""
        command = 0xA0 | _CRC_SUPPORTED * self.crc
        return _WITH_TWO_BYTES.pack(command, self.index, self.sub, self.block_size, 0)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Decode 8 bytes of this kind."""
        command, index, sub, block_size, _ = _WITH_TWO_BYTES.unpack(data)
        return cls(index, sub, bool(command & _CRC_SUPPORTED), block_size)


@dataclass(frozen=True, slots=True)
class _BlockReceived:
    """A block's end by the side that receives the data.

    Attributes:
        ack_sequence: Last segment received in sequence; 0 asks for the whole block again.
        block_size: Segments in the next block, 1 to 127 allowed.
    """

    ack_sequence: int
    block_size: int

    def to_bytes(self) -> bytes:
        return bytes((0xA2, self.ack_sequence, self.block_size, *bytes(5)))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        return cls(data[1], data[2])


class BlockUploadAck(_BlockReceived):
    """Client: segments of a block received."""

    __slots__ = ()


class BlockDownloadSubAck(_BlockReceived):
    """Server: segments of a block received."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class _LastBlockSent:
    """End by the side that sends the data.

    Attributes:
        unused: Bytes of the last segment that are no data, 0 to 7.
        crc: CRC of all data, 0 unless both sides support it.
    """

    unused: int
    crc: int

    def to_bytes(self) -> bytes:
        check_range("unused bytes in the last block segment", self.unused, 0, 7)
        return _WITH_CRC.pack(0xC1 | self.unused << 2, self.crc)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        command, crc = _WITH_CRC.unpack(data)
        return cls(command >> 2 & 7, crc)


class BlockDownloadEnd(_LastBlockSent):
    """Client: all data sent."""

    __slots__ = ()


class BlockUploadEndReply(_LastBlockSent):
    """Server: all data sent."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class _CommandOnly:
    _command: ClassVar[int]

    def to_bytes(self) -> bytes:
        return bytes((self._command, *bytes(7)))

    @classmethod
    def from_bytes(cls, _data: bytes) -> Self:
        return cls()


class BlockUploadStart(_CommandOnly):
    """Client: begin to send segments."""

    __slots__ = ()
    _command = 0xA3


class BlockUploadEnd(_CommandOnly):
    """Client: upload complete."""

    __slots__ = ()
    _command = 0xA1


class BlockDownloadEndAck(_CommandOnly):
    """Server: download complete."""

    __slots__ = ()
    _command = 0xA1


@dataclass(frozen=True, slots=True)
class BlockSegment:
    """One segment of a block, in either direction.

    Attributes:
        sequence: 1 to 127.
        last: No more segments follow.
        data7: 7 bytes; how many of the last segment are data is said at the end of the transfer.
    """

    sequence: int
    last: bool
    data7: bytes

    def __post_init__(self) -> None:
        # 0 would make the last segment's first byte that of an abort, 80h.
        check_range("sequence number of block segment", self.sequence, 1, 127)
        check_length("data of block segment", self.data7, 7)

    def to_bytes(self) -> bytes:
        """Encode in 8 bytes."""
        return bytes((_LAST * self.last | self.sequence,)) + self.data7

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Decode 8 bytes of this kind."""
        return cls(data[0] & 0x7F, bool(data[0] & _LAST), data[1:])
