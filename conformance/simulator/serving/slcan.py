"""The adapter side of a serial line that speaks slcan (Lawicel's CAN232 commands), sans-IO."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, Protocol

from conformance.wire.errors import WireError
from conformance.wire.frame import Frame

BIT_RATES: Final = dict(
    enumerate((10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000))
)
"""Bit/s by the digit of the command S."""

CLOCK_HZ: Final = 8_000_000
"""Of the SJA1000 that the command s sets the registers of, after its divider."""

OK: Final = b"\r"
ERROR: Final = b"\a"
MOST: Final = 64
"""Octets of a command; what is longer is none."""

VERSION: Final = b"V1013"
SERIAL_NUMBER: Final = b"NCC01"
_MS: Final = 1_000_000
_STAMP_ENDS: Final = 60_000
"""Timestamps count milliseconds of one minute."""

_COMMAND = re.compile(rb"[^\r]*\r")


class Wire(Protocol):
    """What an adapter does at its CAN side."""

    def open(self, bitrate: int) -> None:
        """Begin to take part, at a bit rate in bit/s."""

    def close(self) -> None:
        """Take part no more."""

    def send(self, frame: Frame) -> None:
        """Send a frame."""


class SlcanAdapter:
    """An adapter between a serial line and a bus.

    Args:
        wire: Its CAN side.
    """

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._buffer = b""
        self._bitrate: int | None = None
        self._open = False
        self._listens = False
        self._stamps = False
        self._simple: dict[bytes, Callable[[bytes], bytes]] = {
            b"S": self._set_rate,
            b"s": self._set_registers,
            b"O": self._begin,
            b"L": self._begin,
            b"C": self._end,
            b"Z": self._set_stamps,
            b"F": lambda _: b"F00\r" if self._open else ERROR,
            b"V": lambda _: VERSION + OK,
            b"N": lambda _: SERIAL_NUMBER + OK,
        }

    def feed(self, data: bytes) -> bytes:
        """Take octets from the line and return what goes back on it."""
        self._buffer += data.replace(b"\n", b"")
        answers = []
        while found := _COMMAND.match(self._buffer):
            self._buffer = self._buffer[found.end() :]
            answers.append(self._command(found[0][:-1]))
        if len(self._buffer) > MOST:
            self._buffer = b""
            answers.append(ERROR)
        return b"".join(answers)

    def deliver(self, time_ns: int, frame: Frame) -> bytes:
        """Return a frame from the bus as it goes on the line; nothing while the channel is closed."""
        if not self._open:
            return b""
        kind = ("R" if frame.extended else "r") if frame.remote else "T" if frame.extended else "t"
        identifier = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
        data = "" if frame.remote else frame.data.hex().upper()
        stamp = f"{time_ns // _MS % _STAMP_ENDS:04X}" if self._stamps else ""
        return f"{kind}{identifier}{frame.dlc}{data}{stamp}\r".encode("ascii")

    def _command(self, text: bytes) -> bytes:
        if not text:
            return OK  # terminals send a few to begin with
        if text[:1] in b"tTrR":
            return self._send(text)
        handle = self._simple.get(text[:1])
        return ERROR if handle is None else handle(text)

    def _set_rate(self, text: bytes) -> bytes:
        bitrate = BIT_RATES.get(int(text[1:])) if text[1:].isdigit() else None
        return self._use(bitrate)

    def _set_registers(self, text: bytes) -> bytes:
        if not re.fullmatch(rb"s[0-9A-Fa-f]{4}", text):
            return ERROR
        first, second = bytes.fromhex(text[1:].decode("ascii"))
        quanta = 1 + (second & 0x0F) + 1 + (second >> 4 & 0x07) + 1
        return self._use(CLOCK_HZ // (((first & 0x3F) + 1) * quanta))

    def _use(self, bitrate: int | None) -> bytes:
        if self._open or bitrate is None:
            return ERROR
        self._bitrate = bitrate
        return OK

    def _begin(self, text: bytes) -> bytes:
        if self._open or self._bitrate is None or len(text) > 1:
            return ERROR
        self._open, self._listens = True, text == b"L"
        self._wire.open(self._bitrate)
        return OK

    def _end(self, text: bytes) -> bytes:
        if not self._open or len(text) > 1:
            return ERROR
        self._open = False
        self._wire.close()
        return OK

    def _set_stamps(self, text: bytes) -> bytes:
        if self._open or text[1:] not in (b"0", b"1"):
            return ERROR
        self._stamps = text[1:] == b"1"
        return OK

    def _send(self, text: bytes) -> bytes:
        frame = _frame(text)
        if frame is None or not self._open or self._listens:
            return ERROR
        self._wire.send(frame)
        return (b"Z" if frame.extended else b"z") + OK


def _frame(text: bytes) -> Frame | None:
    remote, extended = text[:1] in b"rR", text[:1] in b"TR"
    digits = 8 if extended else 3
    form = rb".([0-9A-Fa-f]{%d})([0-8])((?:[0-9A-Fa-f]{2})*)" % digits
    found = re.fullmatch(form, text)
    if found is None:
        return None
    dlc, data = int(found[2]), bytes.fromhex(found[3].decode("ascii"))
    if len(data) != (0 if remote else dlc):
        return None
    try:
        return Frame(int(found[1], 16), data, remote, extended, dlc)
    except WireError:
        return None
