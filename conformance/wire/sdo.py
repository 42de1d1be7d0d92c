"""SDO requests and responses, 8 bytes each (CiA 301 v4.2.0, 7.2.4.3).

The command byte alone does not tell a request from a response, nor a segment of a block from
either, so the receiver says by its choice of function what it waits for.
"""

import struct
from typing import Final, TypeAlias

from conformance.wire.errors import WireError
from conformance.wire.guard import check_length
from conformance.wire.notation import hex_bytes
from conformance.wire.sdo_block import (
    BlockDownloadEnd,
    BlockDownloadEndAck,
    BlockDownloadInitiate,
    BlockDownloadInitiateAck,
    BlockDownloadSubAck,
    BlockSegment,
    BlockUploadAck,
    BlockUploadEnd,
    BlockUploadEndReply,
    BlockUploadInitiate,
    BlockUploadInitiateReply,
    BlockUploadStart,
    crc16_ccitt,
)
from conformance.wire.sdo_transfer import (
    Abort,
    DownloadSegment,
    DownloadSegmentAck,
    InitiateDownload,
    InitiateDownloadAck,
    InitiateUpload,
    InitiateUploadReply,
    UploadSegment,
    UploadSegmentReply,
)

__all__ = [
    "Abort",
    "BlockDownloadEnd",
    "BlockDownloadEndAck",
    "BlockDownloadInitiate",
    "BlockDownloadInitiateAck",
    "BlockDownloadSubAck",
    "BlockSegment",
    "BlockUploadAck",
    "BlockUploadEnd",
    "BlockUploadEndReply",
    "BlockUploadInitiate",
    "BlockUploadInitiateReply",
    "BlockUploadStart",
    "DownloadSegment",
    "DownloadSegmentAck",
    "InitiateDownload",
    "InitiateDownloadAck",
    "InitiateUpload",
    "InitiateUploadReply",
    "Request",
    "Response",
    "UploadSegment",
    "UploadSegmentReply",
    "crc16_ccitt",
    "decode_block_segment",
    "decode_request",
    "decode_response",
    "encode",
]

Request: TypeAlias = (
    InitiateDownload
    | DownloadSegment
    | InitiateUpload
    | UploadSegment
    | BlockDownloadInitiate
    | BlockDownloadEnd
    | BlockUploadInitiate
    | BlockUploadStart
    | BlockUploadAck
    | BlockUploadEnd
    | Abort
)
Response: TypeAlias = (
    InitiateDownloadAck
    | DownloadSegmentAck
    | InitiateUploadReply
    | UploadSegmentReply
    | BlockDownloadInitiateAck
    | BlockDownloadSubAck
    | BlockDownloadEndAck
    | BlockUploadInitiateReply
    | BlockUploadEndReply
    | Abort
)

# By command specifier and subcommand, all other bits of the command byte cleared.
_REQUESTS: Final[dict[int, type[Request]]] = {
    0x00: DownloadSegment,
    0x20: InitiateDownload,
    0x40: InitiateUpload,
    0x60: UploadSegment,
    0x80: Abort,
    0xA0: BlockUploadInitiate,
    0xA1: BlockUploadEnd,
    0xA2: BlockUploadAck,
    0xA3: BlockUploadStart,
    0xC0: BlockDownloadInitiate,
    0xC1: BlockDownloadEnd,
}
_RESPONSES: Final[dict[int, type[Response]]] = {
    0x00: UploadSegmentReply,
    0x20: DownloadSegmentAck,
    0x40: InitiateUploadReply,
    0x60: InitiateDownloadAck,
    0x80: Abort,
    0xA0: BlockDownloadInitiateAck,
    0xA1: BlockDownloadEndAck,
    0xA2: BlockDownloadSubAck,
    0xC0: BlockUploadInitiateReply,
    0xC1: BlockUploadEndReply,
}
_SUBCOMMAND_MASK: Final = {0xA0: 0xE3, 0xC0: 0xE1}


def encode(message: Request | Response | BlockSegment) -> bytes:
    """Return the 8 bytes of `message`.

    Raises:
        WireError: A value does not fit its field.
    """
    try:
        return message.to_bytes()
    except WireError:
        raise
    except (struct.error, ValueError) as error:
        raise WireError(f"expected values that fit their fields, got {message}: {error}") from error


def decode_request(data: bytes) -> Request:
    """Return the message from client to server in `data`.

    Raises:
        WireError: Not 8 bytes, or an unknown command specifier.
    """
    kind = _REQUESTS.get(_command("SDO request", data))
    if kind is None:
        raise WireError(f"SDO request: expected a known command, got {hex_bytes(data)}")
    return kind.from_bytes(data)


def decode_response(data: bytes) -> Response:
    """Return the message from server to client in `data`.

    Raises:
        WireError: Not 8 bytes, or an unknown command specifier.
    """
    kind = _RESPONSES.get(_command("SDO response", data))
    if kind is None:
        raise WireError(f"SDO response: expected a known command, got {hex_bytes(data)}")
    return kind.from_bytes(data)


def decode_block_segment(data: bytes) -> BlockSegment:
    """Return the segment in `data`, to be used while a block is under way.

    Raises:
        WireError: Not 8 bytes, or sequence number 0, as in an abort.
    """
    check_length("SDO block segment", data, 8)
    return BlockSegment.from_bytes(data)


def _command(what: str, data: bytes) -> int:
    if len(data) != 8:
        check_length(what, data, 8)
    return data[0] & _SUBCOMMAND_MASK.get(data[0] & 0xE0, 0xE0)
