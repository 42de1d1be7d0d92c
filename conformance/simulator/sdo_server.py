"""SDO server: expedited and segmented transfers, and block transfers where offered (CiA 301 v4.2.0, 7.2.4)."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

from conformance.simulator.node import Node
from conformance.simulator.rejection import SdoAbortError
from conformance.simulator.sdo_block import BlockTransfer
from conformance.spec.document import SdoServer as SdoServerSpec
from conformance.spec.model import Key
from conformance.wire import cob_id, sdo
from conformance.wire.abort import AbortCode
from conformance.wire.datatypes import DataType
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtState

ANSWER_NS = 300_000
"""From the end of a request to its answer being handed to the CAN controller."""

BUSY_NS = 2_000_000
"""What a server needs in addition whose answers wait for each other."""

_LATE_NS = 1_000_000_000
"""How late an answer of a defective server comes."""

_SEGMENT = 7
_INITIATES = (0x20, 0x40)
_ABORT = 0x80
_BLOCK = (0xA0, 0xC0)
_UNKNOWN = 0xE0


@dataclass(slots=True)
class _Upload:
    key: Key
    data: bytes
    sent: int = 0
    toggle: bool = False


@dataclass(slots=True)
class _Download:
    key: Key
    size: int | None
    data: bytearray = field(default_factory=bytearray)
    toggle: bool = False


class SdoServer:
    """The default SDO server of a node; one transfer at a time."""

    def __init__(self, node: Node, spec: SdoServerSpec | None) -> None:
        self._node = node
        self._spec = spec
        self._faults = node.faults
        self._transfer: _Upload | _Download | None = None
        self._answers: deque[tuple[int, bytes]] = deque()
        self._timer = node.agenda.timer(self._send_due)
        self._delay_ns = ANSWER_NS + round(self._faults.sdo_answer_delay_ms * 1e6)
        self._count = 0
        self._hung = False
        self._habits = node.faults.sdo_habits
        self._heard = b""
        self._block = BlockTransfer(node.dictionary, self._habits)
        if "mixes-answers" in self._habits:
            self._delay_ns += BUSY_NS

    def silence(self) -> None:
        """Drop the transfer and the answers not sent yet, as in Stopped."""
        self._transfer = None
        self._block.end()
        self._answers.clear()
        self._timer.stop()

    def receive(self, data: bytes) -> None:
        """Handle the data of a frame from the SDO client."""
        if self._node.state is NmtState.STOPPED and not self._faults.sdo_answers_in_stopped:
            return
        if len(data) < 8:
            self._hung = self._hung or "hangs-after-short" in self._habits
            if not self._faults.sdo_answers_short_requests:
                return
            data = data.ljust(8, b"\0")
        self._heard = data
        if self._ignores(data[0] & 0xE0):
            return
        if self._transfer is not None and data[0] & 0xE0 in _INITIATES:
            if "sticks-to-transfer" in self._habits:
                return
            self._interrupt()
        try:
            for answer in self._answers_to(data):
                self._queue(sdo.encode(answer))
        except SdoAbortError as error:
            if "refuses-silently" not in self._habits:
                self._queue(sdo.encode(self._abort(data, error.code)))
            self._transfer = None
            self._block.end()

    def _answers_to(self, data: bytes) -> Iterable[sdo.Response | sdo.BlockSegment]:
        if self._block.takes(data[0]):
            return self._block.receive(data)
        self._block.end()
        answer = self._handle(data)
        return () if answer is None else (answer,)

    def _ignores(self, command: int) -> bool:
        if self._faults.sdo_hangs_after_abort:
            self._hung = self._hung or command == _ABORT
        unknown = self._faults.sdo_unknown_command_ignored and command == _UNKNOWN
        block = self._faults.sdo_block_ignored and command in _BLOCK
        return self._hung or unknown or block

    def _handle(self, data: bytes) -> sdo.Response | None:
        try:
            request = sdo.decode_request(data)
        except WireError as error:
            raise SdoAbortError(AbortCode.UNKNOWN_COMMAND_SPECIFIER) from error
        if self._faults.sdo_abort_all and not isinstance(request, sdo.Abort):
            raise SdoAbortError(AbortCode.GENERAL_ERROR)
        if isinstance(request, sdo.InitiateUpload):
            return self._start_upload((request.index, request.sub))
        if isinstance(request, sdo.InitiateDownload):
            return self._start_download((request.index, request.sub), request)
        if isinstance(request, sdo.UploadSegment):
            return self._upload_segment(request)
        if isinstance(request, sdo.DownloadSegment):
            return self._download_segment(request)
        if isinstance(request, sdo.Abort):
            return self._end(request)
        return self._begin_block(request)

    def _begin_block(self, request: sdo.Request) -> sdo.Response:
        offered = self._spec is not None and self._spec.block
        if offered and isinstance(request, sdo.BlockUploadInitiate):
            return self._block.begin_upload(request)
        if offered and isinstance(request, sdo.BlockDownloadInitiate):
            return self._block.begin_download(request)
        raise SdoAbortError(AbortCode.UNKNOWN_COMMAND_SPECIFIER)

    def _end(self, request: sdo.Abort) -> sdo.Response | None:
        """End the transfer, as the client wants it."""
        if "ignores-client-abort" not in self._habits:
            self._transfer = None
        return request if "answers-client-abort" in self._habits else None

    def _interrupt(self) -> None:
        """Drop the transfer for a new one."""
        download, self._transfer = self._transfer, None
        if isinstance(download, _Download) and "stores-interrupted" in self._habits:
            entry = self._node.dictionary.entries[download.key]
            octets = self._node.dictionary.most_octets(download.key)
            data = bytes(download.data).ljust(octets, b"\0")
            self._node.dictionary.set(download.key, entry.type.decode(data))

    def _start_upload(self, key: Key) -> sdo.Response:
        self._transfer = None
        data = self._in_order(key, self._node.dictionary.upload(key))
        if 1 <= len(data) <= 4 and not self._comes_in_segments(key):
            size = len(data) if self._tells_size(key) else None
            return sdo.InitiateUploadReply(*key, data, size=size)
        self._transfer = _Upload(key, data)
        size = len(data) + self._faults.sdo_size_wrong
        return sdo.InitiateUploadReply(*key, expedited=False, size=size)

    def _in_order(self, key: Key, data: bytes) -> bytes:
        """Return octets as they go over the bus: of a number the least significant one first."""
        entry = self._node.dictionary.entries.get(key)
        is_number = entry is not None and entry.type.is_integer
        return data[::-1] if is_number and "swaps-octets" in self._habits else data

    def _comes_in_segments(self, key: Key) -> bool:
        entry = self._node.dictionary.entries.get(key)
        is_text = entry is not None and entry.type is DataType.VISIBLE_STRING
        return is_text and self._spec is not None and self._spec.short_texts == "segmented"

    def _tells_size(self, key: Key) -> bool:
        entry = self._node.dictionary.entries.get(key)
        is_number = entry is not None and entry.type.size is not None
        untold = self._spec is not None and self._spec.upload_size == "untold"
        return not (is_number and untold)

    def _upload_segment(self, request: sdo.UploadSegment) -> sdo.Response:
        upload = self._transfer
        if not isinstance(upload, _Upload):
            if "serves-idle-segments" in self._habits:
                return sdo.UploadSegmentReply(request.toggle, b"", last=True)
            raise SdoAbortError(AbortCode.UNKNOWN_COMMAND_SPECIFIER)
        self._check_toggle(upload, toggle=request.toggle)
        data = upload.data[upload.sent : upload.sent + _SEGMENT]
        upload.sent += len(data)
        last = upload.sent == len(upload.data) and not self._faults.sdo_never_ends
        if last:
            self._transfer = None
        toggle = request.toggle and not self._faults.sdo_toggle_stuck
        return sdo.UploadSegmentReply(toggle, data, last)

    def _start_download(self, key: Key, request: sdo.InitiateDownload) -> sdo.Response:
        self._transfer = None
        dictionary = self._node.dictionary
        if "confirms-unknown" in self._habits and key not in dictionary.entries:
            return sdo.InitiateDownloadAck(*key)
        if request.expedited:
            self._download_at_once(key, request)
        else:
            if self._spec is not None and not self._spec.segmented_download:
                raise SdoAbortError(AbortCode.UNSUPPORTED_ACCESS)
            dictionary.accept(key, request.size)
            self._transfer = _Download(key, request.size)
        return sdo.InitiateDownloadAck(*key)

    def _download_at_once(self, key: Key, request: sdo.InitiateDownload) -> None:
        data, unsized = request.data, request.size is None
        if unsized and self._spec is not None and self._spec.unsized_download == "refused":
            raise SdoAbortError(AbortCode.UNKNOWN_COMMAND_SPECIFIER)
        if unsized and "shifts-unsized" in self._habits:
            data = data[1:] + data[:1]
        self._node.dictionary.download(key, self._in_order(key, data), padded=unsized)

    def _download_segment(self, request: sdo.DownloadSegment) -> sdo.Response:
        download = self._transfer
        if not isinstance(download, _Download):
            if "serves-idle-segments" in self._habits:
                return sdo.DownloadSegmentAck(request.toggle)
            raise SdoAbortError(AbortCode.UNKNOWN_COMMAND_SPECIFIER)
        self._check_toggle(download, toggle=request.toggle)
        download.data += request.data
        octets = self._node.dictionary.most_octets(download.key)
        if "takes-any-total" in self._habits and request.last:
            download.data = download.data[:octets].ljust(octets, b"\0")
            download.size = octets
        if len(download.data) > octets:
            raise SdoAbortError(AbortCode.LENGTH_TOO_HIGH)
        if request.last:
            if download.size not in (None, len(download.data)):
                raise SdoAbortError(AbortCode.LENGTH_MISMATCH)
            if "drops-segments" not in self._habits:
                self._node.dictionary.download(download.key, bytes(download.data))
            self._transfer = None
        return sdo.DownloadSegmentAck(request.toggle and not self._faults.sdo_toggle_stuck)

    def _check_toggle(self, transfer: _Upload | _Download, *, toggle: bool) -> None:
        if toggle != transfer.toggle and not self._faults.sdo_ignores_toggle:
            raise SdoAbortError(AbortCode.TOGGLE_BIT_NOT_ALTERNATED)
        transfer.toggle = not toggle

    def _abort(self, data: bytes, code: AbortCode) -> sdo.Abort:
        """Return the abort of the request in ``data``, or of the transfer that its segment is of."""
        if self._faults.sdo_wrong_abort_code:
            code = AbortCode.OUT_OF_MEMORY
        index, sub = int.from_bytes(data[1:3], "little"), data[3]
        if self._transfer is not None and data[0] & 0xE0 in (0x00, 0x60):
            index, sub = self._transfer.key
        if self._block.key is not None:
            index, sub = self._block.key
        return sdo.Abort(index, sub, code)

    def _queue(self, data: bytes) -> None:
        self._count += 1
        every = self._faults.sdo_loses_every
        if every is not None and self._count % every == 0:
            return
        data = self._spoil(data)
        if "mixes-answers" in self._habits:
            self._answers = deque((at, it[:4] + data[4:]) for at, it in self._answers)
        due_ns = self._node.agenda.now_ns + self._delay_ns
        every = self._faults.sdo_delays_every
        if every is not None and self._count % every == 0:
            self._node.agenda.after(_LATE_NS, partial(self._send, data))
            return
        self._answers.append((due_ns, data))
        if self._faults.sdo_answers_twice:
            self._answers.append((due_ns, data))
        if self._timer.due_ns is None:
            self._timer.start(due_ns)

    def _spoil(self, data: bytes) -> bytes:
        command = data[0] & 0xE0
        if self._faults.sdo_abort_byte_order and command == 0x80:
            data = data[:4] + data[:3:-1]
        if self._faults.sdo_answers_wrong_sub and command in (0x40, 0x60):
            data = data[:3] + bytes(((data[3] + 1) & 0xFF,)) + data[4:]
        if "tells-next-index" in self._habits and command in (0x40, 0x60):
            data = data[:1] + bytes(((data[1] + 1) & 0xFF,)) + data[2:]
        if "echoes-data" in self._habits and command == 0x60:
            data = data[:4] + self._heard[4:]
        if "tells-four-octets" in self._habits and data[0] & 0xE3 == 0x43:
            data = b"\x43" + data[1:]
        return data

    def _send_due(self, due_ns: int) -> None:
        answers = self._answers
        while answers and answers[0][0] <= due_ns:
            self._send(answers.popleft()[1])
        if answers:
            self._timer.start(answers[0][0])

    def _send(self, data: bytes) -> None:
        if "cuts-answers" in self._habits:
            data = data[:4] + data[4:].rstrip(b"\0")
        self._node.send(Frame(cob_id.sdo_response(self._node.node_id), data))
