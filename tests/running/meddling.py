"""A man in the middle between a simulated device and its bus: what he does to the frames is seeded."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence

from conformance.simulator.device import SimulatedDevice
from conformance.wire import cob_id
from conformance.wire.frame import Frame

MS = 1_000_000
SECOND = 1_000_000_000


class Mischief:
    """What is done to frames on their way; here nothing.

    Args:
        seed: Of everything random.
    """

    everything = False
    """No SDO answer that may be true reaches the bench."""

    prefers = ""
    """With what the requirements begin that have most to do with it."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(f"{type(self).__name__} {seed}")  # noqa: S311 - repeatable
        self.rate = self.random.choice((0.005, 0.03, 0.2, 1.0))
        self.count = 0
        self.node_id = 0
        self.bitrate = 0
        self.now_ns = 0
        self.replies: list[Frame] = []
        """What to answer in place of the device."""

    def meet(self, device: SimulatedDevice) -> None:
        """Take note of the device whose frames are meddled with."""
        self.node_id, self.bitrate = device.node_id, device.bitrate

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


class RightLookingGarbage(Mischief):
    """Answers SDO requests with the right command and object, and anything behind them."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        if not self.is_answer(frame):
            return (frame,)
        head, tail = frame.data[:4], self.random.randbytes(4)
        command = self.random.choice((head[0], 0x40, 0x41, 0x43, 0x4F, 0x60, 0x80, 0xA4, 0xC2))
        return (Frame(frame.can_id, bytes((command,)) + head[1:4] + tail),)


class TruncatesSegments(Mischief):
    """Ends segmented transfers too early, or shortens what a segment says it holds."""

    def change(self, frame: Frame) -> Iterable[Frame]:
        if not self.is_answer(frame) or not frame.data or frame.data[0] & 0xE0:
            return (frame,)
        command = frame.data[0] ^ self.random.choice((0x01, 0x10, 0x0E, 0x02, 0x11))
        return (Frame(frame.can_id, bytes((command,)) + frame.data[1:]),)


class SpoilsRequests(FlipsBits):
    """Inverts bits of what the device hears."""

    def answer(self, frame: Frame) -> Iterable[Frame]:
        return (frame,)

    def hear(self, frame: Frame) -> Iterable[Frame]:
        return super().answer(frame)
