"""SDO exchanges in a recording: which response belongs to which request (CiA 301 v4.2.0, 7.2.4.3).

A recorder can lose frames and write them in another order. What such a recording shows of SDO is told by
a response that nothing asked for, a request that is not answered, or one that comes while another
waits. All exchanges near such a place, without a pause or a start of the node between, are no evidence.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from conformance.judging.recording import Recording, Seen
from conformance.wire import sdo
from conformance.wire.cob_id import heartbeat, sdo_request, sdo_response
from conformance.wire.errors import WireError

PAUSE_S = 0.2
"""What parts one stretch of SDO traffic from the next."""

BLOCKS = (
    sdo.BlockDownloadInitiate,
    sdo.BlockDownloadEnd,
    sdo.BlockUploadInitiate,
    sdo.BlockUploadStart,
    sdo.BlockUploadAck,
    sdo.BlockUploadEnd,
)


@dataclass(slots=True)
class Exchange:
    """One transfer that was seen from its request to its end.

    Attributes:
        kind: From the node, or to it.
        data: What was carried; None if it was aborted, or not all of it was seen.
        abort: The node's abort code; None without one.
        toggles: Each response of a segment had the toggle bit of its request.
        announced: Octets that the node announced; None without.
        expedited: All in one frame.
        reply: The last response.
        parts: What was carried so far.
        toggle: Toggle bit of the last request.
        ends: The last segment was downloaded.
        sized: An expedited transfer says how many octets it has.
        clean: Nothing nearby tells of frames that are missing or out of order.
    """

    kind: Literal["upload", "download"]
    index: int
    sub: int
    first: Seen
    last: Seen
    data: bytes | None = None
    abort: int | None = None
    toggles: bool = True
    announced: int | None = None
    expedited: bool = True
    reply: bytes = b""
    clean: bool = False
    parts: bytearray = field(default_factory=bytearray)
    toggle: bool = False
    ends: bool = False
    sized: bool = True

    @property
    def key(self) -> tuple[int, int]:
        """Index and sub-index."""
        return self.index, self.sub

    @property
    def confirmed(self) -> bool:
        """It ended without an abort."""
        return self.abort is None


@dataclass(frozen=True, slots=True)
class Unanswered:
    """Requests in a row to which no response came.

    Args:
        first: Line of the first.
        last: Line of the last.
        reads: They ask for uploads alone.
    """

    first: int
    last: int
    reads: bool


@dataclass(slots=True)
class _Stretch:
    done: list[Exchange] = field(default_factory=list)
    current: Exchange | None = None
    waiting: list[Seen] = field(default_factory=list)
    irregular: bool = False
    blocks: bool = False
    broken: int = 0
    ended_s: float = 0.0

    @property
    def disturbed(self) -> bool:
        """What it shows is no evidence."""
        return self.irregular or bool(self.waiting)

    def close(self) -> Iterator[Exchange]:
        """Return what was seen, each exchange with what it is worth."""
        regular = not (self.disturbed or self.blocks)
        for exchange in self.done:
            exchange.clean = regular
            yield exchange

    def unanswered(self) -> Iterator[Unanswered]:
        """Return the requests without response, where they alone disturb it."""
        if self.waiting and not self.irregular:
            reads = all(_reads(it) for it in self.waiting)
            yield Unanswered(self.waiting[0].line, self.waiting[-1].line, reads)


@dataclass(slots=True)
class Exchanges:
    """What a recording shows of the SDO server of a node.

    Attributes:
        all: In the order in which they ended.
        improper: Responses that no server gives, whatever was asked.
        disturbed: Stretches that are no evidence.
        unanswered: The requests that alone make a stretch so.
    """

    all: list[Exchange] = field(default_factory=list)
    improper: int = 0
    disturbed: int = 0
    unanswered: list[Unanswered] = field(default_factory=list)


def exchanges(recording: Recording, node_id: int) -> Exchanges:
    """Return the SDO exchanges of one node."""
    found, stretch = Exchanges(), _Stretch()
    breaks = iter((*recording.breaks, len(recording.seen) + 2))
    upcoming = next(breaks)
    for seen in recording.seen:
        broken = seen.line >= upcoming
        while seen.line >= upcoming:
            upcoming = next(breaks)
        frame = seen.frame
        is_request = frame.can_id == sdo_request(node_id)
        if broken:
            stretch.irregular = True
        if frame.remote or frame.extended:
            continue
        if frame.can_id == heartbeat(node_id) and frame.data == b"\0":
            _end(stretch, found)
            stretch = _Stretch()
            continue
        if not is_request and frame.can_id != sdo_response(node_id):
            continue
        if broken or seen.time_s - stretch.ended_s > PAUSE_S:
            _end(stretch, found)
            stretch = _Stretch(irregular=broken)
        stretch.ended_s = seen.time_s
        if is_request:
            _request(stretch, seen)
        else:
            _response(stretch, seen)
    _end(stretch, found)
    return found


def _end(stretch: _Stretch, found: Exchanges) -> None:
    found.all += stretch.close()
    found.disturbed += stretch.disturbed
    found.unanswered += stretch.unanswered()
    found.improper += 0 if stretch.blocks else stretch.broken


def _request(stretch: _Stretch, seen: Seen) -> None:
    try:
        request = sdo.decode_request(seen.frame.data)
    except WireError:
        stretch.irregular = True
        return
    current = stretch.current
    begun = current is not None and not stretch.waiting
    match request:
        case sdo.Abort():
            stretch.current = None
            return
        case sdo.InitiateUpload(index, sub):
            stretch.irregular |= begun
            stretch.current = Exchange("upload", index, sub, seen, seen)
        case sdo.InitiateDownload():
            stretch.irregular |= begun
            made = Exchange("download", request.index, request.sub, seen, seen)
            made.expedited, made.sized = request.expedited, request.size is not None
            made.parts += request.data
            stretch.current = made
        case sdo.UploadSegment(toggle) if current is not None and current.kind == "upload":
            current.toggle = toggle
        case sdo.DownloadSegment() if current is not None and current.kind == "download":
            current.toggle, current.ends = request.toggle, request.last
            current.parts += request.data
        case _ if isinstance(request, BLOCKS):
            stretch.blocks = True
        case _:
            stretch.irregular = True
    stretch.waiting.append(seen)


def _response(stretch: _Stretch, seen: Seen) -> None:
    current, awaited = stretch.current, len(stretch.waiting)
    stretch.waiting.clear()
    try:
        response = sdo.decode_response(seen.frame.data)
    except WireError:
        stretch.irregular = True
        stretch.broken += awaited > 0
        return
    if current is None or not awaited:
        stretch.irregular = True
        return
    stretch.irregular |= awaited > 1
    current.last, current.reply = seen, seen.frame.data
    done = _take(current, response)
    if done is None:
        stretch.irregular = True
    if done is not False:
        stretch.current = None
    if done:
        stretch.done.append(current)


def _reads(request: Seen) -> bool:
    return isinstance(sdo.decode_request(request.frame.data), sdo.InitiateUpload)


def _take(current: Exchange, response: sdo.Response) -> bool | None:
    """Take a response into an exchange; return whether it ends it, None if it is none of its own."""
    named = (getattr(response, "index", current.index), getattr(response, "sub", current.sub))
    if named != current.key:
        return None
    ends: bool | None = None
    match response:
        case sdo.Abort():
            current.abort, ends = response.code, True
        case sdo.InitiateUploadReply() if current.kind == "upload":
            current.expedited, current.announced = response.expedited, response.size
            current.sized = response.size is not None or not response.expedited
            current.data = response.data if response.expedited else None
            ends = response.expedited
        case sdo.UploadSegmentReply() if current.kind == "upload" and not current.expedited:
            current.parts += response.data
            current.toggles &= response.toggle == current.toggle
            current.data = bytes(current.parts) if response.last else None
            ends = response.last
        case sdo.InitiateDownloadAck() if current.kind == "download":
            current.data = bytes(current.parts) if current.expedited else None
            ends = current.expedited
        case sdo.DownloadSegmentAck() if current.kind == "download" and not current.expedited:
            current.toggles &= response.toggle == current.toggle
            current.data = bytes(current.parts) if current.ends else None
            ends = current.ends
        case _:
            pass
    return ends
