"""The command line's `spec` commands: look at device specs, check them, EDS in and out."""

from __future__ import annotations

import json
import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

import typer

from conformance import catalogue as catalogue_of
from conformance import resources
from conformance.errors import Problem, SpecError
from conformance.report import eds_page, spec_page
from conformance.report.console import console
from conformance.spec.eds.compare import compare
from conformance.spec.eds.reader import read_eds
from conformance.spec.eds.to_spec import import_eds
from conformance.spec.eds.writer import to_eds
from conformance.spec.load import SpecFile, find_problems, load_spec
from conformance.spec.statements import (
    find_statement_problems,
    is_statements_file,
    spec_of,
    statements_of,
)

Device = Annotated[str, typer.Argument(help="Built-in name (see `devices`) or path of a spec.")]
VariantOption = Annotated[str | None, typer.Option(help="Variant; the spec's first by default.")]
NodeIdOption = Annotated[int | None, typer.Option(help="Node-ID, 1 to 127; the factory's default.")]
BenchOption = Annotated[str, typer.Option(help="Built-in bench or path of a bench file.")]
ChannelOption = Annotated[
    str | None, typer.Option(help="Another channel than that of the bench's file.")
]
BitrateOption = Annotated[
    int | None, typer.Option(help="Another bit rate than the bench's, in bit/s.")
]
SimulateSpecOption = Annotated[
    str | None, typer.Option(help="Build the simulated device from this spec instead.")
]
FaultOption = Annotated[
    list[str] | None, typer.Option(help="Give the simulated device this defect (repeatable).")
]
ReadingOption = Annotated[
    list[str] | None,
    typer.Option(help="ID=N: reading the simulated device follows (repeatable)."),
]
ReportDirOption = Annotated[
    Path | None, typer.Option(help="Where the record goes; reports/runs/… by default.")
]
EdsFile = Annotated[Path, typer.Argument(help="EDS or DCF file.")]
OutputOption = Annotated[
    Path | None, typer.Option(help="A new file to write to; standard output by default.")
]

DIFFERENT = 1

spec_app = typer.Typer(help="Look at and check device specs; EDS in and out.", no_args_is_help=True)


@spec_app.command()
def show(
    device: Device,
    variant: VariantOption = None,
    node_id: NodeIdOption = None,
    format: Annotated[Literal["table", "json"], typer.Option(help="table or json")] = "table",  # noqa: A002 - the option's name
) -> None:
    """Show what a spec says, expressions evaluated."""
    file = load_spec(resources.find("device_specs", device, "DEVICE"))
    spec = file.resolve(variant, node_id)
    if format == "json":
        sys.stdout.write(json.dumps(spec_page.to_json(spec), indent=1) + "\n")
    else:
        spec_page.print_table(spec, console)


@spec_app.command()
def lint(files: Annotated[list[Path], typer.Argument(help="Spec or statements files.")]) -> None:
    """Report every problem of some spec files and of the statements beside them."""
    problems: list[Problem] = []
    for path in dict.fromkeys(spec_of(p) if is_statements_file(p) else p for p in files):
        asked = statements_of(path) in files
        file, found = find_problems(path)
        problems += found
        if file is None:
            continue
        entries = len(file.resolve().entries)
        console.say(f"{path}: good ({entries} entries, {len(file.variants)} variants)")
        if asked or statements_of(path).exists():
            problems += _lint_statements(file)
    if problems:
        raise SpecError(*problems)


def _lint_statements(spec: SpecFile) -> list[Problem]:
    statements, problems = find_statement_problems(spec)
    if statements is not None:
        problems = catalogue_of.find_requirement_problems(spec, statements)
        if not problems:
            path, count = statements.yaml.path, len(statements.statements)
            console.say(f"{path}: good ({count} statements)")
    return problems


@spec_app.command("from-eds")
def from_eds(file: EdsFile, output: OutputOption = None) -> None:
    """Make a starting spec from an EDS or DCF file; what is odd about it goes to standard error."""
    imported = import_eds(file)
    for problem in imported.problems:
        console.warn(str(problem))
    _write(imported.text, output)


@spec_app.command("to-eds")
def export_eds(
    device: Device,
    variant: VariantOption = None,
    node_id: Annotated[
        int | None, typer.Option(help="Node-ID to evaluate formulas with; they stay by default.")
    ] = None,
    output: OutputOption = None,
) -> None:
    """Write what an EDS can hold of a spec as an EDS."""
    file = load_spec(resources.find("device_specs", device, "DEVICE"))
    name = f"{file.name}.eds" if output is None else output.name
    _write(to_eds(file, variant, node_id, name, datetime.now().astimezone()), output)


@spec_app.command()
def diff(
    device: Device,
    file: EdsFile,
    variant: VariantOption = None,
    node_id: NodeIdOption = None,
    show_all: Annotated[
        bool, typer.Option("--all", help="Also names, and what only one of both says.")
    ] = False,
    format: Annotated[Literal["table", "json"], typer.Option(help="table or json")] = "table",  # noqa: A002 - the option's name
) -> None:
    """Set a device's manual against its EDS, row by row; exit 0 if nothing differs, 1 if something."""
    eds = read_eds(file)
    spec = load_spec(resources.find("device_specs", device, "DEVICE")).resolve(variant, node_id)
    rows = compare(spec, eds)
    if format == "json":
        sys.stdout.write(json.dumps(eds_page.to_json(spec, eds, rows), indent=1) + "\n")
    else:
        eds_page.print_table(spec, eds, rows, console, show_all=show_all)
    if any(row.differs for row in rows):
        raise typer.Exit(DIFFERENT)


def _write(text: str, output: Path | None) -> None:
    """Write a file that does not exist yet, or to standard output."""
    if output is None:
        sys.stdout.buffer.write(text.encode())
        sys.stdout.buffer.flush()
        return
    try:
        with output.open("xb") as file:
            file.write(text.encode())
    except FileExistsError as error:
        raise SpecError(f"--output: expected a new file, got {str(output)!r}") from error
    except OSError as error:
        raise SpecError(f"--output: cannot write {output}: {error.strerror or error}") from error
