"""`canopen-conformance` in a process of its own."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path


def run(arguments: Sequence[str], folder: Path, out: Path, err: Path) -> None:
    """Run the command in a folder, with what it prints in two files; leaves by `SystemExit`."""
    from conformance.cli import main  # noqa: PLC0415 - only the process that runs it needs it

    for stream, path in ((sys.stdout, out), (sys.stderr, err)):
        with path.open("wb") as file:
            os.dup2(file.fileno(), stream.fileno())
    os.chdir(folder)
    sys.argv = ["canopen-conformance", *arguments]
    main()
