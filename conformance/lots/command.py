"""The command line's `inspect`: the inspection of a delivery, interrupted and resumed at any time."""

from __future__ import annotations

import secrets
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Final

import typer

from conformance.errors import BenchError, SpecError
from conformance.history.command import DatabaseOption, prepared
from conformance.lots.closing import close
from conformance.lots.declaring import asked_for, declare
from conformance.lots.for_history import for_history
from conformance.lots.inspection import Inspection, Sampling, Unit, draw, load_inspection
from conformance.lots.judging import Judging, require_same
from conformance.lots.kept_series import KeptSeries, kept_series
from conformance.lots.lot_file import Lot, load_lot
from conformance.lots.only_one import only_one
from conformance.lots.page import print_plan
from conformance.lots.plans import plan_of, whole_lot
from conformance.lots.series import scheme_for
from conformance.lots.work import Work
from conformance.report.console import console

FOLDER: Final = Path("reports", "lots")
MOST_SEED: Final = 2**32


def inspect(
    context: typer.Context,
    lot: Annotated[Path, typer.Argument(metavar="LOT", help="Lot file.")],
    report_dir: Annotated[
        Path | None,
        typer.Option(help="Folder of the inspection; reports/lots/NAME of the lot file if absent."),
    ] = None,
    retest: Annotated[
        list[int] | None,
        typer.Option(metavar="UNIT", help="Judge this unit once more (repeatable)."),
    ] = None,
    nonconforming: Annotated[
        int | None,
        typer.Option(
            metavar="UNIT", help="Declare a unit nonconforming that no run decides; judge nothing."
        ),
    ] = None,
    reason: Annotated[str, typer.Option(metavar="TEXT", help="Why it is declared so.")] = "",
    by: Annotated[str, typer.Option(metavar="NAME", help="Who declares it so.")] = "",
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say which units are drawn; open and write nothing.")
    ] = False,
    keep: Annotated[
        bool, typer.Option("--history", help="Enter the lot and its runs into the history.")
    ] = False,
    database: DatabaseOption = "",
) -> None:
    """Inspect a lot, or go on with it; exit 0 accepted, 1 not accepted, 2 not decided, 3 usage."""
    dead = asked_for(nonconforming, by, reason, alone=not retest and not dry_run)
    read = load_lot(lot)
    judging = Judging.of(read)
    folder = report_dir or FOLDER / lot.stem
    if not dry_run:
        context.with_resource(only_one(folder))
    begun = load_inspection(folder)
    if (
        begun is not None
        and begun.sha256 != read.sha256
        and not any(it.tries or it.declared for it in begun.units)
    ):
        begun = None  # nothing was judged by the file as it was
    if begun is not None:
        require_same(read, begun.sha256, folder)
    shared = read.content.series_shared
    entering = prepared(database, create=not dry_run) if keep and (shared or not dry_run) else None
    series = kept_series(read, entering)
    inspection = begun or _begin(read, series)
    again = _drawn(inspection, retest or [])
    if dead is not None:
        declare(inspection, dead, by, reason, datetime.now(UTC))
    print_plan(read, inspection, console, drawn=not dry_run or begun is not None)
    if dry_run:
        return
    work = Work(read, judging, inspection, folder)
    try:
        if dead is None:
            work.do(again)
    except KeyboardInterrupt:
        raise BenchError("interrupted: inspect the lot again to go on") from None
    finally:
        verdict = close(read, inspection, folder, series)
    if entering is not None:
        entering.lot(*for_history(read, inspection, folder, verdict.word))
    if verdict.word == "not decided":
        raise BenchError("the lot is not decided yet: inspect it again to go on")
    raise typer.Exit(verdict.exit_code)


def _begin(lot: Lot, series: KeptSeries | None) -> Inspection:
    """Return an inspection that has not begun: the plan, and the units drawn."""
    content = lot.content
    severity = content.severity or "normal"
    if series is not None:
        severity = scheme_for(lot, series.load(lot)).severity
    if content.level == "all" or content.aql is None:
        plan = Sampling(**asdict(whole_lot(content.units)))
    else:
        made = plan_of(content.units, content.level, content.aql, severity)
        plan = Sampling(**asdict(made), severity=severity)
    seed = secrets.randbelow(MOST_SEED) if content.seed is None else content.seed
    return Inspection(
        lot=content.model_dump(mode="json", exclude_none=True),
        sha256=lot.sha256,
        plan=plan,
        seed=seed,
        units=[Unit(unit=it) for it in draw(content.names, plan.sample, seed)],
    )


def _drawn(inspection: Inspection, asked: list[int]) -> list[Unit]:
    """Return the units to judge once more."""
    known = {it.unit: it for it in inspection.units}
    for unit in asked:
        if unit not in known:
            raise SpecError(f"--retest: expected a unit that was drawn, got {unit}")
    return [known[unit] for unit in asked]
