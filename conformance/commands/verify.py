"""The command line's `verify`: tells whether a record is still what it was when it was sealed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from conformance.report.console import console
from conformance.report.seal import verify as compare

CHANGED = 1


def verify(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Of a run.")],
) -> None:
    """Tell whether record, trace and reports of a run are unchanged; exit 0 if so, 1 if not."""
    verified = compare(folder)
    for problem in verified.problems:
        console.say(problem)
    if verified.problems:
        raise typer.Exit(CHANGED)
    console.say(f"unchanged: {', '.join(verified.same)}")
    console.say(f"seal: {verified.seal}")
