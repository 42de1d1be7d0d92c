"""Nodes that misbehave as a whole: silent, dying, beside themselves, two of them, in another's place."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from meddling import MS, SECOND, Mischief

from conformance.simulator.device import SimulatedDevice
from conformance.wire import cob_id
from conformance.wire.frame import Frame, bit_length

LOOKS_EVERY_NS = 10 * MS
MOST_NS = 1 << 62


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


class AnswersElsewhere(Mischief):
    """From some frame on sends what it has to say under other identifiers, always the same ones."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._begins = self.random.choice((0, 0, 1, 20, 200))
        self._further = self.random.choice((-0x100, -1, 1, 2, 0x7F, 0x80, 0x100))
        self._services = self.random.choice(((0x580,), (0x080, 0x180, 0x700), (0x580, 0x700)))
        self.everything = self._begins == 0 and 0x580 in self._services
        self._said = 0

    def answer(self, frame: Frame) -> Iterable[Frame]:
        self._said += 1
        mine = frame.can_id - self.node_id in self._services
        if self._said <= self._begins or not mine or frame.extended:
            return (frame,)
        self.count += 1
        return (Frame((frame.can_id + self._further) % 0x800, frame.data, frame.remote),)


class SameNodeId(Mischief):
    """Another node of the same kind has the same node-ID, and is a little slower."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._twin: SimulatedDevice | None = None
        self._comes_ns = self.random.choice((0, 0, 300, 1500)) * MS

    def meet(self, device: SimulatedDevice) -> None:
        super().meet(device)
        self._twin = device.twin(self.random.randrange(2, 1 << 32))

    def hear(self, frame: Frame) -> Iterable[Frame]:
        if self._twin is not None:
            self.replies += self._told(self._twin.step(self.now_ns, [frame]))
        return (frame,)

    def unasked(self, now_ns: int) -> tuple[int | None, Sequence[Frame]]:
        if self._twin is None or now_ns < self._comes_ns:
            return self._comes_ns, ()
        self._twin.power_on(now_ns)
        said = self._told(self._twin.step(now_ns))
        return min(self._twin.deadline_ns or MOST_NS, now_ns + LOOKS_EVERY_NS), said

    def _told(self, frames: list[Frame]) -> list[Frame]:
        self.count += len(frames)
        return frames


class Dies(Mischief):
    """Says nothing any more from some frame on, not even after its supply was switched off and on."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._lasts = round(10 ** self.random.uniform(0.5, 3.5))
        self._said = 0
        self._cut = self.random.random() < 0.5

    def answer(self, frame: Frame) -> Iterable[Frame]:
        self._said += 1
        if self._said < self._lasts:
            return (frame,)
        self.count += 1
        if self._said > self._lasts or not self._cut:
            return ()
        return (Frame(frame.can_id, frame.data[: len(frame.data) // 2]),)


class Restarts(Mischief):
    """Starts anew now and then, as after a fault of its supply."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._every_ns = self.random.choice((30, 250, 1000, 5000, 20_000)) * MS
        self._device: SimulatedDevice | None = None

    def meet(self, device: SimulatedDevice) -> None:
        super().meet(device)
        self._device = device

    def unasked(self, now_ns: int) -> tuple[int | None, Sequence[Frame]]:
        if self._device is not None and now_ns > self._every_ns:
            self._device.power_off()
            self._device.power_on(now_ns)
            self.count += 1
        return now_ns + round(self._every_ns * self.random.uniform(0.5, 1.5)), ()


class LssLies(Mischief):
    """Answers LSS requests with other errors, other identities, other commands, or anything."""

    prefers = "LSS-"

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self.rate = self.random.choice((0.2, 1.0))

    def change(self, frame: Frame) -> Iterable[Frame]:
        if frame.can_id != cob_id.LSS_SLAVE or len(frame.data) < 8:
            return (frame,)
        data = bytearray(frame.data)
        match self.random.randrange(4):
            case 0:
                data[0] = self.random.randrange(256)
            case 1:
                data[1:3] = self.random.choice((b"\x01\x00", b"\xff\x01", b"\x02\x00"))
            case 2:
                data[1:5] = self.random.randbytes(4)
            case _:
                data[:] = self.random.randbytes(self.random.randrange(9))
        return [Frame(frame.can_id, bytes(data))] * self.random.choice((1, 1, 2))
