"""Block transfers of the SDO server (CiA 301 v4.2.0, 7.2.4.3.8 to .16)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from conformance.simulator.dictionary import ObjectDictionary
from conformance.simulator.knobs.sdo import SdoHabit
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.model import Key
from conformance.wire import sdo
from conformance.wire.abort import AbortCode
from conformance.wire.errors import WireError

BLOCK_SIZE = 127
_SEGMENT = 7
_ABORT = 0x80


@dataclass(slots=True)
class _Upload:
    key: Key
    data: bytes
    block_size: int
    confirmed: int = 0
    ended: bool = False


@dataclass(slots=True)
class _Download:
    key: Key
    size: int | None
    data: bytearray = field(default_factory=bytearray)
    sequence: int = 0
    complete: bool = False


class BlockTransfer:
    """One block transfer at a time, from its second request on; the first one begins it."""

    def __init__(self, dictionary: ObjectDictionary, habits: Sequence[SdoHabit]) -> None:
        self._dictionary = dictionary
        self._habits = habits
        self._transfer: _Upload | _Download | None = None

    def end(self) -> None:
        """Drop the transfer."""
        self._transfer = None

    @property
    def key(self) -> Key | None:
        """The object of the transfer under way."""
        return self._transfer.key if self._transfer is not None else None

    def takes(self, command: int) -> bool:
        """Tell whether a frame with this first octet belongs to the transfer under way."""
        if isinstance(self._transfer, _Download):
            return not self._transfer.complete or command & 0xE0 == 0xC0
        return self._transfer is not None and command & 0xE0 == 0xA0 and command & 3 != 0

    def begin_upload(self, request: sdo.BlockUploadInitiate) -> sdo.Response:
        """Begin to send an object.

        Raises:
            SdoAbortError: It cannot be read, or not in such blocks.
        """
        key = request.index, request.sub
        data = self._dictionary.upload(key)
        allowed = 1 <= request.block_size <= BLOCK_SIZE
        if not allowed and "takes-any-block-size" not in self._habits:
            raise SdoAbortError(AbortCode.INVALID_BLOCK_SIZE)
        self._transfer = _Upload(key, data, request.block_size)
        return sdo.BlockUploadInitiateReply(*key, crc=True, size=len(data))

    def begin_download(self, request: sdo.BlockDownloadInitiate) -> sdo.Response:
        """Begin to receive an object.

        Raises:
            SdoAbortError: It cannot be written, or not with so many octets.
        """
        key = request.index, request.sub
        self._dictionary.accept(key, request.size)
        self._transfer = _Download(key, request.size)
        return sdo.BlockDownloadInitiateAck(*key, crc=True, block_size=BLOCK_SIZE)

    def receive(self, data: bytes) -> Iterator[sdo.Response | sdo.BlockSegment]:
        """Handle the next frame of the transfer.

        Raises:
            SdoAbortError: The transfer cannot go on.
        """
        transfer = self._transfer
        if isinstance(transfer, _Download) and not transfer.complete:
            yield from self._segment(transfer, data)
            return
        try:
            request = sdo.decode_request(data)
        except WireError as error:
            raise SdoAbortError(AbortCode.UNKNOWN_COMMAND_SPECIFIER) from error
        match transfer, request:
            case _Upload(ended=False), sdo.BlockUploadStart():
                yield from self._block(transfer)
            case _Upload(ended=False), sdo.BlockUploadAck():
                yield from self._confirmed(transfer, request)
            case _Upload(ended=True), sdo.BlockUploadEnd():
                self._transfer = None
            case _Download(complete=True), sdo.BlockDownloadEnd():
                yield self._store(transfer, request)
            case _:
                raise SdoAbortError(AbortCode.UNKNOWN_COMMAND_SPECIFIER)

    def _block(self, upload: _Upload) -> Iterator[sdo.BlockSegment]:
        rest = upload.data[upload.confirmed :]
        for sequence in range(1, upload.block_size + 1):
            piece, rest = rest[:_SEGMENT], rest[_SEGMENT:]
            yield sdo.BlockSegment(sequence, not rest, piece.ljust(_SEGMENT, b"\0"))
            if not rest:
                return

    def _confirmed(
        self, upload: _Upload, request: sdo.BlockUploadAck
    ) -> Iterator[sdo.Response | sdo.BlockSegment]:
        unchecked = "takes-any-block-size" in self._habits
        if request.ack_sequence > upload.block_size and not unchecked:
            raise SdoAbortError(AbortCode.INVALID_SEQUENCE_NUMBER)
        if not 1 <= request.block_size <= BLOCK_SIZE:
            raise SdoAbortError(AbortCode.INVALID_BLOCK_SIZE)
        upload.confirmed += request.ack_sequence * _SEGMENT
        upload.block_size = request.block_size
        if upload.confirmed < len(upload.data):
            yield from self._block(upload)
            return
        upload.ended = True
        crc = sdo.crc16_ccitt(upload.data) ^ ("wrong-crc" in self._habits)
        yield sdo.BlockUploadEndReply(-len(upload.data) % _SEGMENT, crc)

    def _segment(self, download: _Download, data: bytes) -> Iterator[sdo.Response]:
        if data[0] == _ABORT:
            self._transfer = None
            return
        segment = sdo.decode_block_segment(data)
        if segment.sequence != download.sequence + 1:
            raise SdoAbortError(AbortCode.INVALID_SEQUENCE_NUMBER)
        download.sequence += 1
        download.data += segment.data7
        download.complete = segment.last
        if len(download.data) >= self._dictionary.most_octets(download.key) + _SEGMENT:
            raise SdoAbortError(AbortCode.LENGTH_TOO_HIGH)
        if segment.last or segment.sequence == BLOCK_SIZE:
            download.sequence = 0
            yield sdo.BlockDownloadSubAck(segment.sequence, BLOCK_SIZE)

    def _store(self, download: _Download, end: sdo.BlockDownloadEnd) -> sdo.Response:
        data = bytes(download.data[: len(download.data) - end.unused])
        if download.size not in (None, len(data)):
            raise SdoAbortError(AbortCode.LENGTH_MISMATCH)
        if end.crc != sdo.crc16_ccitt(data):
            raise SdoAbortError(AbortCode.CRC_ERROR)
        self._dictionary.download(download.key, data)
        self._transfer = None
        return sdo.BlockDownloadEndAck()
