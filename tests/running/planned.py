"""A man in the middle who does what he was told, and what hypothesis may tell him."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from hypothesis import strategies as st
from meddling import MS, Mischief

from conformance.wire import cob_id
from conformance.wire.frame import Frame

What: TypeAlias = Literal[
    "drop", "double", "delay", "spoil", "replace", "cut", "rename", "insert", "abort"
]
SERVICES = (0x000, 0x080, 0x180, 0x580, 0x600, 0x700, 0x7E4)
LAST = 1 << 40


@dataclass(frozen=True)
class Deed:
    """What is done to some frames of the device.

    Args:
        what: What is done.
        first: The number of the first frame it is done to.
        every: It is done to each so many-th from there on.
        data: What it is done with.
        can_id: Identifier of what is renamed or inserted.
        late_ms: How late a delayed frame goes out.
    """

    what: What
    first: int
    every: int
    data: bytes = b""
    can_id: int = 0
    late_ms: int = 0

    def concerns(self, number: int) -> bool:
        return number >= self.first and (number - self.first) % self.every == 0

    def do(self, frame: Frame) -> list[Frame]:
        """Return what a frame becomes."""
        own = frame.can_id
        spoilt = bytes(a ^ b for a, b in zip(frame.data, self.data.ljust(8, b"\0"), strict=False))
        abort = b"\x80" + frame.data[1:4].ljust(3, b"\0") + self.data[:4].ljust(4, b"\0")
        becomes: dict[What, list[Frame]] = {
            "drop": [],
            "double": [frame, frame],
            "delay": [frame],
            "spoil": [Frame(own, spoilt)],
            "replace": [Frame(own, self.data)],
            "cut": [Frame(own, frame.data[: len(self.data)])],
            "rename": [Frame(self.can_id, frame.data)],
            "insert": [frame, Frame(self.can_id, self.data)],
            "abort": [Frame(own, abort)],
        }
        return becomes[self.what]


class Planned(Mischief):
    """Does deeds.

    Args:
        deeds: What is done to which frames.
    """

    def __init__(self, deeds: Sequence[Deed]) -> None:
        super().__init__(0)
        self._deeds = deeds
        self._said = 0
        self._late_ns = 0

    def answer(self, frame: Frame) -> Iterable[Frame]:
        self._said += 1
        mine = [it for it in self._deeds if it.concerns(self._said)]
        frames = [frame]
        for deed in mine:
            frames = [it for one in frames for it in deed.do(one)]
        self._late_ns = sum(it.late_ms for it in mine) * MS
        self.count += frames != [frame] or self._late_ns > 0
        return frames

    def delay_ns(self) -> int:
        return self._late_ns


def deeds(node_id: int) -> st.SearchStrategy[Deed]:
    """Return deeds to a device with a node-ID: to one frame, or to many."""
    own = [service + node_id if 0 < service < cob_id.LSS_SLAVE else service for service in SERVICES]
    return st.builds(
        Deed,
        what=st.sampled_from(get_args(What)),
        first=st.integers(1, 600),
        every=st.sampled_from((LAST, LAST, 1, 2, 7, 50)),
        data=st.binary(max_size=8),
        can_id=st.sampled_from(own) | st.integers(0, 0x7FF),
        late_ms=st.sampled_from((0, 1, 30, 400, 2000)),
    )
