"""SDO block transfers as judged, frame by frame (CiA 301 v4.2.0, 7.2.4.3.8 to .16)."""

from __future__ import annotations

from conformance.bench.node.channel import SdoChannel
from conformance.bench.node.sdo import Answer, SdoPort, Transfer
from conformance.errors import SetupRefused
from conformance.wire import sdo
from conformance.wire.abort import AbortCode
from conformance.wire.errors import WireError

BLOCK_SIZE = 20
_SEGMENT = 7
_MOST_PER_BLOCK = 127
_MOST_SEGMENTS = 20_000


class BlockPort:
    """Speaks SDO block transfer with one node.

    Args:
        channel: The node's SDO server.
    """

    def __init__(self, channel: SdoChannel) -> None:
        self._channel = channel
        self._sdo = SdoPort(channel)

    def upload(
        self, index: int, sub: int, *, crc: bool = False, block_size: int = BLOCK_SIZE
    ) -> Transfer:
        """Upload an object in blocks and judge each step of the protocol.

        Args:
            index: 0..FFFFh.
            sub: 0..FFh.
            crc: Ask for a CRC.
            block_size: Segments per block, of which 1..127 are allowed.
        """
        transfer = self._upload(index, sub, crc=crc, block_size=block_size)
        return self._left_clean(index, sub, transfer)

    def _upload(self, index: int, sub: int, *, crc: bool, block_size: int) -> Transfer:
        answer = self._sdo.ask(sdo.BlockUploadInitiate(index, sub, crc, block_size))
        reply = answer.response
        if not isinstance(reply, sdo.BlockUploadInitiateReply):
            return _ended(answer, "a block upload response")
        if (reply.index, reply.sub) != (index, sub):
            return Transfer(fault=f"answered for another object: {answer}")
        if not 1 <= block_size <= _MOST_PER_BLOCK:
            return Transfer(fault=f"begun with blocks of {block_size} segments: {answer}")
        self._tell(sdo.BlockUploadStart())
        data = self._blocks(block_size)
        if isinstance(data, Transfer):
            return data
        return self._end_of_upload(data, reply, checked=crc and reply.crc)

    def upload_acknowledging(self, index: int, sub: int, sequence: int) -> Transfer:
        """Acknowledge a segment of a block upload that never came, and return how that ends.

        Raises:
            SetupRefused: The upload is neither begun nor aborted.
        """
        answer = self._sdo.ask(
            sdo.BlockUploadInitiate(index, sub, crc=False, block_size=BLOCK_SIZE)
        )
        if not isinstance(answer.response, sdo.BlockUploadInitiateReply):
            ended = self._left_clean(index, sub, _ended(answer, "a block upload response"))
            if ended.fault:
                raise SetupRefused(f"{ended}, see SDO-30")
            return ended
        self._tell(sdo.BlockUploadStart())
        for _ in range(BLOCK_SIZE):
            received = self._channel.receive()
            if received is None or _is_last(received.frame.data):
                break
        answer = self._sdo.ask(sdo.BlockUploadAck(sequence, BLOCK_SIZE))
        return self._left_clean(index, sub, _ended(answer, "an abort"))

    def _blocks(self, block_size: int) -> bytes | Transfer:
        data = bytearray()
        for count in range(_MOST_SEGMENTS):
            received = self._channel.receive()
            if received is None:
                return Transfer(fault="a segment is missing", answered=False)
            try:
                segment = sdo.decode_block_segment(received.frame.data)
            except WireError:
                return Transfer(fault=f"expected a segment of a block, got {received.frame}")
            expected = count % block_size + 1
            if segment.sequence != expected:
                return Transfer(fault=f"segment {segment.sequence} came instead of {expected}")
            data += segment.data7
            if segment.last:
                self._tell(sdo.BlockUploadAck(expected, block_size))
                return bytes(data)
            if expected == block_size:
                self._tell(sdo.BlockUploadAck(expected, block_size))
        self._channel.in_vain += _MOST_SEGMENTS
        return Transfer(fault=f"upload still not complete after {len(data)} octets")

    def _end_of_upload(
        self, data: bytes, begun: sdo.BlockUploadInitiateReply, *, checked: bool
    ) -> Transfer:
        received = self._channel.receive()
        if received is None:
            return Transfer(fault="the end of the upload is missing", answered=False)
        try:
            end = sdo.decode_response(received.frame.data)
        except WireError as error:
            return Transfer(fault=str(error))
        if not isinstance(end, sdo.BlockUploadEndReply):
            return Transfer(fault=f"expected the end of the upload, got {received.frame}")
        self._tell(sdo.BlockUploadEnd())
        data = data[: len(data) - end.unused]
        if begun.size not in (None, len(data)):
            return Transfer(fault=f"{begun.size} octets announced, {len(data)} transferred")
        if checked and end.crc != sdo.crc16_ccitt(data):
            return Transfer(fault=f"CRC {end.crc:04X}h, {sdo.crc16_ccitt(data):04X}h computed")
        return Transfer(data, announced=begun.size)

    def download(self, index: int, sub: int, data: bytes) -> Transfer:
        """Download to an object in blocks, with a CRC where the node computes one."""
        return self._left_clean(index, sub, self._download(index, sub, data))

    def _download(self, index: int, sub: int, data: bytes) -> Transfer:
        request = sdo.BlockDownloadInitiate(index, sub, crc=True, size=len(data))
        answer = self._sdo.ask(request)
        reply = answer.response
        if not isinstance(reply, sdo.BlockDownloadInitiateAck):
            return _ended(answer, "a block download response")
        if (reply.index, reply.sub) != (index, sub) or not 1 <= reply.block_size <= _MOST_PER_BLOCK:
            return Transfer(fault=f"no proper begin of a block download: {answer}")
        pieces = [data[start : start + _SEGMENT] for start in range(0, len(data), _SEGMENT)]
        block_size = reply.block_size
        while pieces:
            block, pieces = pieces[:block_size], pieces[block_size:]
            answer = self._sdo.ask_block(block, last=not pieces)
            ack = answer.response
            if not isinstance(ack, sdo.BlockDownloadSubAck) or ack.ack_sequence != len(block):
                return _ended(answer, f"the confirmation of {len(block)} segments")
            block_size = ack.block_size
            if pieces and not 1 <= block_size <= _MOST_PER_BLOCK:
                return Transfer(
                    fault=f"asked for {block_size} segments in the next block: {answer}"
                )
        unused = -len(data) % _SEGMENT
        crc = sdo.crc16_ccitt(data) if reply.crc else 0
        answer = self._sdo.ask(sdo.BlockDownloadEnd(unused, crc))
        if not isinstance(answer.response, sdo.BlockDownloadEndAck):
            return _ended(answer, "the confirmation of the download")
        return Transfer(data)

    def _left_clean(self, index: int, sub: int, transfer: Transfer) -> Transfer:
        """Abort a transfer that went wrong, so that the node does not wait for the rest of it."""
        if transfer.fault:
            self._sdo.abort(index, sub, AbortCode.GENERAL_ERROR)
        return transfer

    def _tell(self, request: sdo.Request) -> None:
        self._channel.send(sdo.encode(request))


def _ended(answer: Answer, wanted: str) -> Transfer:
    if answer.code is not None:
        return Transfer(abort=answer.code)
    answered = answer.received is not None
    return Transfer(fault=f"expected {wanted}, got {answer}", answered=answered)


def _is_last(data: bytes) -> bool:
    """Tell whether no segment follows: it was the last one, or it was none."""
    try:
        return sdo.decode_block_segment(data).last
    except WireError:
        return True
