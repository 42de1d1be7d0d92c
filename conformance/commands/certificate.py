"""The command line's `certificate`: the records of runs as a PDF to sign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from conformance.errors import BenchError
from conformance.report.certificate import certify
from conformance.report.console import console
from conformance.report.inspected import NAME as LOT
from conformance.report.inspected import read_inspected
from conformance.report.record import read_record
from conformance.report.seal import seal_again
from conformance.report.typeset import to_pdf

NAME = "certificate.pdf"


def certificate(
    run: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Folders of runs, or their results.json; or the folder of one inspection.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(help="The PDF; certificate.pdf beside the record, or here for several runs."),
    ] = None,
    lot_title: Annotated[str, typer.Option(help="Title of the lot, as it is to be printed.")] = "",
) -> None:
    """Make a certificate to sign: one or two pages for each device, with a summary of several."""
    inspected = read_inspected(run[0]) if _is_inspection(run) else None
    records = run if inspected is None else inspected.records
    title = lot_title or (inspected.title if inspected else "")
    made = certify((read_record(place) for place in records), title, inspected)
    first = run[0] if run[0].is_dir() else run[0].parent
    path = output or (first if len(run) == 1 else Path()) / NAME
    try:
        path.write_bytes(to_pdf(made))
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror or error}") from error
    if path == first / NAME:
        seal_again(first, NAME)
    if inspected is not None:
        for text in (inspected.verdict, *inspected.declared):
            console.say(text)
    for number, unit in enumerate(made.units, 1):
        partial = ", partial" if unit.partial else ""
        console.say(f"{number}. {unit.product}, serial {unit.serial}: {unit.headline}{partial}")
    console.say(f"certificate: {path}")


def _is_inspection(places: list[Path]) -> bool:
    return len(places) == 1 and (places[0] / LOT).is_file()
