"""What an adapter tells of its bus and of itself: error frames, bus-off, lost frames, a server that is gone."""

from __future__ import annotations

import socket
from collections import Counter
from contextlib import suppress
from typing import Any, Final

import can

from conformance.errors import BenchError

# Classes of error frames (linux/can/error.h); what other drivers tell has none of them.
_CONTROLLER: Final = 0x004
_NO_ACKNOWLEDGE: Final = 0x020
_BUS_OFF: Final = 0x040
_RESTARTED: Final = 0x100
_OVERFLOW: Final = 0x03
"""In octet 1 of a controller's error: its receive or transmit buffer was too small."""

_HIDDEN_SOCKET: Final = "_SocketCanDaemonBus__socket"
"""Of python-can's socketcand, which takes a server that has hung up for silence."""


class Trouble:
    """Errors on the bus that the adapter told of."""

    def __init__(self) -> None:
        self._seen: Counter[str] = Counter()

    def begin(self) -> None:
        """Begin to count for a new item."""
        self._seen.clear()

    def note(self, message: can.Message) -> None:
        """Take an error frame.

        Raises:
            BenchError: The adapter has left the bus, or has lost frames.
        """
        kind = message.arbitration_id
        if kind & _BUS_OFF:
            raise BenchError(
                "the adapter went bus-off: check bit rate, wiring and termination, and whether "
                "any other node is on the bus"
            )
        if kind & _CONTROLLER and len(message.data) > 1 and message.data[1] & _OVERFLOW:
            raise BenchError(
                "the adapter lost frames, its buffer was full: what was seen is not complete; "
                "close other programs or reduce the bus load"
            )
        if not kind & _RESTARTED:
            self._seen["not acknowledged" if kind & _NO_ACKNOWLEDGE else "destroyed"] += 1

    def look(self, bus: can.BusABC) -> None:
        """Look whether an adapter from which nothing came is still there.

        Raises:
            BenchError: It is not.
        """
        connection = getattr(bus, _HIDDEN_SOCKET, None)
        if isinstance(connection, socket.socket) and _has_hung_up(connection):
            raise BenchError("the socketcand server has ended the connection")

    def __str__(self) -> str:
        counts = ", ".join(f"{count} {what}" for what, count in self._seen.items())
        return f"frames on the bus: {counts}" if counts else ""


def enlarge_queue(bus: can.BusABC) -> None:
    """Let a SocketCAN socket keep more frames than the some hundred that are usual."""
    found: Any = getattr(bus, "socket", None)
    if isinstance(found, socket.socket):
        with suppress(OSError):
            found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)


def _has_hung_up(connection: socket.socket) -> bool:
    try:
        return not connection.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT)
    except BlockingIOError:
        return False
    except OSError:
        return True
