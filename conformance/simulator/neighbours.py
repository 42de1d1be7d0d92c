"""Other nodes on a simulated bus: heartbeats, PDOs, SDO transfers, EMCY and NMT commands among themselves.

They send by the clock and heed nothing, so that what is judged is the device and not them.
"""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Final

from conformance.wire import cob_id
from conformance.wire.frame import Frame, bit_length

_SECOND: Final = 1_000_000_000
_MS: Final = 1_000_000
COUNT: Final = 6
"""How many of them share a loaded bus."""
APART: Final = 17
"""From the device's node-ID to the first of theirs, and from each to the next."""

_HEARTBEATS_MS: Final = (100, 250, 500, 1000)
_TRANSFER_MS: Final = 200
_SERVER_NS: Final = 2 * _MS
_EMCY_MS: Final = 3000
_COMMAND_MS: Final = 5000
_PDO_OCTETS: Final = (8, 8, 4, 2)
_PDO_PACES: Final = (1, 2, 4, 4)
"""How the times between two of a node's four TPDOs compare."""
_UNEVEN: Final = 0.1
"""By how much of its period a message may be early or late."""
_OPERATIONAL: Final = 5


@dataclass(frozen=True, slots=True)
class Message:
    """Frames that come again and again.

    Args:
        period_ns: From one time to the next, on average.
        frames: Returns what is sent, with the time after which it follows the first.
    """

    period_ns: int
    frames: Callable[[], Sequence[tuple[int, Frame]]]


class Neighbour:
    """A node, or a tool, that sends messages by the clock.

    Args:
        bitrate: In bit/s.
        messages: What it sends.
        draw: Source of everything random, seeded.
    """

    def __init__(self, bitrate: int, messages: Sequence[Message], draw: random.Random) -> None:
        self.bitrate = bitrate
        self._random = draw
        self._order = count()
        self._due: list[tuple[int, int, Message | Frame]] = []
        for message in messages:
            self._add(draw.randrange(message.period_ns), message)

    @property
    def deadline_ns(self) -> int | None:
        """When it next sends."""
        return self._due[0][0] if self._due else None

    def step(self, now_ns: int, frames: Sequence[Frame] = ()) -> list[Frame]:  # noqa: ARG002 - as of a device
        """Let time pass up to ``now_ns`` and return the frames to send now, in order."""
        sent: list[Frame] = []
        while self._due and self._due[0][0] <= now_ns:
            due_ns, _, what = heapq.heappop(self._due)
            if isinstance(what, Frame):
                sent.append(what)
                continue
            for after_ns, frame in what.frames():
                self._add(due_ns + after_ns, frame)
            uneven = 1 + self._random.uniform(-_UNEVEN, _UNEVEN)
            self._add(due_ns + round(what.period_ns * uneven), what)
        return sent

    def _add(self, due_ns: int, what: Message | Frame) -> None:
        heapq.heappush(self._due, (due_ns, next(self._order), what))


def neighbours(node_id: int, bitrate: int, load: float, seed: int) -> list[Neighbour]:
    """Return nodes that together take a share of the bus.

    Their identifiers lie on both sides of the device's own, wherever its node-ID lets them.

    Args:
        node_id: Of the device; theirs keep away from it.
        bitrate: In bit/s.
        load: Share of the bus, above 0.
        seed: Of everything random.
    """
    draw = random.Random(f"neighbours {seed}")  # noqa: S311 - repeatable traffic, no secrets
    ids = [(node_id + APART * (n + 1) - 1) % 127 + 1 for n in range(COUNT)]
    slow = [list(_slow(other, draw)) for other in ids]
    left = load - sum(_load(message, bitrate) for messages in slow for message in messages)
    unit_ns = _pdo_period_ns(max(left, load / 10), bitrate)
    return [
        Neighbour(bitrate, [*messages, *_pdos(other, unit_ns, draw)], draw)
        for other, messages in zip(ids, slow, strict=True)
    ]


def _slow(node_id: int, draw: random.Random) -> Iterator[Message]:
    """Return what a node sends now and then, and what a tool and the NMT master send to it."""
    heartbeat = Frame(cob_id.heartbeat(node_id), bytes((_OPERATIONAL,)))
    yield Message(draw.choice(_HEARTBEATS_MS) * _MS, lambda: [(0, heartbeat)])

    def transfer() -> list[tuple[int, Frame]]:
        place = bytes((draw.randrange(256), 0x20 | draw.randrange(16), draw.randrange(8)))
        request = Frame(cob_id.sdo_request(node_id), b"\x40" + place + bytes(4))
        response = Frame(cob_id.sdo_response(node_id), b"\x43" + place + draw.randbytes(4))
        return [(0, request), (_SERVER_NS, response)]

    def emergency() -> list[tuple[int, Frame]]:
        code = draw.choice((b"\x00\x00\x00", b"\x10\x81\x11", b"\x00\x42\x09"))
        return [(0, Frame(cob_id.emcy(node_id), code + bytes(5)))]

    def command() -> list[tuple[int, Frame]]:
        return [(0, Frame(cob_id.NMT, bytes((1, node_id))))]

    yield Message(_TRANSFER_MS * _MS, transfer)
    yield Message(_EMCY_MS * _MS, emergency)
    yield Message(_COMMAND_MS * _MS, command)


def _pdos(node_id: int, unit_ns: int, draw: random.Random) -> Iterator[Message]:
    """Return a node's four TPDOs with changing content."""
    for number, (octets, pace) in enumerate(zip(_PDO_OCTETS, _PDO_PACES, strict=True), start=1):

        def pdo(number: int = number, octets: int = octets) -> list[tuple[int, Frame]]:
            return [(0, Frame(cob_id.tpdo(number, node_id), draw.randbytes(octets)))]

        yield Message(unit_ns * pace, pdo)


def _pdo_period_ns(load: float, bitrate: int) -> int:
    """Return the time between two of the fastest TPDOs so that all together take a share of the bus."""
    bits = sum(
        bit_length(Frame(0x2AA, b"\x5a" * octets)) / pace
        for octets, pace in zip(_PDO_OCTETS, _PDO_PACES, strict=True)
    )
    return max(1, round(COUNT * bits * _SECOND / bitrate / load))


def _load(message: Message, bitrate: int) -> float:
    """Return the share of the bus that a message takes."""
    bits = sum(bit_length(frame) for _, frame in message.frames())
    return bits * _SECOND / bitrate / message.period_ns
