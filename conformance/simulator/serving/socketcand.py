"""One connection to a socketcand server in raw mode, sans-IO: CAN over TCP as text."""

from __future__ import annotations

import re
from typing import Final

from conformance.simulator.serving.slcan import Wire
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame

HELLO: Final = b"< hi >"
OK: Final = b"< ok >"
MOST: Final = 256
"""Octets of a command; what is longer is none."""

_SECOND: Final = 1_000_000_000
_COMMAND = re.compile(rb"[^<]*<([^<>]*)>", re.DOTALL)


class SocketcandSession:
    """What a server says to one client; ``HELLO`` comes first.

    Args:
        wire: Its CAN side.
        bitrate: Of the bus, in bit/s; the protocol has none.
    """

    def __init__(self, wire: Wire, bitrate: int) -> None:
        self._wire = wire
        self._bitrate = bitrate
        self._buffer = b""
        self._open = False
        self._raw = False

    def feed(self, data: bytes) -> bytes:
        """Take octets of the connection and return what goes back."""
        self._buffer += data
        answers = []
        while found := _COMMAND.match(self._buffer):
            self._buffer = self._buffer[found.end() :]
            answers.append(self._command(found[1].decode("ascii", "replace").split()))
        if len(self._buffer) > MOST:
            self._buffer = b""
            answers.append(_error("command too long"))
        return b"".join(answers)

    def deliver(self, time_ns: int, frame: Frame) -> bytes:
        """Return a frame from the bus as text; remote frames cannot be told."""
        if not self._raw or frame.remote:
            return b""
        identifier = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
        seconds, rest = divmod(time_ns, _SECOND)
        text = f"< frame {identifier} {seconds}.{rest // 1000:06d} {frame.data.hex().upper()} >"
        return text.encode("ascii")

    def _command(self, words: list[str]) -> bytes:
        match words:
            case ["open", _] if not self._open:
                self._open = True
                return OK
            case ["rawmode"] if self._open:
                if not self._raw:
                    self._raw = True
                    self._wire.open(self._bitrate)
                return OK
            case ["send", identifier, dlc, *octets] if self._raw:
                return self._send(identifier, dlc, octets)
            case ["echo"]:
                return b"< echo >"
            case _:
                return _error("unknown command")

    def _send(self, identifier: str, dlc: str, octets: list[str]) -> bytes:
        try:
            data = bytes(int(octet, 16) for octet in octets)
            frame = Frame(int(identifier, 16), data, extended=len(identifier) > 3)
            if len(data) != int(dlc, 16):
                return _error("data and their length differ")
        except (ValueError, WireError):
            return _error("no frame")
        self._wire.send(frame)
        return b""


def _error(what: str) -> bytes:
    return f"< error {what} >".encode("ascii")
