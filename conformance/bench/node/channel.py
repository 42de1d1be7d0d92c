"""The SDO channel of one node: a request goes out, the next response on its identifier comes back."""

from __future__ import annotations

from conformance.bench.bus.link import Link, Stamped
from conformance.bench.node.response_times import ResponseTimes
from conformance.wire import cob_id
from conformance.wire.frame import Frame

LATE_S = 0.02
"""How long to wait for more responses of a node that sends what nobody asked for."""

WARY = 100
"""Before so many requests more such responses are waited for, after the last one."""


class SdoChannel:
    """One node's default SDO server (CiA 301 v4.2.0, 7.2.4.2).

    Responses that no request was waiting for are counted, never taken for an answer. An answer that
    cannot be meant for its request, or has not the 8 octets of every SDO message, is counted too.

    Args:
        link: The link to the bus.
        node_id: 1..127.
        timeout_s: Longest wait for each response.

    Attributes:
        request_id: The identifier of requests to the node.
        response_id: The identifier of its responses.
        unanswered: Requests of the set-up, which every node answers, without a response.
    """

    def __init__(self, link: Link, node_id: int, timeout_s: float) -> None:
        self._link = link
        self._place(node_id)
        self.timeout_s = timeout_s
        self._mark = link.mark()
        self._request = b""
        self._last_response: bytes | None = None
        self._repeats_before: bytes | None = None
        self._burst: tuple[bytes, ...] = ()
        self._in_block = False
        self.unsolicited = 0
        self._wary = 0
        self.improper = 0
        self.unanswered = 0
        self.in_vain = 0
        self.times = ResponseTimes()

    def _place(self, node_id: int) -> None:
        self.node_id = node_id
        self.request_id = cob_id.sdo_request(node_id)
        self.response_id = cob_id.sdo_response(node_id)

    def follow(self, node_id: int) -> None:
        """Speak with the node at another node-ID from now on."""
        self.settle()
        self._place(node_id)

    def is_response(self, frame: Frame) -> bool:
        """Tell whether a frame is on the node's SDO response identifier."""
        return frame.can_id == self.response_id and not frame.extended and not frame.remote

    def send(self, data: bytes, *more: bytes) -> Stamped:
        """Send a request as it is, after taking note of responses that came unasked.

        Args:
            data: The request.
            more: Requests that follow without waiting for a response.
        """
        self.settle()
        self._repeats_before = self._last_response if data != self._request else None
        self._request = data
        self._burst = (data, *more)
        self._in_block = _is_of_block(data, begun=self._in_block)
        sent = self._link.send(Frame(self.request_id, data))
        self.times.sent(data, sent.time_s)
        self._mark = self._link.mark()
        for self._request in more:
            self._link.send(Frame(self.request_id, self._request))
        return sent

    def receive(self, wait_s: float | None = None) -> Stamped | None:
        """Return the next response, None for silence.

        The response to the request before may come twice, the second time after this request was
        sent; that repetition answers nobody.

        Args:
            wait_s: Longest wait; the bench's for SDO by default.
        """
        deadline = self._link.now() + (self.timeout_s if wait_s is None else wait_s)
        while True:
            received = self._link.wait_until(self.is_response, deadline, self._mark)
            self._mark = self._link.mark() if received is None else received.place + 1
            if received is None or not self._is_repetition(received.frame.data):
                break
            self.unsolicited += 1
            self._wary = WARY
        self._last_response = received.frame.data if received else None
        if received is not None:
            self.times.received(received.time_s)
            self.improper += self._is_improper(received.frame.data)
        return received

    def _is_improper(self, data: bytes) -> bool:
        if len(data) != _OCTETS:
            return True
        return not self._in_block and not any(_fits(request, data) for request in self._burst)

    def _is_repetition(self, data: bytes) -> bool:
        if data != self._repeats_before:
            return False
        return not _fits(self._request, data)

    def begin(self) -> None:
        """Start anew: after the link forgot its frames, or after what came was judged otherwise."""
        self._mark = self._link.mark()

    def settle(self) -> None:
        """Take in what has arrived and count the responses nobody asked for.

        Once there was one, more is waited for, so that it is not taken for the next answer.
        """
        if self._wary:
            self._wary -= 1
            self._link.listen(LATE_S, self.is_response)
        else:
            self._link.drain()
        unasked = len(self._link.since(self._mark, self.is_response))
        self.unsolicited += unasked
        self._wary = WARY if unasked else self._wary
        self._mark = self._link.mark()


_ANSWERED_BY = {0: 1, 1: 3, 2: 2, 3: 0}
"""Server command specifier by client command specifier (CiA 301 v4.2.0, 7.2.4.3)."""
_INITIATES = (1, 2)
_BLOCKS = (5, 6)
_ABORT = 4
_ABORTS = 0x80
_OCTETS = 8
_NAMES_OBJECT = 4
"""Octets of the shortest frame that names an object."""


def _is_of_block(request: bytes, *, begun: bool) -> bool:
    """Tell whether a request belongs to a block transfer, where segments have no command specifier."""
    if not request or request[0] == _ABORTS:
        return False
    return request[0] >> 5 in _BLOCKS or (begun and request[0] >> 5 not in _INITIATES)


def _fits(request: bytes, response: bytes) -> bool:
    """Tell whether a response can be meant for a request: its kind, and the object it names.

    Nothing can be told by a request too short for that.
    """
    if not response:
        return False
    if len(request) < _NAMES_OBJECT:
        return True
    asked, answered = request[0] >> 5, response[0] >> 5
    same_object = request[1:4] == response[1:4]
    if asked in _INITIATES:
        return same_object and answered in (_ANSWERED_BY[asked], _ABORT)
    if asked in _BLOCKS:
        return same_object or answered in (*_BLOCKS, _ABORT)
    return answered in (_ANSWERED_BY.get(asked), _ABORT)
