"""The command line's `compare`: what a device does anew, no longer, or still."""

from __future__ import annotations

import sys
from datetime import date
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import typer

from conformance.comparing.baseline import load_baseline, write_baseline
from conformance.comparing.comparison import compare as compared
from conformance.comparing.page import print_comparison, to_json, to_markdown
from conformance.report.console import console
from conformance.report.record import read_record

Form: TypeAlias = Literal["table", "md", "json"]


def compare(
    before: Annotated[Path, typer.Argument(help="Folder of a run, or its results.json.")],
    after: Annotated[Path, typer.Argument(help="The run to hold against it.")],
    baseline: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Deviations that are known.")
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            "--write-baseline",
            metavar="FILE",
            help="Write all that deviates in AFTER to a new one.",
        ),
    ] = None,
    form: Annotated[Form, typer.Option("--format", help="table, md or json")] = "table",
) -> None:
    """Hold one run against another; exit 0 no new deviations, 1 new ones, 2 cannot be told, 3 usage."""
    today = date.today()  # noqa: DTZ011 - a baseline expires by the calendar on the wall
    known = None if baseline is None else load_baseline(baseline, today)
    first, second = read_record(before), read_record(after)
    made = compared(first, second, known)
    if write is not None:
        items = [item.id for item in second.items if second.deviates(item)]
        write_baseline(write, list(dict.fromkeys(items)), today)
        sys.stderr.write(f"{len(items)} deviations: {write}; fill in owner and reason of each\n")
    if form == "table":
        print_comparison(made, console)
    else:
        sys.stdout.write(to_json(made) if form == "json" else to_markdown(made))
    raise typer.Exit(made.exit_code)
