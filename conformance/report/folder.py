"""The folder of a record: the one asked for, or a new one named by the time."""

from __future__ import annotations

import itertools
from datetime import datetime
from pathlib import Path

from conformance.errors import BenchError


def make_folder(asked: Path | None, *parts: str) -> Path:
    """Make the folder for a record.

    Args:
        asked: The one that the user wants, new or not; None for a new one in ``reports/runs``.
        parts: What its name says behind the time; empty ones are left out.

    Raises:
        BenchError: It cannot be made.
    """
    if asked is not None:
        folder, more = asked, iter((asked,))
    else:
        stamp = datetime.now().strftime("%Y%m%d-%H%M%S")  # noqa: DTZ005 - for people, local
        folder = Path("reports", "runs", "-".join(filter(None, (stamp, *parts))))
        others = (folder.with_name(f"{folder.name}-{n}") for n in itertools.count(2))
        more = itertools.chain((folder,), others)
    for folder in more:
        try:
            folder.mkdir(parents=True, exist_ok=asked is not None)
        except FileExistsError:
            continue
        except OSError as error:
            raise BenchError(f"cannot make {folder}: {error.strerror}") from error
        return folder
    raise BenchError(f"cannot make {folder}: there is a file of that name")
