"""The command line: `canopen-conformance`."""

from __future__ import annotations

import json
import sys
import traceback
from pathlib import Path
from typing import Annotated, Literal

import typer

from conformance import catalogue as catalogue_of
from conformance import resources, runner
from conformance.errors import ConformanceError, Problem, SpecError
from conformance.options import RunOptions
from conformance.report import catalogue_page, spec_page
from conformance.report.console import console
from conformance.run import Run
from conformance.spec.load import SpecFile, find_problems, load_spec
from conformance.spec.statements import (
    find_statement_problems,
    is_statements_file,
    load_statements,
    spec_of,
    statements_of,
)

BENCH_FAILED = 2
WRONG_USAGE = 3

USAGE_ERROR = 2
"""What typer exits with; here it means something else."""


class _Judged(Exception):  # noqa: N818 - how a run's exit code leaves the command line parser
    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


app = typer.Typer(
    help="Hold a CANopen device, real or simulated, against its own manual.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
spec_app = typer.Typer(help="Look at and check device specs.", no_args_is_help=True)
app.add_typer(spec_app, name="spec")

Device = Annotated[str, typer.Argument(help="Built-in name (see `devices`) or path of a spec.")]
VariantOption = Annotated[str | None, typer.Option(help="Variant; the spec's first by default.")]
NodeIdOption = Annotated[int | None, typer.Option(help="Node-ID, 1 to 127; the factory's default.")]


@app.command()
def devices() -> None:
    """List the built-in device specs and their variants."""
    rows = []
    for name in resources.names("device_specs"):
        file = load_spec(resources.find("device_specs", name, "DEVICE"))
        info, manual = file.document.device, file.document.manual
        rows.append(
            (
                name,
                f"{info.vendor} {info.name}",
                ", ".join(file.variants),
                manual.name,
            )
        )
    console.table(("device", "product", "variants", "manual"), rows)


@app.command()
def run(
    device: Device,
    bench: Annotated[str, typer.Option(help="Built-in bench or path of a bench file.")] = (
        "simulator"
    ),
    variant: VariantOption = None,
    node_id: NodeIdOption = None,
    serial: Annotated[str, typer.Option(help="Serial number for the record.")] = "",
    select: Annotated[
        str, typer.Option(help="Only items whose id matches, as pytest's -k: 'HB or OD-10'.")
    ] = "",
    report_dir: Annotated[
        Path | None, typer.Option(help="Where the record goes; reports/runs/… by default.")
    ] = None,
    simulate_spec: Annotated[
        str | None, typer.Option(help="Build the simulated device from this spec instead.")
    ] = None,
    fault: Annotated[
        list[str] | None, typer.Option(help="Give the simulated device this defect (repeatable).")
    ] = None,
    reading: Annotated[
        list[str] | None,
        typer.Option(help="ID=N: reading the simulated device follows (repeatable)."),
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Deviations from a 'should' count as well.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
) -> None:
    """Judge a device; exit 0 conforms, 1 deviates, 2 inconclusive or bench failed, 3 usage."""
    options = RunOptions(
        device=device,
        variant=variant,
        bench=bench,
        node_id=node_id,
        serial=serial,
        simulate_spec=simulate_spec,
        faults=tuple(fault or ()),
        readings=tuple(reading or ()),
        report_dir=report_dir,
        seed=seed,
        strict=strict,
        select=select,
    )
    raise _Judged(runner.run(Run(options)))


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


@app.command()
def catalogue(
    device: Device,
    variant: VariantOption = None,
    format: Annotated[Literal["md", "json"], typer.Option(help="md or json")] = "md",  # noqa: A002 - the option's name
) -> None:
    """List requirements, the manual's statements and checks as one matrix, and what is not covered."""
    file = load_spec(resources.find("device_specs", device, "DEVICE"))
    made = catalogue_of.build(file, variant, load_statements(file))
    text = json.dumps(made, indent=1) if format == "json" else catalogue_page.to_markdown(made)
    sys.stdout.write(text + "\n")


def main() -> None:
    """Run the command line; a mistake of the user gets one sentence and exit code 3."""
    code: object = 0
    try:
        app()
    except _Judged as judged:
        code = judged.code
    except SystemExit as left:
        code = WRONG_USAGE if left.code == USAGE_ERROR else left.code
    except KeyboardInterrupt:
        console.error("interrupted")
        code = BENCH_FAILED
    except SpecError as error:
        for problem in error.problems:
            console.error(str(problem))
        code = WRONG_USAGE
    except ConformanceError as error:
        console.error(str(error))
        code = BENCH_FAILED
    except BrokenPipeError:
        code = BENCH_FAILED
    except Exception as error:  # noqa: BLE001 - a defect of the suite says nothing about the device
        traceback.print_exc()
        console.error(f"defect of the suite, please report it: {type(error).__name__}: {error}")
        code = BENCH_FAILED
    sys.exit(code if isinstance(code, int) else 0)
