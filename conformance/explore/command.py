"""The command line's `explore`: random steps on a device and on a model of it."""

from __future__ import annotations

import importlib.util
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from conformance.errors import BenchError, SpecError
from conformance.explore.exploration import explore as explore_device
from conformance.explore.page import to_text
from conformance.options import RunOptions
from conformance.report.console import console
from conformance.spec_commands import Device, NodeIdOption, VariantOption

DIFFERENT = 1
TRACE = "trace.log"
TEXT = "explore.txt"


def explore(
    device: Device,
    steps: Annotated[int, typer.Option(min=1, help="How many steps to take, about.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the choice and of the device.")] = 0,
    variant: VariantOption = None,
    bench: Annotated[str, typer.Option(help="Built-in bench or path of a bench file.")] = (
        "simulator"
    ),
    node_id: NodeIdOption = None,
    fault: Annotated[
        list[str] | None, typer.Option(help="Give the simulated device this defect (repeatable).")
    ] = None,
    reading: Annotated[
        list[str] | None,
        typer.Option(help="ID=N: reading the simulated device follows (repeatable)."),
    ] = None,
    simulate_spec: Annotated[
        str | None, typer.Option(help="Build the simulated device from this spec instead.")
    ] = None,
    report_dir: Annotated[
        Path | None, typer.Option(help="Where the record goes; reports/runs/… by default.")
    ] = None,
) -> None:
    """Take a device and a model of it through random steps; exit 1 if they differ, 2 bench failed."""
    if importlib.util.find_spec("hypothesis") is None:
        raise SpecError("explore needs hypothesis: pip install 'canopen-conformance[explore]'")
    options = RunOptions(
        device=device,
        variant=variant,
        bench=bench,
        node_id=node_id,
        simulate_spec=simulate_spec,
        faults=tuple(fault or ()),
        readings=tuple(reading or ()),
        seed=seed,
    )
    folder = _folder(report_dir)
    explored = explore_device(options, steps, folder / TRACE)
    text = to_text(explored)
    (folder / TEXT).write_text(text, encoding="utf-8")
    console.say(text.rstrip())
    kept = f"{TEXT}, {TRACE}" if explored.finding else TEXT
    console.say(f"record: {folder} ({kept})")
    raise typer.Exit(DIFFERENT if explored.finding else 0)


def _folder(asked: Path | None) -> Path:
    stamp = f"{datetime.now():%Y%m%d-%H%M%S}-explore"  # noqa: DTZ005 - for people, local
    folder = asked or Path("reports", "runs", stamp)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BenchError(f"cannot make {folder}: {error.strerror}") from error
    return folder
