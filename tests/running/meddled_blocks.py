"""Block transfers that the man in the middle answers himself, also where none was asked for."""

from __future__ import annotations

from collections.abc import Iterable

from meddling import Mischief

from conformance.wire import cob_id, sdo
from conformance.wire.frame import Frame

ENDLESS = 1 << 40
_SIZE_FOLLOWS = 0x02
_HAS_CRC = 0x04


class BlockTransfers(Mischief):
    """Carries out block transfers, each in a wrong way: never ending, of any size, out of sequence.

    What it does wrong is drawn once: the announced size, the segments per block, the number of
    segments, their sequence numbers, the CRC, the number of unused octets, or nothing.
    """

    prefers = "SDO-3"

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        draw = self.random.choice
        self._unasked_for = draw((0.0, 0.0, self.rate))
        self._announced = draw((0, 4, 10, 0x4000_0000, 0xFFFF_FFFF))
        self._block_sizes = [draw((0, 1, 20, 127, 128, 255)) for _ in range(2)]
        self._segments = draw((1, 2, 3, 500, ENDLESS))
        self._skips = draw((0, 0, 1, 126))
        self._unused = draw((0, 3, 7))
        self._acknowledged = draw((None, None, 0, 127, 255))
        self._left = 0
        self._wrong_crc = draw((0, 0, 0xFFFF))
        self._data = bytearray()
        self._size = 0
        self._downloading = False

    def hear(self, frame: Frame) -> Iterable[Frame]:
        if frame.can_id != cob_id.sdo_request(self.node_id) or len(frame.data) < 8:
            return (frame,)
        data = frame.data
        if self._downloading:
            return self._download(data, frame)
        command, sub_command = data[0] & 0xE0, data[0] & 0x03
        if command == 0xA0:
            return self._upload(sub_command, data)
        if command == 0xC0 and not sub_command & 1:
            self._reply(bytes((0xA4,)) + data[1:4] + bytes((self._block_sizes[0],)))
            self._downloading = True
            return ()
        if command == 0x40 and self.random.random() < self._unasked_for:
            self._begin(data)
            return ()
        return (frame,)

    def _upload(self, sub_command: int, data: bytes) -> Iterable[Frame]:
        if sub_command == 0:
            self._size = data[4]
            self._begin(data)
        elif sub_command == 3:
            self._block()
        elif sub_command == 2:
            self._size = data[2]
            self._block()
        return ()

    def _begin(self, data: bytes) -> None:
        self._left = self._segments
        self._data.clear()
        command = 0xC0 | _SIZE_FOLLOWS | _HAS_CRC
        self._reply(bytes((command,)) + data[1:4] + self._announced.to_bytes(4, "little"))

    def _block(self) -> None:
        """Send the segments of a block, or the end after the last one."""
        if not self._left:
            crc = sdo.crc16_ccitt(bytes(self._data)) ^ self._wrong_crc
            self._reply(bytes((0xC1 | self._unused << 2,)) + crc.to_bytes(2, "little"))
            return
        for sequence in range(1, min(self._size, 127) + 1):
            if not self._left:
                break
            self._left -= 1
            piece = self.random.randbytes(7)
            self._data += piece
            number = (sequence + self._skips) % 128
            self._reply(bytes((number | 0x80 * (self._left == 0),)) + piece)

    def _download(self, data: bytes, frame: Frame) -> Iterable[Frame]:
        """Confirm a block after its last segment, or any segment at all."""
        if data[0] == 0x80:
            self._downloading = False
            return (frame,)
        sequence, last = data[0] & 0x7F, data[0] & 0x80
        if data[0] & 0xE3 == 0xC1 and self._left:
            self._reply(bytes((0xA1,)))
            self._downloading, self._left = False, 0
        elif last or sequence >= self._block_sizes[0]:
            self._left = int(bool(last))
            shown = sequence if self._acknowledged is None else self._acknowledged
            self._reply(bytes((0xA2, shown, self._block_sizes[1])))
        return ()

    def _reply(self, data: bytes) -> None:
        self.count += 1
        self.replies.append(Frame(cob_id.sdo_response(self.node_id), data.ljust(8, b"\0")))
