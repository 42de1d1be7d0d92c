"""The frames of an item, out of the trace beside a record, in words."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from conformance.report.wire_words import WireWords
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.notation import hex_bytes, hex_can_id

MOST_FRAMES = 60
"""Of one item; a person reads no more."""

_LINE = re.compile(r"\((\d+\.\d+)\) \S+ ([0-9A-F]{3}|[0-9A-F]{8})#(R\d?|[0-9A-F]*) ([RT])")
_SLICE = re.compile(r"trace\.log:(\d+)-(\d+)")
_OBJECT = re.compile(r"[0-9A-F]{4}h(:[0-9A-F]{2})?")


@dataclass(frozen=True, slots=True)
class Seen:
    """A frame on the wire.

    Args:
        line: Of the trace.
        time_s: When, on the bench's clock.
        after_ms: Since the frame before with the same CAN-ID; None for the first of the item.
        sent: The bench sent it.
        can_id: As the standards print it.
        data: The same, or that it is a remote frame.
        words: What it says, empty where nobody can tell.
        set_up: It only prepares the check.
    """

    line: int
    time_s: float
    sent: bool
    can_id: str
    data: str
    words: str
    set_up: bool
    after_ms: float | None = None


@dataclass(frozen=True, slots=True)
class Evidence:
    """Frames of an item.

    Args:
        frames: Those that are shown.
        note: Which are not, and why; empty if all are.
    """

    frames: Sequence[Seen] = ()
    note: str = ""


class TraceFile:
    """The trace of a run, if it still lies beside the record.

    Args:
        path: Where it would be.

    Attributes:
        missing: Why it cannot be read, empty if it can.
        sha256: Of the file, empty without it.
    """

    def __init__(self, path: Path) -> None:
        self.missing = self.sha256 = ""
        self._lines: list[str] = []
        self._decoded: tuple[tuple[int, int, int], list[Seen]] = (0, 0, 0), []
        try:
            octets = path.read_bytes()
        except OSError as error:
            self.missing = f"{path.name} cannot be read: {error.strerror or error}"
            return
        self.sha256 = hashlib.sha256(octets).hexdigest()
        self._lines = octets.decode("ascii", "replace").splitlines()

    def evidence(self, place: str, begins: int, about: str) -> Evidence:
        """Return the frames of an item.

        Args:
            place: Its slice of the trace, ``trace.log:12-40``; empty where it has none.
            begins: Line at which the check itself begins.
            about: What it was applied to; of many frames those that name it are shown.
        """
        slice_ = _SLICE.fullmatch(place)
        if slice_ is None:
            return Evidence(note="The item has no frames of its own.")
        if self.missing:
            return Evidence(note=f"The frames are not shown: {self.missing}.")
        first, last = int(slice_[1]), int(slice_[2])
        if last > len(self._lines):
            return Evidence(note=f"The frames are not shown: the trace ends before line {last}.")
        if self._decoded[0] != (first, last, begins):
            words = WireWords()
            seen = [self._seen(n, words, begins) for n in range(first, last + 1)]
            self._decoded = (first, last, begins), list(_apart(seen))
        return _chosen(self._decoded[1], about)

    def _seen(self, line: int, words: WireWords, begins: int) -> Seen:
        text = self._lines[line - 1]
        parts = _LINE.fullmatch(text)
        if parts is None:
            return Seen(line, 0.0, False, "", text, "not a line of a trace", line < begins)
        remote = parts[3].startswith("R")
        can_id = int(parts[2], 16)
        extended = len(parts[2]) > len("7FF")
        try:
            data = b"" if remote else bytes.fromhex(parts[3])
            said = words.of(Frame(can_id, data, remote=remote, extended=extended))
        except (ValueError, WireError):
            return Seen(line, 0.0, False, "", text, "not a frame of CAN", line < begins)
        return Seen(
            line=line,
            time_s=float(parts[1]),
            sent=parts[4] == "T",
            can_id=hex_can_id(can_id, extended=extended),
            data="remote frame" if remote else hex_bytes(data),
            words=said,
            set_up=line < begins,
        )


def _apart(seen: Iterable[Seen]) -> Iterator[Seen]:
    """Tell of each frame how long after the last one with its CAN-ID it came."""
    last_s: dict[str, float] = {}
    for it in seen:
        before_s = last_s.get(it.can_id)
        last_s[it.can_id] = it.time_s
        yield it if before_s is None else replace(it, after_ms=(it.time_s - before_s) * 1000)


def _chosen(seen: Sequence[Seen], about: str) -> Evidence:
    """Return all frames, or those that name an object, or the last ones."""
    if len(seen) <= MOST_FRAMES:
        return Evidence(seen)
    place = _OBJECT.match(about)
    named = [it for it in seen if place and place[0] in it.words]
    chosen = (named or seen)[-MOST_FRAMES:]
    which = f"those that name {place[0]}" if place and named else "the last ones"
    if named and len(named) > MOST_FRAMES:
        which = f"the last of {which}"
    return Evidence(chosen, f"{len(chosen)} of {len(seen)} frames are shown: {which}.")
