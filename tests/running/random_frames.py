"""Frames for a device that nobody would send it on purpose, seeded, and a device that lives through them."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from conformance.simulator.device import SimulatedDevice
from conformance.spec.load import SpecFile
from conformance.spec.model import Entry
from conformance.wire import cob_id
from conformance.wire.frame import Frame

US = 1_000
MS = 1_000_000
SESSION = 20_000
"""Frames between two power cycles."""

_COMMANDS = (
    *(0x40, 0x40, 0x40, 0x40, 0x40, 0x2F, 0x2F, 0x2F, 0x2B, 0x2B, 0x2B, 0x23, 0x23, 0x23),
    *(0x22, 0x27, 0x21, 0x20, 0x80, 0xA0, 0xA1, 0xA2, 0xC2),
)
_BEGINNINGS = (0x21, 0x20, 0x40, 0xA0, 0xC2, 0xC6)
_SEGMENTS = (0x00, 0x01, 0x0D, 0x10, 0x1D, 0x60, 0x70, 0xA1, 0xA2, 0xA3, 0xC1, 0xDD)
_WORDS = (b"save", b"load", bytes(4), b"\xff" * 4, b"\x01\0\0\0", b"\xff\xff\xff\x7f")
_LSS = (4, 17, 19, 21, 23, 64, 65, 66, 67, 70, 71, 72, 73, 74, 75, 76, 81, 90, 91, 92, 93, 94)
_NMT = (1, 1, 1, 2, 128, 128, 129, 130)
_UNKNOWN = (b"\x00\x30\x00", b"\xff\xff\xff", b"\x18\x10\x05")
_UPLOAD_IDENTITY = bytes.fromhex("4018100100000000")


class RandomFrames:
    """An endless mixture of requests that are almost right and of plain noise.

    Args:
        seed: Two with the same one make the same frames.
        device: What gets them.
    """

    def __init__(self, seed: int, device: SimulatedDevice) -> None:
        self._random = random.Random(seed)  # noqa: S311 - repeatable frames, no secrets
        entries = device.spec.entries.values()
        self._heads = [*map(_head, entries), *_UNKNOWN]
        self._texts = [_head(entry) for entry in entries if entry.type.size is None]
        self._device = device
        self._kinds = [kind for kind, share in self._shares().items() for _ in range(share)]

    def _shares(self) -> dict[Callable[[], Frame], int]:
        """Return what to send, with its share in 500; a node that has just been reset hears nothing."""
        return {
            self._request: 290,
            self._segment: 40,
            self._noise: 70,
            self._short_request: 15,
            self._lss: 30,
            self._sync: 20,
            self._remote: 14,
            self._extended: 10,
            self._other_node: 10,
            self._nmt: 1,
        }

    def __iter__(self) -> Iterator[Frame]:
        choice, kinds = self._random.choice, self._kinds
        while True:
            yield choice(kinds)()
            if self._random.random() < 0.02:
                yield from self._transfer()

    def _transfer(self) -> Iterator[Frame]:
        """Begin a transfer of several frames and go on with it, rarely to its proper end."""
        client, choice = cob_id.sdo_request(self._device.node_id), self._random.choice
        head = choice(self._texts if self._texts and self._random.random() < 0.3 else self._heads)
        size = bytes((choice((1, 2, 4, 8, self._random.randrange(24))), 0, 0, choice((0, 0, 255))))
        yield Frame(client, bytes((choice(_BEGINNINGS),)) + head + size)
        kind, octets = choice((0x00, 0x60, 0xA0, None)), self._random.randbytes(7)
        for number in range(self._random.randrange(1, 12)):
            if self._random.random() < 0.02:
                yield self._segment()
            command = number + 1 if kind is None else kind | (number % 2) << 4
            last = self._random.random() < 0.3
            ending = 0x80 if kind is None else 0x01 | -size[0] % 8 - 1 << 1 & 0x0E
            yield Frame(client, bytes((command | ending * last,)) + octets)

    def _tail(self) -> bytes:
        draw = self._random.random()
        if draw < 0.2:
            return self._random.choice(_WORDS)
        if draw < 0.6:
            return self._random.randbytes(1) + bytes(3)
        return self._random.randbytes(4)

    def _request(self) -> Frame:
        choice = self._random.choice
        head = bytes((choice(_COMMANDS),)) + choice(self._heads)
        return Frame(cob_id.sdo_request(self._device.node_id), head + self._tail())

    def _segment(self) -> Frame:
        command = bytes((self._random.choice(_SEGMENTS),))
        return Frame(
            cob_id.sdo_request(self._device.node_id),
            command + self._tail() + self._random.randbytes(3),
        )

    def _short_request(self) -> Frame:
        data = self._request().data[: self._random.randrange(8)]
        return Frame(cob_id.sdo_request(self._device.node_id), data)

    def _noise(self) -> Frame:
        data = self._random.randbytes(self._random.randrange(9))
        at_home = self._random.random() < 0.5
        return Frame(
            cob_id.sdo_request(self._device.node_id) if at_home else self._random.randrange(0x800),
            data,
        )

    def _nmt(self) -> Frame:
        draw = self._random.random()
        if draw < 0.2:
            return Frame(cob_id.NMT, self._random.randbytes(self._random.randrange(9)))
        command = self._random.choice(_NMT) if draw < 0.9 else self._random.randrange(256)
        node_id = self._random.choice((0, self._device.node_id, self._random.randrange(256)))
        return Frame(cob_id.NMT, bytes((command, node_id)))

    def _lss(self) -> Frame:
        data = bytes((self._random.choice(_LSS),)) + self._tail() + bytes(3)
        cut = 8 if self._random.random() < 0.9 else self._random.randrange(8)
        return Frame(cob_id.LSS_MASTER, data[:cut])

    def _sync(self) -> Frame:
        return Frame(cob_id.SYNC, b"" if self._random.random() < 0.7 else b"\x01")

    def _remote(self) -> Frame:
        own = self._random.choice((0x180, 0x280, 0x380, 0x480, 0x580, 0x600, 0x700))
        identifier = own + self._device.node_id if self._random.random() < 0.8 else 0x7E5
        return Frame(identifier, remote=True, dlc=self._random.randrange(9))

    def _extended(self) -> Frame:
        remote = self._random.random() < 0.2
        data = b"" if remote else self._request().data
        draw = self._random.random()
        identifier = (
            self._random.randrange(0x2000_0000) if draw < 0.5 else 0x600 + self._device.node_id
        )
        return Frame(identifier, data, remote, extended=True)

    def _other_node(self) -> Frame:
        service = self._random.choice((0x080, 0x580, 0x600, 0x700))
        data = self._random.randbytes(self._random.choice((1, 8)))
        return Frame(service + self._random.randrange(1, 128), data)


def _head(entry: Entry) -> bytes:
    return entry.index.to_bytes(2, "little") + bytes((entry.sub,))


@dataclass(slots=True)
class Life:
    """A device that gets frames, one after the other, and is switched off and on now and then.

    Args:
        device: The device; it is switched on.
        random: What decides when frames come.
    """

    device: SimulatedDevice
    random: random.Random
    now_ns: int = 0

    def take(self, frames: Iterator[Frame], count: int) -> None:
        """Take in frames at up to full bus load."""
        step, draw = self.device.step, self.random.random
        now_ns = self.now_ns
        for _ in range(count):
            now_ns += 50 * US if draw() < 0.99 else 50 * MS
            step(now_ns, (next(frames),))
        self.now_ns = now_ns

    def restart(self) -> None:
        """Switch the device off and on, and wait until it has booted; it comes back to CANopen."""
        self.device.power_off()
        for key, entry in self.device.spec.entries.items():
            if entry.leaves_canopen:
                self.device.memory.values.pop(key, None)
        self.device.power_on(self.now_ns)
        self.now_ns += 1000 * MS
        self.device.step(self.now_ns)

    def vendor_id(self) -> bytes | None:
        """Ask for the vendor-ID, and return the answer among all that the device says."""
        node_id = self.device.node_id
        self.device.step(self.now_ns, [Frame(cob_id.NMT, bytes((128, node_id)))])
        request = Frame(cob_id.sdo_request(node_id), _UPLOAD_IDENTITY)
        said = list(self.device.step(self.now_ns, [request]))
        self.now_ns += 1 * MS
        said += self.device.step(self.now_ns)
        mine = [frame.data for frame in said if frame.can_id == cob_id.sdo_response(node_id)]
        return mine[-1] if mine else None


def live_through(file: SpecFile, variant: str, seed: int, count: int) -> Iterator[Life]:
    """Give a device that many frames, and yield it after every power cycle among them."""
    device = SimulatedDevice(file, variant=variant, seed=seed)
    life = Life(device, random.Random(seed))  # noqa: S311 - repeatable frames, no secrets
    frames = iter(RandomFrames(seed, device))
    life.restart()
    for start in range(0, count, SESSION):
        life.take(frames, min(SESSION, count - start))
        life.restart()
        yield life
