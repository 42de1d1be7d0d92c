"""A burst of frames: the bus at its full load for a while, as fast as every adapter can send."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil

from conformance.bench.bus.link import Link
from conformance.bench.node.node import Node
from conformance.errors import BenchError, SetupRefused
from conformance.wire.frame import Frame, bit_length
from conformance.wire.sdo import InitiateUpload, encode

FRAMES = 300
REQUEST_EVERY = 4
"""One frame of so many is an SDO request to the node, the others are for nobody."""

AHEAD = 8
"""Frames that the transmit queue of every adapter holds."""

QUIET_S = 0.2
"""A node that has answered as often as it was asked, and was silent for so long, answers no more.

One that has not may still be asked: others keep the frames of the bench from the bus.
"""

_ASKED = (0x1001, 0)
_DATA = b"\x55" * 8
_NOBODY = Frame(0x6E0, _DATA)
"""Has a CAN-ID that CiA 301 v4.2.0, 7.3.5, keeps from every service."""
_YIELDING = Frame(0x7F0, _DATA)
"""Has another one of them, which lets every service have the bus first."""


def send_burst(node: Node) -> None:
    """Send SDO requests among frames for nobody, and wait until the node has answered what it will.

    Raises:
        SetupRefused: The adapter does not send so fast.
    """
    _fill(node, _NOBODY, FRAMES)


def send_load(node: Node, duration_s: float) -> None:
    """Do so for a while, with frames that lose the bus to whatever the node sends.

    Raises:
        SetupRefused: The adapter does not send so fast.
    """
    frame_s = bit_length(_YIELDING) / node.link.bus_time.bitrate
    _fill(node, _YIELDING, ceil(duration_s / frame_s))


def _fill(node: Node, other: Frame, count: int) -> None:
    channel = node.channel
    channel.settle()
    request = Frame(channel.request_id, encode(InitiateUpload(*_ASKED)))
    mark = node.link.mark()
    _send(node.link, (other if n % REQUEST_EVERY else request for n in range(count)))
    for _ in range(count):
        open_ones = count // REQUEST_EVERY - len(node.link.since(mark, channel.is_response))
        wait_s = max(QUIET_S, channel.timeout_s) if open_ones > 0 else QUIET_S
        if node.link.wait(channel.is_response, wait_s) is None:
            break
    channel.begin()


def _send(link: Link, frames: Iterable[Frame]) -> None:
    """Send frames back to back, no more of them ahead of the bus than adapters hold."""
    bitrate = link.bus_time.bitrate
    sent_s = link.now()
    for frame in frames:
        duration_s = bit_length(frame) / bitrate
        sent_s = max(sent_s, link.now()) + duration_s
        try:
            link.send(frame)
        except BenchError as error:
            raise SetupRefused(f"a burst is too fast for the bench: {error}") from error
        ahead_s = sent_s - link.now()
        if ahead_s > AHEAD * duration_s:
            between = link.listen(ahead_s / 2, lambda _: True)
            sent_s += sum(bit_length(it.frame) for it in between) / bitrate
    link.listen(max(0.0, sent_s - link.now()), lambda _: False)
