"""What recorders make of a recording: cuts, losses, company of another node, and poor clocks."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import replace

from conformance.judging.recording import Recording, Seen
from conformance.wire.cob_id import LSS_MASTER, LSS_SLAVE, NMT
from conformance.wire.frame import Frame

JITTER_MS = 1.0
AWAY = 5
"""How far the node-ID of the company is from the node's."""

NODE_IDS = 0x7F
FEWEST = 2
"""Frames without which there is nothing to spoil."""

Spoil = Callable[[Recording, random.Random], Recording]


def _numbered(recording: Recording, seen: Sequence[Seen], marked: Sequence[Seen]) -> Recording:
    """Return a recording of some frames, with an error of the bus before some of them."""
    lines = tuple(replace(it, line=line) for line, it in enumerate(seen, start=1))
    before = {id(it) for it in marked}
    breaks = [new.line for new, old in zip(lines, seen, strict=True) if id(old) in before]
    return replace(recording, seen=lines, breaks=tuple(breaks))


def cut(recording: Recording, chance: random.Random) -> Recording:
    """Begin late, and end early."""
    seen = recording.seen
    begins, ends = sorted(chance.sample(range(len(seen) + 1), 2))
    return _numbered(recording, seen[begins:ends], ())


def gaps(recording: Recording, chance: random.Random) -> Recording:
    """Lose some stretches, without a word."""
    return _with_gaps(recording, chance, marked=False)


def marked_gaps(recording: Recording, chance: random.Random) -> Recording:
    """Lose some stretches, with an error of the bus told in their place."""
    return _with_gaps(recording, chance, marked=True)


def _with_gaps(recording: Recording, chance: random.Random, *, marked: bool) -> Recording:
    seen, after = list(recording.seen), []
    for _ in range(chance.choice((1, 2, 5, 30))):
        if len(seen) < FEWEST:
            break
        begins = chance.randrange(len(seen) - 1)
        del seen[begins : min(begins + chance.choice((1, 2, 3, 20, 500)), len(seen) - 1)]
        after.append(seen[min(begins, len(seen) - 1)])
    return _numbered(recording, seen, after if marked else ())


def losses(recording: Recording, chance: random.Random) -> Recording:
    """Lose frames here and there."""
    share = chance.choice((0.0005, 0.005, 0.05))
    return _numbered(recording, [it for it in recording.seen if chance.random() > share], ())


def company(recording: Recording, chance: random.Random) -> Recording:
    """Have the traffic of another node between, at another time, and of the same kind."""
    since_s = recording.seen[0].time_s
    later_s = chance.uniform(0.0, recording.duration_s / 4)
    others = [
        replace(it, time_s=it.time_s + later_s, frame=moved)
        for it in recording.seen
        if (moved := _moved(it.frame)) is not None and it.time_s - since_s > later_s
    ]
    seen = sorted((*recording.seen, *others), key=lambda it: it.time_s)
    return _numbered(recording, seen, ())


def _moved(frame: Frame) -> Frame | None:
    """Return a frame as the other node has it, None where it is of none or of all."""
    if frame.extended or frame.can_id in (LSS_MASTER, LSS_SLAVE):
        return None
    if frame.can_id == NMT:
        if len(frame.data) != 2 or not frame.data[1]:
            return None
        return replace(frame, data=bytes((frame.data[0], _away(frame.data[1]))))
    if not frame.can_id & NODE_IDS:
        return None
    return replace(frame, can_id=frame.can_id & ~NODE_IDS | _away(frame.can_id & NODE_IDS))


def _away(node_id: int) -> int:
    return (node_id - 1 + AWAY) % NODE_IDS + 1


def jitter(recording: Recording, chance: random.Random) -> Recording:
    """Stamp each frame late by chance, in the order in which they came."""
    stamped, last_s = [], 0.0
    for seen in recording.seen:
        last_s = max(last_s, seen.time_s + chance.uniform(0.0, JITTER_MS / 1000))
        stamped.append(replace(seen, time_s=last_s))
    return _numbered(recording, stamped, ())


def poor(recording: Recording, chance: random.Random) -> Recording:
    """Do all of it at once."""
    for spoil in (company, jitter, losses, gaps, cut):
        recording = spoil(recording, chance)
        if len(recording.seen) < FEWEST:
            break
    return recording


SPOILS: tuple[Spoil, ...] = (cut, gaps, marked_gaps, losses, company, jitter, poor)
