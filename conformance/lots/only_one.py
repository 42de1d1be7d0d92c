"""One process at a time works on an inspection, for each writes its whole state."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from filelock import FileLock, Timeout

from conformance.errors import BenchError

NAME: Final = ".lock"


@contextmanager
def only_one(folder: Path) -> Iterator[None]:
    """Keep other processes from the inspection in a folder, which is made.

    Raises:
        BenchError: Another process has it, or the disk does not take it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / NAME, blocking=False)
        lock.acquire()
    except Timeout:
        raise BenchError(
            f"the inspection in {folder} goes on in another window or process: end that one first"
        ) from None
    except OSError as error:
        raise BenchError(f"cannot write in {folder}: {error.strerror}") from error
    try:
        yield
    finally:
        lock.release()
