"""A file that outlives this process and the computer."""

from __future__ import annotations

import os
from pathlib import Path

from conformance.errors import BenchError


def write_safely(path: Path, text: str) -> None:
    """Put a text on the disk in place of what the file held: all of it, or nothing.

    Args:
        path: The file.
        text: In ASCII.

    Raises:
        BenchError: It cannot be written.
    """
    fresh = path.with_suffix(".new")
    try:
        with fresh.open("w", encoding="ascii") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror}") from error
