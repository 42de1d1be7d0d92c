"""SDO transfers as judged: each step decoded from the frames on the wire (CiA 301 v4.2.0, 7.2.4)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from conformance.bench.bus.link import Stamped
from conformance.bench.node.channel import SdoChannel
from conformance.errors import NodeTimeout
from conformance.spec.model import DeviceSpec
from conformance.wire import sdo
from conformance.wire.abort import AbortCode, describe
from conformance.wire.errors import WireError

MOST_OCTETS = 100_000
SPARE_SEGMENTS = 1000
SEGMENTS_PER_OCTET = 0.3
"""A segment holds up to 7 octets (CiA 301 v4.2.0, 7.2.4.3.7); many more than needed do not end."""

MOST_OF_A_NUMBER = 1000
"""Octets of an object of a type that has 8 at most: enough to see that it does not end."""

MOST_IN_VAIN = 200_000
"""Segments of uploads that did not end; after so many no upload is begun any more."""

_UNUSED = b"\xff"


@dataclass(frozen=True, slots=True)
class Answer:
    """What came after one request.

    Args:
        sent: The request's frame.
        received: The first frame on the node's SDO response identifier, None for silence.
        response: The frame decoded, None when it is no SDO response.
        fault: Why there is no usable response.
    """

    sent: Stamped
    received: Stamped | None
    response: sdo.Response | None
    fault: str = ""

    @property
    def command(self) -> int | None:
        """The first octet of the response, None for silence or an empty frame."""
        return self.received.frame.data[0] if self.received and self.received.frame.data else None

    @property
    def code(self) -> int | None:
        """The abort code, None when the response is no abort."""
        return self.response.code if isinstance(self.response, sdo.Abort) else None

    def __str__(self) -> str:
        if self.code is not None:
            return f"abort {describe(self.code)}"
        return str(self.received.frame) if self.received else self.fault


@dataclass(frozen=True, slots=True)
class Transfer:
    """The outcome of an upload or download: confirmed, aborted by the node, or broken.

    Args:
        data: What was uploaded or downloaded, when confirmed.
        abort: The node's abort code.
        fault: Silence or a violation of the protocol, in words.
        answered: The node sent a response, whatever it was worth.
        expedited: The data came in the initiate response.
        sized: The upload said how many of its octets are data; an expedited one need not.
        announced: Octets announced by a segmented upload.
        partial: What came of an upload that did not end.
    """

    data: bytes | None = None
    abort: int | None = None
    fault: str = ""
    answered: bool = True
    expedited: bool = False
    sized: bool = True
    announced: int | None = None
    partial: bytes = b""

    @property
    def confirmed(self) -> bool:
        """The node confirmed the whole transfer."""
        return self.data is not None

    @property
    def refused(self) -> bool:
        """The node answered with an abort."""
        return self.abort is not None

    def __str__(self) -> str:
        if self.data is not None:
            return f"confirmed ({self.data.hex(' ').upper() or 'no data'})"
        if self.abort is not None:
            return f"abort {describe(self.abort)}"
        return self.fault


class SdoPort:
    """Speaks SDO with one node, step by step.

    Args:
        channel: The node's SDO server.
        spec: What the node is documented to have, where that is known.
    """

    def __init__(self, channel: SdoChannel, spec: DeviceSpec | None = None) -> None:
        self._channel = channel
        self._spec = spec

    def ask(self, request: sdo.Request | bytes, *, wait_s: float | None = None) -> Answer:
        """Send one request and wait for one response.

        Args:
            request: A message, or the frame's data as they are.
            wait_s: Longest wait where silence is as good; the bench's for SDO by default.
        """
        data = request if isinstance(request, bytes) else sdo.encode(request)
        sent = self._channel.send(data)
        return self._answer(sent, self._channel.timeout_s if wait_s is None else wait_s)

    def ask_at_once(self, *requests: sdo.Request) -> list[Answer]:
        """Send requests back to back and return the responses, one or more.

        The last one is silence, unless there were as many responses as requests.
        """
        sent = self._channel.send(*(sdo.encode(request) for request in requests))
        answers: list[Answer] = []
        while len(answers) < len(requests):
            answers.append(self._answer(sent, self._channel.timeout_s))
            if answers[-1].received is None:
                break
        return answers

    def ask_block(self, block: Sequence[bytes], *, last: bool) -> Answer:
        """Send the segments of a block, of up to 7 octets each, and wait for its confirmation."""
        count = len(block)
        frames = [
            sdo.encode(sdo.BlockSegment(n, last and n == count, data.ljust(7, b"\0")))
            for n, data in enumerate(block, 1)
        ]
        return self._answer(self._channel.send(*frames), self._channel.timeout_s)

    def _answer(self, sent: Stamped, wait_s: float) -> Answer:
        received = self._channel.receive(wait_s)
        if received is None:
            return Answer(sent, None, None, f"no response within {wait_s:g} s")
        try:
            return Answer(sent, received, sdo.decode_response(received.frame.data))
        except WireError as error:
            return Answer(sent, received, None, str(error))

    def upload(self, index: int, sub: int, *, most_octets: int = MOST_OCTETS) -> Transfer:
        """Upload an object and judge each step of the protocol.

        Args:
            index: Of the object.
            sub: Sub-index.
            most_octets: What is longer, or comes in many more segments than it needs, is aborted.

        Raises:
            NodeTimeout: Too many uploads did not end.
        """
        if self._channel.in_vain >= MOST_IN_VAIN:
            raise NodeTimeout(
                f"node {self._channel.node_id}: {self._channel.in_vain} segments of uploads that "
                "do not end"
            )
        entry = None if self._spec is None else self._spec.entry(index, sub)
        if entry is not None and entry.type.size is not None:
            most_octets = min(most_octets, MOST_OF_A_NUMBER)
        answer = self.ask(sdo.InitiateUpload(index, sub))
        reply = answer.response
        if not isinstance(reply, sdo.InitiateUploadReply):
            return self._ended(answer, index, sub, "an upload response")
        if (reply.index, reply.sub) != (index, sub):
            return self._wrong_object(answer)
        if reply.expedited:
            return Transfer(reply.data, expedited=True, sized=reply.size is not None)
        return self._segments(index, sub, reply.size, most_octets)

    def download(self, index: int, sub: int, data: bytes) -> Transfer:
        """Download to an object, expedited up to 4 octets."""
        if len(data) > 4 or not data:
            return self.download_segments(index, sub, data, len(data))
        answer = self.ask(sdo.InitiateDownload(index, sub, data))
        return self._acknowledged(answer, index, sub) or Transfer(data, expedited=True)

    def download_unsized(self, index: int, sub: int, data: bytes) -> Transfer:
        """Download expedited without telling how many of the four octets count."""
        answer = self.ask(sdo.InitiateDownload(index, sub, data.ljust(4, _UNUSED), size=None))
        return self._acknowledged(answer, index, sub) or Transfer(data, expedited=True)

    def abort(self, index: int, sub: int, code: int) -> None:
        """Abort the transfer in progress; no response is expected."""
        self._channel.send(sdo.encode(sdo.Abort(index, sub, code)))

    def _segments(self, index: int, sub: int, announced: int | None, most: int) -> Transfer:
        data = bytearray()
        toggle = False
        for count in itertools.count(1):
            answer = self.ask(sdo.UploadSegment(toggle))
            if not isinstance(answer.response, sdo.UploadSegmentReply):
                return self._ended(answer, None, None, "an upload segment")
            segment = answer.response
            if segment.toggle != toggle:
                return self._broken(f"toggle bit not alternated in segment {len(data) // 7 + 1}")
            data += segment.data
            if segment.last:
                break
            if len(data) >= most or count >= SPARE_SEGMENTS + len(data) * SEGMENTS_PER_OCTET:
                self._channel.in_vain += count
                self.abort(index, sub, AbortCode.OUT_OF_MEMORY)
                fault = f"upload still not complete after {len(data)} octets in {count} segments"
                return self._broken(fault, partial=bytes(data))
            toggle = not toggle
        if announced is not None and announced != len(data):
            return self._broken(f"{announced} octets announced, {len(data)} transferred")
        return Transfer(bytes(data), announced=announced)

    def download_segments(self, index: int, sub: int, data: bytes, size: int | None) -> Transfer:
        """Download in segments.

        Args:
            index: 0..FFFFh.
            sub: 0..FFh.
            data: What to write.
            size: Octets to announce, whatever is sent then; None for none.
        """
        answer = self.ask(sdo.InitiateDownload(index, sub, expedited=False, size=size))
        refused = self._acknowledged(answer, index, sub)
        if refused is not None:
            return refused
        toggle = False
        for start in range(0, max(len(data), 1), 7):
            last = start + 7 >= len(data)
            answer = self.ask(sdo.DownloadSegment(toggle, data[start : start + 7], last))
            if not isinstance(answer.response, sdo.DownloadSegmentAck):
                return self._ended(answer, index, sub, "a download segment response")
            if answer.response.toggle != toggle:
                return self._broken(f"toggle bit not alternated in segment {start // 7 + 1}")
            toggle = not toggle
        return Transfer(data)

    def _broken(self, fault: str, partial: bytes = b"") -> Transfer:
        """Return a transfer whose responses are proper ones alone, but not together."""
        self._channel.improper += 1
        return Transfer(fault=fault, partial=partial)

    def _acknowledged(self, answer: Answer, index: int, sub: int) -> Transfer | None:
        match answer.response:
            case sdo.InitiateDownloadAck(index=got, sub=got_sub):
                return None if (got, got_sub) == (index, sub) else self._wrong_object(answer)
            case _:
                return self._ended(answer, index, sub, "a download response")

    def _ended(self, answer: Answer, index: int | None, sub: int | None, wanted: str) -> Transfer:
        match answer.response:
            case sdo.Abort() as abort if index is None or (abort.index, abort.sub) == (index, sub):
                return Transfer(abort=abort.code)
            case sdo.Abort():
                return self._wrong_object(answer)
            case None:
                return Transfer(fault=answer.fault, answered=answer.received is not None)
            case _:
                return Transfer(fault=f"expected {wanted}, got {_bytes(answer)}")

    def _wrong_object(self, answer: Answer) -> Transfer:
        return Transfer(fault=f"answered for another object: {_bytes(answer)}")


def _bytes(answer: Answer) -> str:
    return str(answer.received.frame) if answer.received else "nothing"
