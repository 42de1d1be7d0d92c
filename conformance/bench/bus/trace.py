"""The record of every frame with time and direction, in candump's log format."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from conformance.wire.frame import Frame


class Trace:
    """Writes frames to a file, one line each; without a file it only counts.

    Args:
        path: The file, overwritten.
        channel: Name of the channel in each line.
    """

    def __init__(self, path: Path | None = None, channel: str = "can0") -> None:
        self._file: TextIO | None = None
        if path is not None:
            self._file = path.open("w", encoding="ascii", newline="\n")
        self._channel = channel
        self.lines = 0

    def add(self, time_s: float, frame: Frame, *, received: bool) -> int:
        """Record a frame.

        Returns:
            The 1-based line it stands on.
        """
        self.lines += 1
        if self._file is not None:
            identifier = f"{frame.can_id:08X}" if frame.extended else f"{frame.can_id:03X}"
            content = f"R{frame.dlc or ''}" if frame.remote else frame.data.hex().upper()
            direction = "R" if received else "T"
            self._file.write(f"({time_s:.6f}) {self._channel} {identifier}#{content} {direction}\n")
        return self.lines

    def flush(self) -> None:
        """Hand what was recorded to the operating system."""
        if self._file is not None:
            self._file.flush()

    def close(self) -> None:
        """End the record."""
        if self._file is not None:
            self._file.close()
            self._file = None
