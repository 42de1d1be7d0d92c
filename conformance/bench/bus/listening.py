"""What can be told of a bus by listening to it, and of the computer that listens."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from conformance.bench.bus.link import Link, Stamped
from conformance.wire import cob_id
from conformance.wire.frame import Frame

_WAITS: Final = 100
_WAIT_S: Final = 1e-3
_SENT_BY_NODES: Final = {
    0x080: "EMCY",
    0x180: "TPDO 1",
    0x280: "TPDO 2",
    0x380: "TPDO 3",
    0x480: "TPDO 4",
    0x580: "SDO response",
    0x700: "heartbeat",
}
"""What a node sends by its CAN-ID less its node-ID (CiA 301 v4.2.0, 7.3.3)."""

_NODE_ID: Final = 0x7F


@dataclass
class Heard:
    """What came while nothing was sent.

    Args:
        frames: How many frames.
        nodes: By node-ID what a node sent, and how often; as far as CAN-IDs are predefined.
        others: How many frames no node sends by the predefined connection set.
        late_ms: By how much each frame's timestamp may be late.
        errors: What the adapter told of its bus, empty if nothing.
    """

    frames: int = 0
    nodes: dict[int, Counter[str]] = field(default_factory=dict)
    others: int = 0
    late_ms: list[float] = field(default_factory=list)
    errors: str = ""


def hear(link: Link, seconds: float) -> Heard:
    """Listen for a while.

    Raises:
        BenchError: The adapter failed, or left the bus.
    """
    link.trouble.begin()
    heard = Heard()
    for stamped in link.listen(seconds, lambda _: True):
        _add(heard, stamped)
    heard.errors = str(link.trouble)
    return heard


def _add(heard: Heard, stamped: Stamped) -> None:
    heard.frames += 1
    heard.late_ms.append(stamped.late_ms)
    kind = sent_by_node(stamped.frame)
    if kind is None:
        heard.others += 1
        return
    heard.nodes.setdefault(stamped.frame.can_id & _NODE_ID, Counter())[kind] += 1


def sent_by_node(frame: Frame) -> str | None:
    """Return what a node sends on a frame's CAN-ID, None where no node does."""
    if frame.extended or frame.remote or not frame.can_id & _NODE_ID:
        return None
    if frame.can_id == cob_id.LSS_SLAVE:
        return None
    kind = _SENT_BY_NODES.get(frame.can_id & ~_NODE_ID)
    return "boot-up" if kind == "heartbeat" and frame.data == b"\0" else kind


@dataclass(frozen=True, slots=True)
class Spread:
    """How times are spread, in ms.

    Args:
        p50: Half of them are no longer.
        p99: Ninety-nine in a hundred are no longer.
        longest: None is longer.
    """

    p50: float
    p99: float
    longest: float

    def __str__(self) -> str:
        return f"p50 {self.p50:.3f}, p99 {self.p99:.3f}, at most {self.longest:.3f} ms"


def spread(times_ms: Iterable[float]) -> Spread | None:
    """Return how times are spread, None without any."""
    ordered = sorted(times_ms)
    if not ordered:
        return None
    return Spread(_share(ordered, 0.5), _share(ordered, 0.99), round(ordered[-1], 4))


def _share(ordered: Sequence[float], share: float) -> float:
    return round(ordered[math.ceil(share * len(ordered)) - 1], 4)


def overshoot(link: Link) -> Spread | None:
    """Return by how much waits of 1 ms are too long: how far the computer's clock can be trusted."""
    late_ms = []
    for _ in range(_WAITS):
        deadline = link.now() + _WAIT_S
        while link.recv(deadline) is not None:
            pass
        late_ms.append(max(0.0, link.now() - deadline) * 1000)
    return spread(late_ms)
