"""Uploads that the man in the middle answers himself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from meddling import Mischief

from conformance.wire import cob_id
from conformance.wire.frame import Frame

NASTY = (
    b"\x00\x01\x02\x07\x08\x1b[31mred\x1b[0m\r\n",
    b"\x1b]0;title\x07\x1b[2J\x9b31m",
    b"</failure><script>alert(1)</script><!--",
    b"]]>&lt;&#0;&amp;<![CDATA[",
    b"[bold red]CONFORMS[/] [/nosuchtag] [link=x]",
    b"\xff\xfe\xc3\x28\xed\xa0\x80\xf8\x88\x80\x80",
    b"\x00" * 40,
    "\u202eCONFORMS\u202d\u200b\ufeff\U0001f600".encode(),
    b"%s%n{0}{{}} ${x} `id`; DROP TABLE runs;--",
    b"A" * 10_000,
    b"\n\n0 deviations\nCONFORMS: 9 items: 9 pass\n",
    b"",
)
"""What no label says."""


class Uploads(Mischief):
    """Answers uploads itself; what it uploads is up to the kinds of it."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._pieces: Iterator[bytes] | None = None

    def hear(self, frame: Frame) -> Iterable[Frame]:
        if frame.can_id != cob_id.sdo_request(self.node_id) or len(frame.data) < 8:
            return (frame,)
        command = frame.data[0] & 0xE0
        if command == 0x60 and self._pieces is not None:
            self._reply(next(self._pieces, b""))
            return ()
        self._pieces = None
        if command != 0x40 or self.random.random() >= self.rate:
            return (frame,)
        self.count += 1
        self._pieces = self.pieces()
        self._reply(b"\x41" + frame.data[1:4] + self.announced())
        return ()

    def _reply(self, data: bytes) -> None:
        if data:
            self.replies.append(Frame(cob_id.sdo_response(self.node_id), data))

    def announced(self) -> bytes:
        """Return the announced number of octets."""
        return self.random.choice((0, 1, 5, 0x4000_0000, 0xFFFF_FFFF)).to_bytes(4, "little")

    def pieces(self) -> Iterator[bytes]:
        """Return the segments, toggling properly."""
        toggle = 0
        kind = self.random.randrange(5)
        left = self.random.choice((0, 1, 20, 1 << 40))
        while left >= 0:
            left -= 1
            octets = (7, 7, 0, 1, self.random.randrange(8))[kind]
            last = left < 0 and kind != 2
            command = toggle << 4 | (7 - octets) << 1 | last
            yield bytes((command,)) + self.random.randbytes(7)
            toggle ^= 1


class EndlessUploads(Uploads):
    """Every upload comes in segments and never ends."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._octets = self.random.choice((0, 1, 7))
        self._size = self.random.choice((0, 4, 0x4000_0000, 0xFFFF_FFFF))

    def announced(self) -> bytes:
        return self._size.to_bytes(4, "little")

    def pieces(self) -> Iterator[bytes]:
        segment = (7 - self._octets) << 1
        while True:
            yield bytes((segment,)) + b"\x55" * 7
            segment ^= 0x10


class NastyTexts(Uploads):
    """Every upload gives a text of control characters, markup or ten thousand octets."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._text = self.random.choice(NASTY)

    def announced(self) -> bytes:
        return len(self._text).to_bytes(4, "little")

    def pieces(self) -> Iterator[bytes]:
        toggle, text = 0, self._text
        for start in range(0, max(len(text), 1), 7):
            piece = text[start : start + 7]
            last = start + 7 >= len(text)
            yield bytes((toggle << 4 | (7 - len(piece)) << 1 | last,)) + piece.ljust(7, b"\0")
            toggle ^= 1
