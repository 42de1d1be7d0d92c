"""SDO messages of expedited and segmented transfers, and abort (CiA 301 v4.2.0, 7.2.4.3.2 to .7, .17).

Upload and download mirror each other, so each layout is written once. Reserved bits and bytes are
sent as 0 and ignored on reception; so is n where e and s do not make it valid.
"""

import struct
from dataclasses import dataclass
from typing import ClassVar, Final, Self

from conformance.wire.errors import WireError
from conformance.wire.guard import check_length

_MULTIPLEXER: Final = struct.Struct("<BHB4x")
"""Command byte, index, sub-index, 4 reserved bytes."""

_WITH_WORD: Final = struct.Struct("<BHBI")
_TOGGLE: Final = 0x10


@dataclass(frozen=True, slots=True)
class _Initiate:
    """Start of a transfer with the data (expedited) or their size (segmented).

    Attributes:
        index: UNSIGNED16.
        sub: UNSIGNED8.
        data: 1 to 4 bytes if expedited, else none.
        expedited: The data are in this message.
        size: Bytes announced, None if not. An expedited transfer announces `len(data)` by default;
            if None, its data are filled up to 4 bytes, for no receiver can tell them apart.
    """

    _command: ClassVar[int]

    index: int
    sub: int
    data: bytes = b""
    expedited: bool = True
    size: int | None = -1

    def __post_init__(self) -> None:
        if not self.expedited:
            check_length("segmented SDO initiate", self.data, 0)
            if self.size == -1:
                object.__setattr__(self, "size", None)
            return
        length = len(self.data)
        if not 1 <= length <= 4:
            check_length("expedited SDO", self.data, 1, 2, 3, 4)
        if self.size is None:
            object.__setattr__(self, "data", self.data.ljust(4, b"\0"))
        elif self.size == -1:
            object.__setattr__(self, "size", length)
        elif self.size != length:
            raise WireError(f"expedited SDO: expected size {length}, got {self.size}")

    def to_bytes(self) -> bytes:
        if self.expedited:
            unused = 0 if self.size is None else 4 - len(self.data)
            word = int.from_bytes(self.data, "little")
        else:
            unused, word = 0, self.size or 0
        flags = unused << 2 | self.expedited << 1 | (self.size is not None)
        return _WITH_WORD.pack(self._command | flags, self.index, self.sub, word)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        command, index, sub, word = _WITH_WORD.unpack(data)
        expedited, sized = bool(command & 2), bool(command & 1)
        if not expedited:
            return cls(index, sub, b"", expedited=False, size=word if sized else None)
        size = 4 - (command >> 2 & 3) if sized else None
        return cls(index, sub, data[4 : 4 + (size or 4)], expedited=True, size=size)


class InitiateDownload(_Initiate):
    """Client: write an object, its data in this message or in segments."""

    __slots__ = ()
    _command = 0x20


class InitiateUploadReply(_Initiate):
    """Server: an object's data, or the announcement of segments."""

    __slots__ = ()
    _command = 0x40


@dataclass(frozen=True, slots=True)
class _Segment:
    """One segment.

    Attributes:
        toggle: False in the first segment, then alternating.
        data: 0 to 7 bytes.
        last: No more segments follow.
    """

    toggle: bool
    data: bytes
    last: bool

    def to_bytes(self) -> bytes:
        check_length("SDO segment", self.data, *range(8))
        command = _TOGGLE * self.toggle | 7 - len(self.data) << 1 | self.last
        return bytes((command,)) + self.data.ljust(7, b"\0")

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        command = data[0]
        return cls(bool(command & _TOGGLE), data[1 : 8 - (command >> 1 & 7)], bool(command & 1))


class DownloadSegment(_Segment):
    """Client: the next bytes to write."""

    __slots__ = ()


class UploadSegmentReply(_Segment):
    """Server: the next bytes read."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class _Multiplexed:
    """Nothing but the object's index and sub-index."""

    _command: ClassVar[int]

    index: int
    sub: int

    def to_bytes(self) -> bytes:
        return _MULTIPLEXER.pack(self._command, self.index, self.sub)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        _, index, sub = _MULTIPLEXER.unpack(data)
        return cls(index, sub)


class InitiateUpload(_Multiplexed):
    """Client: read an object."""

    __slots__ = ()
    _command = 0x40


class InitiateDownloadAck(_Multiplexed):
    """Server: the object is written, or segments may follow."""

    __slots__ = ()
    _command = 0x60


@dataclass(frozen=True, slots=True)
class _Toggled:
    """Nothing but the toggle bit of the segment asked for or confirmed."""

    _command: ClassVar[int]

    toggle: bool

    def to_bytes(self) -> bytes:
        return bytes((self._command | _TOGGLE * self.toggle, *bytes(7)))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        return cls(bool(data[0] & _TOGGLE))


class UploadSegment(_Toggled):
    """Client: ask for the next segment."""

    __slots__ = ()
    _command = 0x60


class DownloadSegmentAck(_Toggled):
    """Server: segment received."""

    __slots__ = ()
    _command = 0x20


@dataclass(frozen=True, slots=True)
class Abort:
    """Client or server: end the transfer.

    Attributes:
        index: UNSIGNED16.
        sub: UNSIGNED8.
        code: UNSIGNED32, an AbortCode or any other.
    """

    index: int
    sub: int
    code: int

    def to_bytes(self) -> bytes:
        """Encode in 8 bytes."""
        return _WITH_WORD.pack(0x80, self.index, self.sub, self.code)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Decode 8 bytes of this kind."""
        _, index, sub, code = _WITH_WORD.unpack(data)
        return cls(index, sub, code)
