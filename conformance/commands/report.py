"""The command line's `report`: makes the report of runs anew from their records."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from conformance.report.console import console
from conformance.report.record import read_record
from conformance.report.report_page import write_page
from conformance.report.seal import seal_again


def report(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Folders of runs, or their results.json.")
    ],
) -> None:
    """Make report.html anew beside each results.json, from that and trace.log alone."""
    records = [read_record(place) for place in runs]
    for record in records:
        page = write_page(record)
        seal_again(page.parent, page.name)
        console.say(f"report: {page}")
