"""A man in the middle between a simulated device and its bus: what he does to the frames is seeded."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Sequence

from conformance.wire import cob_id
from conformance.wire.frame import Frame, bit_length

MS = 1_000_000
SECOND = 1_000_000_000
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


class Mischief:
    """What is done to frames on their way; here nothing.

    Args:
        seed: Of everything random.
    """

    everything = False
    """No SDO answer of the device reaches the bench as it was."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(f"{type(self).__name__} {seed}")  # noqa: S311 - repeatable
        self.rate = self.random.choice((0.005, 0.03, 0.2, 1.0))
        self.count = 0
        self.node_id = 0
        self.bitrate = 0
        self.replies: list[Frame] = []
        """What to answer in place of the device."""

    def answer(self, frame: Frame) -> Iterable[Frame]:
        """Return what goes out in place of a frame of the device."""
        if self.random.random() >= self.rate:
            return (frame,)
        changed = tuple(self.change(frame))
        self.count += changed != (frame,)
        return changed

    def change(self, frame: Frame) -> Iterable[Frame]:
        """Return what a frame becomes that is meddled with."""
        return (frame,)

    def hear(self, frame: Frame) -> Iterable[Frame]:
        """Return what the device hears in place of a frame."""
        return (frame,)

    def delay_ns(self) -> int:
        """Return how late a frame of the device goes out."""
        return 0

    def unasked(self, now_ns: int) -> tuple[int | None, Sequence[Frame]]:
        """Return when to be asked again, and what goes out of itself now."""
        del now_ns
        return None, ()

    def is_answer(self, frame: Frame) -> bool:
        """Tell whether a frame is an SDO response of the device."""
        return frame.can_id == cob_id.sdo_response(self.node_id) and not frame.extended


class FlipsBits(Mischief):
    """Inverts bits of the data."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        if not frame.data:
            return (frame,)
        bits = int.from_bytes(frame.data, "little")
        for _ in range(self.random.choice((1, 1, 2, 8))):
            bits ^= 1 << self.random.randrange(8 * len(frame.data))
        return (Frame(frame.can_id, bits.to_bytes(len(frame.data), "little")),)


class ChangesLength(Mischief):
    """Cuts data off or adds some."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        if frame.remote:
            return (frame,)
        data = frame.data + self.random.randbytes(8)
        return (Frame(frame.can_id, data[: self.random.randrange(9)]),)


class Drops(Mischief):
    """Loses frames."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        del frame
        return ()


class Doubles(Mischief):
    """Repeats frames, up to a hundred times."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        return [frame] * self.random.choice((2, 2, 3, 100))


class Delays(Mischief):
    """Holds frames back, each for another while, so that they overtake each other."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.longest_ms = self.random.choice((5, 50, 400, 1500, 10_000))

    def delay_ns(self) -> int:
        if self.random.random() >= self.rate:
            return 0
        self.count += 1
        return self.random.randrange(self.longest_ms * MS)


class Reorders(Mischief):
    """Holds a frame back until the next one."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._held: list[Frame] = []

    def answer(self, frame: Frame) -> Iterable[Frame]:
        held, self._held = self._held, []
        if not held and self.random.random() < self.rate:
            self._held = [frame]
            self.count += 1
            return ()
        return (frame, *held)


class SwapsIdentifiers(Mischief):
    """Sends frames under another identifier, as a remote frame or in the extended format."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        kind = self.random.randrange(5)
        if kind == 0:
            return (Frame(frame.can_id, b"", remote=True, dlc=frame.dlc),)
        if kind == 1:
            return (Frame(frame.can_id, frame.data, extended=True),) if not frame.remote else ()
        base = self.random.choice((0, 0x080, 0x180, 0x280, 0x580, 0x600, 0x700, 0x7E4))
        identifier = base + self.node_id * (0 < base < 0x7E4)
        if kind == 2:
            identifier = (frame.can_id + self.random.choice((-1, 1))) % 0x800
        if kind == 3:
            identifier = self.random.randrange(0x800)
        return (Frame(identifier, frame.data),)


class Aborts(Mischief):
    """Answers SDO requests with aborts."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.everything = self.rate == 1.0
        self._code = self.random.choice((None, 0, 0x0800_0000, 0x0602_0000, 0xFFFF_FFFF))

    def change(self, frame: Frame) -> Iterable[Frame]:
        if not self.is_answer(frame):
            return (frame,)
        code = self.random.randrange(1 << 32) if self._code is None else self._code
        return (Frame(frame.can_id, b"\x80" + frame.data[1:4] + code.to_bytes(4, "little")),)


class Garbage(Mischief):
    """Answers SDO requests with anything, as often as it likes."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.everything = self.rate == 1.0

    def change(self, frame: Frame) -> Iterable[Frame]:
        if not self.is_answer(frame):
            return (frame,)
        return [
            Frame(frame.can_id, self.random.randbytes(self.random.choice((8, 8, 8, 0, 1, 4, 7))))
            for _ in range(self.random.choice((1, 1, 1, 3)))
        ]


class RightLookingGarbage(Garbage):
    """Answers SDO requests with the right command and object, and anything behind them."""

    everything = False

    def change(self, frame: Frame) -> Iterable[Frame]:
        if not self.is_answer(frame):
            return (frame,)
        head, tail = frame.data[:4], self.random.randbytes(4)
        command = self.random.choice((head[0], 0x40, 0x41, 0x43, 0x4F, 0x60, 0x80, 0xA4, 0xC2))
        return (Frame(frame.can_id, bytes((command,)) + head[1:4] + tail),)


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
        self.everything = self.rate == 1.0

    def announced(self) -> bytes:
        return len(self._text).to_bytes(4, "little")

    def pieces(self) -> Iterator[bytes]:
        toggle, text = 0, self._text
        for start in range(0, max(len(text), 1), 7):
            piece = text[start : start + 7]
            last = start + 7 >= len(text)
            yield bytes((toggle << 4 | (7 - len(piece)) << 1 | last,)) + piece.ljust(7, b"\0")
            toggle ^= 1


class TruncatesSegments(Mischief):
    """Ends segmented transfers too early, or shortens what a segment says it holds."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        if not self.is_answer(frame) or not frame.data or frame.data[0] & 0xE0:
            return (frame,)
        command = frame.data[0] ^ self.random.choice((0x01, 0x10, 0x0E, 0x02, 0x11))
        return (Frame(frame.can_id, bytes((command,)) + frame.data[1:]),)


class FallsSilent(Mischief):
    """Says nothing for a while, again and again, or for good."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._speaks_for = self.random.choice((0, 5, 40, 200))
        self._silent_for = self.random.choice((1, 5, 100, 1 << 40))
        self._said = 0

    def answer(self, frame: Frame) -> Iterable[Frame]:
        self._said += 1
        place = self._said % (self._speaks_for + self._silent_for)
        if place < self._speaks_for:
            return (frame,)
        self.count += 1
        return ()


class SpoilsRequests(FlipsBits):
    """Inverts bits of what the device hears."""

    def answer(self, frame: Frame) -> Iterable[Frame]:
        return (frame,)

    def hear(self, frame: Frame) -> Iterable[Frame]:
        return super().answer(frame)


class Floods(Mischief):
    """From some time on fills the bus with one identifier."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._begins_ns = self.random.choice((0, 400, 1500, 4000)) * MS
        self._pause = self.random.choice((0.0, 0.0, 1.0, 9.0))
        self._service = self.random.choice((0, 0x80, 0x181, 0x180, 0x580, 0x600, 0x700, 0x7E4))
        self._data = self.random.choice((None, b"", b"\0", b"\x80" + bytes(7), bytes(8)))

    def unasked(self, now_ns: int) -> tuple[int | None, Sequence[Frame]]:
        if now_ns < self._begins_ns:
            return self._begins_ns, ()
        own = self.node_id if self._service in (0x180, 0x580, 0x600, 0x700) else 0
        data = self.random.randbytes(8) if self._data is None else self._data
        frame = Frame(self._service + own, data)
        self.count += 1
        lasts_ns = bit_length(frame) * SECOND // self.bitrate
        return now_ns + round(lasts_ns * (1 + self._pause)), (frame,)


class ForeignTraffic(Mischief):
    """Puts in what other nodes might send, and some that only this one may."""

    def unasked(self, now_ns: int) -> tuple[int | None, Sequence[Frame]]:
        again_ns = now_ns + round(self.random.expovariate(0.5) * 20 * MS) + 1
        own = self.random.random() < 0.5
        node_id = self.node_id if own else self.random.randrange(1, 128)
        service = self.random.choice((0x080, 0x180, 0x280, 0x580, 0x600, 0x700))
        data = self.random.randbytes(self.random.choice((1, 8)))
        frame = Frame(service + node_id, data)
        if self.random.random() < 0.1:
            frame = Frame(cob_id.NMT, bytes((self.random.choice((1, 2, 128, 129)), node_id)))
        self.count += own
        return again_ns, (frame,)


class ForgesItsOwn(Mischief):
    """Sends boot-ups, heartbeats of any state, EMCYs and SDO answers that nothing brought about."""

    def unasked(self, now_ns: int) -> tuple[int | None, Sequence[Frame]]:
        again_ns = now_ns + round(self.random.expovariate(1.0) / self.rate * 5 * MS) + 1
        if now_ns < 300 * MS:
            return 300 * MS, ()
        frame = self.random.choice(
            (
                Frame(cob_id.heartbeat(self.node_id), b"\0"),
                Frame(cob_id.heartbeat(self.node_id), self.random.randbytes(1)),
                Frame(0x080 + self.node_id, self.random.randbytes(8)),
                Frame(cob_id.sdo_response(self.node_id), self.random.randbytes(8)),
                Frame(cob_id.LSS_SLAVE, self.random.randbytes(8)),
            )
        )
        self.count += 1
        return again_ns, (frame,)


MISCHIEFS: dict[str, Callable[[int], Mischief]] = {
    it.__name__: it
    for it in (
        FlipsBits,
        ChangesLength,
        Drops,
        Doubles,
        Delays,
        Reorders,
        SwapsIdentifiers,
        Aborts,
        Garbage,
        RightLookingGarbage,
        Uploads,
        EndlessUploads,
        NastyTexts,
        TruncatesSegments,
        FallsSilent,
        SpoilsRequests,
        Floods,
        ForeignTraffic,
        ForgesItsOwn,
    )
}
