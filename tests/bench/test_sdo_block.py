"""Block transfers with a server that keeps to nothing: each one ends, and says why."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeAlias

import pytest

from conformance.bench.bus.link import Stamped
from conformance.bench.node.channel import SdoChannel
from conformance.bench.node.sdo_block import BlockPort
from conformance.wire.frame import Frame

OBJECT = (0x2000, 0)
INITIATED = bytes.fromhex("A4002000 01000000")
Server: TypeAlias = Callable[[bytes], Iterable[bytes]]


class Channel(SdoChannel):
    """The channel to a server that is a function."""

    def __init__(self, server: Server) -> None:
        self.node_id, self.timeout_s = 1, 1.0
        self.in_vain = self.improper = 0
        self._server = server
        self._responses: list[bytes] = []

    def send(self, data: bytes, *more: bytes) -> Stamped:
        for request in (data, *more):
            self._responses += self._server(request)
        return Stamped(Frame(0x601, data), 0.0, 1, 0, received=False)

    def receive(self, wait_s: float | None = None) -> Stamped | None:
        del wait_s
        if not self._responses:
            return None
        return Stamped(Frame(0x581, self._responses.pop(0)), 0.0, 1, 0, received=True)


@pytest.mark.timeout(30)
@pytest.mark.parametrize("size", [0, 128, 255])
def test_a_block_of_no_segments_or_of_too_many_ends_a_download(size: int) -> None:
    def server(request: bytes) -> Iterable[bytes]:
        if request[0] & 0xE3 == 0xC2:
            return [INITIATED]
        return [bytes((0xA2, request[0] & 0x7F, size, 0, 0, 0, 0, 0))] if request[0] != 0x80 else []

    transfer = BlockPort(Channel(server)).download(*OBJECT, bytes(20))

    assert f"asked for {size} segments" in transfer.fault


def test_the_last_block_may_be_followed_by_any_size() -> None:
    def server(request: bytes) -> Iterable[bytes]:
        if request[0] & 0xE3 == 0xC2:
            return [INITIATED]
        if request[0] & 0xE3 == 0xC1:
            return [bytes((0xA1, 0, 0, 0, 0, 0, 0, 0))]
        return [bytes((0xA2, request[0] & 0x7F, 0, 0, 0, 0, 0, 0))]

    assert BlockPort(Channel(server)).download(*OBJECT, bytes(4)).confirmed
