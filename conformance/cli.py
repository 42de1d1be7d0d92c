"""The command line: `canopen-conformance`."""

from __future__ import annotations

import gc
import json
import sys
import traceback
from pathlib import Path
from typing import Annotated, Literal

import typer

from conformance import catalogue as catalogue_of
from conformance import resources, runner
from conformance.commands.certificate import certificate
from conformance.commands.doctor import benches, doctor
from conformance.commands.recover import recover
from conformance.commands.report import report
from conformance.commands.simulate import simulate
from conformance.commands.spec import (
    BenchOption,
    BitrateOption,
    ChannelOption,
    Device,
    FaultOption,
    NodeIdOption,
    ReadingOption,
    ReportDirOption,
    SimulateSpecOption,
    VariantOption,
    spec_app,
)
from conformance.commands.verify import verify
from conformance.commissioning.command import commission
from conformance.comparing.command import compare
from conformance.errors import ConformanceError, SpecError
from conformance.explore.command import explore
from conformance.history.command import DatabaseOption, history, prepared
from conformance.judging.command import judge
from conformance.lots.command import inspect
from conformance.mutants.command import mutants
from conformance.options import RunOptions
from conformance.report import catalogue_page
from conformance.report.console import console
from conformance.report.junit import Suites
from conformance.run import GARBAGE_AT, Run
from conformance.spec.load import load_spec
from conformance.spec.statements import load_statements

BENCH_FAILED = 2
WRONG_USAGE = 3

USAGE_ERROR = 2
INTERRUPTED = 130
"""What typer makes of Ctrl-C."""
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
app.add_typer(spec_app, name="spec")
app.command()(mutants)
app.command()(explore)
app.command()(simulate)
app.command()(recover)
app.command()(report)
app.command()(judge)
app.command()(verify)
app.command()(certificate)
app.command()(benches)
app.command()(doctor)
app.command()(commission)
app.command()(history)
app.command()(compare)
app.command()(inspect)


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
    bench: BenchOption = "simulator",
    channel: ChannelOption = None,
    bitrate: BitrateOption = None,
    variant: VariantOption = None,
    node_id: NodeIdOption = None,
    serial: Annotated[str, typer.Option(help="Serial number for the record.")] = "",
    eds: Annotated[
        str | None, typer.Option(help="The device's EDS, to be heard at each deviation.")
    ] = None,
    select: Annotated[
        str, typer.Option(help="Only items whose id matches, as pytest's -k: 'HB or OD-10'.")
    ] = "",
    repro: Annotated[
        str, typer.Option(help="Only the item with this id, and its frames as cansend lines.")
    ] = "",
    report_dir: ReportDirOption = None,
    simulate_spec: SimulateSpecOption = None,
    fault: FaultOption = None,
    reading: ReadingOption = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Deviations from a 'should' count as well.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 0,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="List what would be run; open and send nothing.")
    ] = False,
    scan: Annotated[
        bool, typer.Option("--scan", help="Then look for objects that the manual does not name.")
    ] = False,
    acceptance: Annotated[
        bool,
        typer.Option("--acceptance", help="All of it, as the spec has it: no option changes that."),
    ] = False,
    baseline: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Deviations that are known: exit code by others alone."),
    ] = None,
    keep: Annotated[
        bool, typer.Option("--history", help="Enter the run into the history.")
    ] = False,
    database: DatabaseOption = "",
    junit_suites: Annotated[
        Suites, typer.Option(help="What a suite of junit.xml holds: a device or a service.")
    ] = "device",
) -> None:
    """Judge a device; exit 0 conforms, 1 deviates, 2 inconclusive or bench failed, 3 usage."""
    options = RunOptions(
        device=device,
        variant=variant,
        bench=bench,
        channel=channel,
        bitrate=bitrate,
        node_id=node_id,
        serial=serial,
        eds=eds,
        simulate_spec=simulate_spec,
        faults=tuple(fault or ()),
        readings=tuple(reading or ()),
        report_dir=report_dir,
        seed=seed,
        strict=strict,
        select=select,
        scan=scan,
        dry_run=dry_run,
        repro=repro,
        acceptance=acceptance,
        baseline=baseline,
        junit_suites=junit_suites,
    )
    entering = prepared(database) if keep else None
    made = Run(options)
    code = runner.run(made)
    if entering is not None and made.directory is not None:
        entering.run(made.directory)
    raise _Judged(code)


@app.command()
def catalogue(
    device: Device,
    variant: Annotated[str | None, typer.Option(help="Look at this variant alone.")] = None,
    format: Annotated[Literal["md", "json"], typer.Option(help="md or json")] = "md",  # noqa: A002 - the option's name
) -> None:
    """List requirements, the manual's statements and checks as one matrix, and what is not covered."""
    file = load_spec(resources.find("device_specs", device, "DEVICE"))
    made = catalogue_of.build(file, variant, load_statements(file))
    text = json.dumps(made, indent=1) if format == "json" else catalogue_page.to_markdown(made)
    sys.stdout.write(text + "\n")


def _code_of(left: SystemExit) -> object:
    """Return the exit code for how typer ended."""
    if left.code == INTERRUPTED:
        console.error("interrupted")
        return BENCH_FAILED
    return WRONG_USAGE if left.code == USAGE_ERROR else left.code


def main() -> None:
    """Run the command line; a mistake of the user gets one sentence and exit code 3."""
    code: object = 0
    gc.set_threshold(GARBAGE_AT)  # a look among all that is loaded takes long and finds little
    try:
        app()
    except _Judged as judged:
        code = judged.code
    except SystemExit as left:
        code = _code_of(left)
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
    gc.freeze()  # nothing is looked for any more in what ends with the process
    sys.exit(code if isinstance(code, int) else 0)
