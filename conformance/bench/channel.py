"""The SDO channel of one node: a request goes out, the next response on its identifier comes back."""

from __future__ import annotations

from conformance.bench.link import Link, Stamped
from conformance.wire import cob_id
from conformance.wire.frame import Frame


class SdoChannel:
    """One node's default SDO server (CiA 301 v4.2.0, 7.2.4.2).

    Responses that no request was waiting for are counted, never taken for an answer.

    Args:
        link: The link to the bus.
        node_id: 1..127.
        timeout_s: Longest wait for each response.
    """

    def __init__(self, link: Link, node_id: int, timeout_s: float) -> None:
        self._link = link
        self.node_id = node_id
        self.timeout_s = timeout_s
        self.request_id = cob_id.sdo_request(node_id)
        self.response_id = cob_id.sdo_response(node_id)
        self._mark = link.mark()
        self.unsolicited = 0

    def is_response(self, frame: Frame) -> bool:
        """Tell whether a frame is on the node's SDO response identifier."""
        return frame.can_id == self.response_id and not frame.extended and not frame.remote

    def send(self, data: bytes) -> Stamped:
        """Send a request as it is, after taking note of responses that came unasked."""
        self.settle()
        sent = self._link.send(Frame(self.request_id, data))
        self._mark = self._link.mark()
        return sent

    def receive(self) -> Stamped | None:
        """Return the next response, None for silence."""
        received = self._link.wait(self.is_response, self.timeout_s, self._mark)
        self._mark = self._link.mark()
        return received

    def settle(self) -> None:
        """Take in what has arrived and count the responses nobody asked for."""
        self._link.drain()
        self.unsolicited += len(self._link.since(self._mark, self.is_response))
        self._mark = self._link.mark()
