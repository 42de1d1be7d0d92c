"""What a walk over the object dictionary found that no manual documents, as data and in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

AREAS = (
    (0x0000, "reserved"),
    (0x0001, "data types"),
    (0x0260, "reserved"),
    (0x1000, "communication profile"),
    (0x2000, "manufacturer-specific"),
    (0x6000, "device profile"),
    (0xA000, "network variables"),
    (0xB000, "system variables"),
    (0xC000, "reserved"),
)
"""First index of each area of an object dictionary (CiA 301 v4.2.0, 7.4)."""

TYPES: Mapping[int, str] = {
    1: "BOOLEAN, INTEGER8 or UNSIGNED8",
    2: "INTEGER16 or UNSIGNED16",
    3: "INTEGER24 or UNSIGNED24",
    4: "INTEGER32, UNSIGNED32 or REAL32",
    5: "INTEGER40 or UNSIGNED40",
    6: "INTEGER48, UNSIGNED48 or a time",
    7: "INTEGER56 or UNSIGNED56",
    8: "INTEGER64, UNSIGNED64 or REAL64",
}
SHORTEST_TEXT = 3
LONGEST_EXPEDITED = 4
MOST_SHOWN = 48


@dataclass(frozen=True, slots=True)
class Undocumented:
    """An entry that answers and is not documented.

    Args:
        object: Its address, ``2FF0h`` or ``2FF0h:01``.
        index: Of the entry.
        sub: Sub-index.
        area: The part of the object dictionary it is in.
        length: Octets it holds, None when it cannot be read to its end.
        type: What the length lets guess.
        hex: What it holds, or the beginning of it.
        text: The same as a text, empty when it is none.
        says: What came instead of a value: an abort, or a violation of the protocol.
        trace: Slice of the trace.
    """

    object: str
    index: int
    sub: int
    area: str
    length: int | None
    type: str
    hex: str
    text: str
    says: str
    trace: str

    def __str__(self) -> str:
        words = (
            ""
            if self.length is None
            else "1 octet"
            if self.length == 1
            else f"{self.length} octets",
            self.type,
            _begin(self.hex),
            f"'{_begin(self.text)}'" if self.text else "",
            self.says,
        )
        return f"{self.object} ({self.area}): {', '.join(word for word in words if word)}"


@dataclass(frozen=True, slots=True)
class Scanned:
    """A walk over the object dictionary.

    Args:
        complete: Every index was asked for.
        ended: Why it ended early, empty if it did not.
        indices: Indices asked for.
        uploads: Uploads done.
        duration_s: On the bench's clock.
        absent: Abort codes by which the node says that something does not exist.
        trace: Slice of the trace.
        undocumented: What answered and is not documented.
    """

    complete: bool
    ended: str
    indices: int
    uploads: int
    duration_s: float
    absent: tuple[str, ...]
    trace: str
    undocumented: tuple[Undocumented, ...]

    def __str__(self) -> str:
        found = len(self.undocumented)
        entries = "1 entry answers" if found == 1 else f"{found or 'no'} entries answer"
        return (
            f"scan of {self.indices} indices ({self.uploads} uploads, {self.duration_s:.0f} s of "
            f"bus time): {entries} that the manual does not document"
        )


def area_of(index: int) -> str:
    """Return the part of the object dictionary an index is in."""
    return next(name for first, name in reversed(AREAS) if index >= first)


def guessed_type(data: bytes) -> str:
    """Return what a value's length lets guess of its data type."""
    if len(data) > LONGEST_EXPEDITED and as_text(data):
        return "a text"
    return TYPES.get(len(data), "a text, an array of octets")


def _begin(text: str) -> str:
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}…"


def as_text(data: bytes) -> str:
    """Return a value as a text, empty when it is hardly one."""
    shown = data.rstrip(b"\0")
    printable = len(shown) >= SHORTEST_TEXT and all(0x20 <= octet < 0x7F for octet in shown)
    return shown.decode("ascii") if printable else ""
