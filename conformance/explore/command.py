"""The command line's `explore`: random steps on a device and on a model of it."""

from __future__ import annotations

from typing import Annotated

import typer

from conformance.commands.spec import (
    BenchOption,
    Device,
    FaultOption,
    NodeIdOption,
    ReadingOption,
    ReportDirOption,
    SimulateSpecOption,
    VariantOption,
)
from conformance.explore.exploration import explore as explore_device
from conformance.explore.page import to_text
from conformance.options import RunOptions
from conformance.report.console import console
from conformance.report.folder import make_folder

DIFFERENT = 1
TRACE = "trace.log"
TEXT = "explore.txt"


def explore(
    device: Device,
    steps: Annotated[int, typer.Option(min=1, help="How many steps to take at most.")] = 1000,
    seed: Annotated[int, typer.Option(help="Seed of the choice and of the device.")] = 0,
    variant: VariantOption = None,
    bench: BenchOption = "simulator",
    node_id: NodeIdOption = None,
    fault: FaultOption = None,
    reading: ReadingOption = None,
    simulate_spec: SimulateSpecOption = None,
    report_dir: ReportDirOption = None,
) -> None:
    """Take a device and a model of it through random steps; exit 1 if they differ, 2 bench failed."""
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
    folder = make_folder(report_dir, "explore")
    explored = explore_device(options, steps, folder / TRACE)
    text = to_text(explored)
    (folder / TEXT).write_text(text, encoding="utf-8")
    console.say(text.rstrip())
    kept = f"{TEXT}, {TRACE}" if explored.finding else TEXT
    console.say(f"record: {folder} ({kept})")
    raise typer.Exit(DIFFERENT if explored.finding else 0)
