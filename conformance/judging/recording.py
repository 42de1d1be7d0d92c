"""A recording of a bus, as other programs write it: candump's log, Vector's ASC and BLF."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import can

from conformance.errors import SpecError, first_line
from conformance.messages import to_frame
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame, bit_length, priority

FORMATS = {".log": "candump log", ".asc": "ASC", ".blf": "BLF"}
"""What is read, by the ending of the file's name."""

MOST_BEFORE = 200
"""Frames that one may have waited for, at most."""


@dataclass(frozen=True, slots=True)
class Seen:
    """One frame of a recording.

    Args:
        line: Its number among the frames, and its line in the record's ``trace.log``; from 1.
        time_s: Its timestamp.
        frame: What was on the bus.
        received: The recorder did not send it itself, as far as the file says.
    """

    line: int
    time_s: float
    frame: Frame
    received: bool


@dataclass(frozen=True, slots=True)
class Recording:
    """What a file holds.

    Args:
        path: The file.
        sha256: Of the file.
        seen: The frames, in the file's order.
        breaks: Lines before which frames may be missing or out of order: time runs backwards, or
            the recorder tells of an error.
        left_out: How many entries are no classical CAN frames.
    """

    path: Path
    sha256: str
    seen: tuple[Seen, ...]
    breaks: tuple[int, ...]
    left_out: int

    @property
    def format(self) -> str:
        """The file's format."""
        return FORMATS[self.path.suffix.lower()]

    @property
    def duration_s(self) -> float:
        """From the first frame to the last one."""
        return max(0.0, self.seen[-1].time_s - self.seen[0].time_s)

    def waited_s(self, seen: Seen, bitrate: int, jitter_s: float) -> float:
        """Return how long a frame may have waited for others that go first.

        Args:
            seen: The frame.
            bitrate: Of the bus, in bit/s.
            jitter_s: How far a timestamp may be off.
        """
        rank, busy_s, waited_s = priority(seen.frame), bit_length(seen.frame) / bitrate, 0.0
        for other in reversed(self.seen[max(0, seen.line - 1 - MOST_BEFORE) : seen.line - 1]):
            if not 0 <= seen.time_s - other.time_s <= busy_s + 2 * jitter_s:
                break
            waited_s += bit_length(other.frame) / bitrate
            busy_s += bit_length(other.frame) / bitrate
            if priority(other.frame) > rank:
                break
        return waited_s


def read_recording(path: Path, channel: str | None = None) -> Recording:
    """Read a recording.

    Args:
        path: The file; its name's ending tells the format.
        channel: Only the frames of this channel; None where there is one alone.

    Raises:
        SpecError: It cannot be read, or has no frames of one bus.
    """
    if path.suffix.lower() not in FORMATS:
        known = ", ".join(f"{name} ({ending})" for ending, name in FORMATS.items())
        raise SpecError(f"{path}: expected a recording as {known}, got another ending")
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise SpecError(
            f"{path}: expected a readable file, got {error.strerror or error}"
        ) from error
    messages = _messages(path)
    channels = dict.fromkeys(str(it.channel) for it in messages if not it.is_error_frame)
    if channel is not None and channel not in channels:
        raise SpecError(f"--channel: expected one of {', '.join(channels)}, got {channel!r}")
    if channel is None and len(channels) > 1:
        raise SpecError(f"{path}: expected --channel, one of {', '.join(channels)}, got none")
    chosen = [it for it in messages if channel is None or str(it.channel) == channel]
    seen, breaks = _frames(chosen)
    if not seen:
        raise SpecError(f"{path}: expected CAN frames, got none")
    return Recording(path, digest, seen, breaks, len(chosen) - len(seen))


def _frames(messages: list[can.Message]) -> tuple[tuple[Seen, ...], tuple[int, ...]]:
    """Return the classical CAN frames, and before which of them something may be missing."""
    seen: list[Seen] = []
    breaks: list[int] = []
    for message in messages:
        line = len(seen) + 1
        try:
            frame = None if message.is_error_frame or message.is_fd else to_frame(message)
        except WireError:
            frame = None
        if frame is None:
            breaks.append(line)
            continue
        if seen and message.timestamp < seen[-1].time_s:
            breaks.append(line)
        seen.append(Seen(line, message.timestamp, frame, message.is_rx))
    return tuple(seen), tuple(dict.fromkeys(it for it in breaks if it <= len(seen)))


def _messages(path: Path) -> list[can.Message]:
    """Return what a file holds, errors on the bus included.

    Raises:
        SpecError: The library cannot read it, or it tells no time.
    """
    messages: list[can.Message] = []
    try:
        with can.LogReader(path) as reader:
            messages.extend(reader)
    except Exception as error:  # what a library says of a damaged file is not documented
        raise SpecError(
            f"{path}: expected a {FORMATS[path.suffix.lower()]}, got what cannot be read after "
            f"{len(messages)} frames: {type(error).__name__}: {first_line(error)}"
        ) from error
    for place, message in enumerate(messages, start=1):
        if not math.isfinite(message.timestamp):
            raise SpecError(f"{path}: frame {place}: expected a time, got {message.timestamp}")
    return messages
