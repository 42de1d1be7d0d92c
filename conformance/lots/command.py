"""The command line's `inspect`: the inspection of a delivery, interrupted and resumed at any time."""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from conformance.errors import BenchError, SpecError
from conformance.history.command import DatabaseOption, prepared
from conformance.lots.company import Task
from conformance.lots.declaring import asked_for, declare
from conformance.lots.for_history import for_history
from conformance.lots.inspection import (
    NAME,
    Inspection,
    Running,
    Sampling,
    Try,
    Unit,
    draw,
    load_inspection,
)
from conformance.lots.judging import Judging, require_same
from conformance.lots.kept_series import KeptSeries, kept_series
from conformance.lots.lot_file import Lot, load_lot
from conformance.lots.page import print_plan, print_summary, say_try, to_html
from conformance.lots.plans import plan_of, whole_lot
from conformance.lots.series import concluded, scheme_for
from conformance.lots.statistics import Statistics, statistics_of
from conformance.lots.together import Together
from conformance.lots.verdict import LotVerdict, decide
from conformance.numbers import node_ids
from conformance.report.console import console

FOLDER: Final = Path("reports", "lots")
PAGE: Final = "lot.html"
MOST_SEED: Final = 2**32

IN_VAIN: Final = 2
"""So many units in a row of which no item could be run are the bench's doing."""


def inspect(
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
    work = _Work(read, judging, inspection, folder, series)
    try:
        if dead is None:
            work.do(again)
        else:
            work.make_folder()
    except KeyboardInterrupt:
        raise BenchError("interrupted: inspect the lot again to go on") from None
    finally:
        verdict = work.finish()
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


class _Work:
    """The units of one inspection are judged, one after the other.

    Args:
        lot: The lot.
        judging: How its units are judged.
        inspection: Its state.
        folder: Of the inspection.
        series: Of the lot; None without one.
    """

    def __init__(
        self,
        lot: Lot,
        judging: Judging,
        inspection: Inspection,
        folder: Path,
        series: KeptSeries | None,
    ) -> None:
        self._lot = lot
        self._judging = judging
        self._inspection = inspection
        self._folder = folder
        self._series = series
        self._in_vain = 0
        ids = lot.content.node_ids
        self._node_ids: list[int | None] = [*node_ids("node_ids", ids)] if ids else [None]

    def do(self, again: list[Unit]) -> None:
        """Judge what is to be judged.

        Args:
            again: Units to judge once more, before the others.

        Raises:
            BenchError: The bench failed, or nobody connects a unit.
            KeyboardInterrupt: The user ended it.
        """
        self.make_folder()
        self._tell_broken_off()
        asked = {it.unit for it in again}
        waiting = [it for it in self._waiting() if it.unit not in asked]
        self._inspection.keep(self._folder)
        with ExitStack() as stack:
            together = None
            if len(self._node_ids) > 1 and self._judging.bench.shared:
                together = Together(self._judging, len(self._node_ids))
                stack.callback(together.close)
            for group in self._groups([*again, *waiting]):
                if not self._connect(group):
                    return
                self._judge_group(group, together if len(group) > 1 else None)

    def make_folder(self) -> None:
        """Make the folder of the inspection.

        Raises:
            BenchError: The disk does not take it.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BenchError(f"cannot make {self._folder}: {error.strerror}") from error

    def _waiting(self) -> list[Unit]:
        """Return the units to judge, those that were never reached among them while the lot is not decided."""
        open_ = decide(self._inspection).word == "not decided"
        return [
            it
            for it in self._inspection.units
            if it.declared_so is None
            and (not it.tries or (open_ and not any(tried.reached for tried in it.tries)))
        ]

    def finish(self) -> LotVerdict:
        """Write and print what came of it so far, and return the verdict."""
        verdict, numbers = self._concluded()
        inspection = self._inspection
        page = self._folder / PAGE
        try:
            page.write_text(
                to_html(self._lot, inspection, verdict, numbers), encoding="utf-8", newline="\n"
            )
        except OSError as error:
            raise BenchError(f"cannot write {page}: {error.strerror}") from error
        print_summary(self._lot, inspection, verdict, numbers, console)
        console.say(f"record: {self._folder} ({PAGE}, {NAME}, and a folder for each run)")
        self._note(verdict)
        return verdict

    def _note(self, verdict: LotVerdict) -> None:
        """Note in the series what became of the lot; a lot that was inspected before is no part of it."""
        if self._series is None or self._lot.content.resubmitted:
            return
        if verdict.word != "not decided":
            self._series.note(self._lot, concluded(self._lot, self._inspection, verdict))
        elif self._inspection.concluded:
            self._series.note(self._lot, None)

    def _concluded(self) -> tuple[LotVerdict, Statistics]:
        """Write the state with the verdict and the statistics, and return those."""
        verdict = decide(self._inspection)
        self._inspection.concluded |= verdict.word != "not decided"
        numbers = statistics_of(self._inspection, self._lot.content.serials)
        more: dict[str, Any] = {
            "verdict": {**asdict(verdict), "exit_code": verdict.exit_code},
            "statistics": numbers.as_keys(),
        }
        self._inspection.keep(self._folder, **more)
        return verdict, numbers

    def _tell_broken_off(self) -> None:
        """Tell of runs that were killed; they are run again, in other folders."""
        broken, self._inspection.running = self._inspection.running, []
        for run in broken:
            text = f"the run of unit {run.unit} was broken off, and is run again"
            if not self._judging.bench.simulated:
                text += (
                    "; if that sensor is still connected: canopen-conformance recover "
                    f"{self._folder / run.folder}"
                )
            console.warn(text)

    def _groups(self, units: list[Unit]) -> Iterator[list[tuple[Unit, int | None]]]:
        """Return the units that are on the bus together, each with its node-ID."""
        for first in range(0, len(units), len(self._node_ids)):
            some = units[first : first + len(self._node_ids)]
            yield list(zip(some, self._node_ids, strict=False))

    def _connect(self, group: list[tuple[Unit, int | None]]) -> bool:
        """Have a person connect some units; tell whether that was done. The simulator needs nobody."""
        if self._judging.bench.simulated:
            return True
        words = [
            f"unit {unit.unit}" if node_id is None else f"unit {unit.unit} as node {node_id}"
            for unit, node_id in group
        ]
        console.say(f"connect {', '.join(words)}, and no other; press Enter (q: stop here)")
        try:
            return input().strip().lower() != "q"
        except EOFError as error:
            raise BenchError("nobody is there to connect the units") from error

    def _judge_group(self, group: list[tuple[Unit, int | None]], together: Together | None) -> None:
        """Judge units that are on the bus, and those once more that could not be decided."""
        tasks = {
            unit.unit: self._task(unit, node_id, [it for _, it in group if it != node_id])
            for unit, node_id in group
        }
        if together is None:
            for unit, _ in group:
                self._judge(unit, tasks[unit.unit])
                self._judge_again(unit, tasks[unit.unit])
            return
        self._begin([*tasks.values()])
        units = {unit.unit: unit for unit, _ in group}
        for task, tried in together.judge([*tasks.values()]):
            self._done(units[task.unit], tried)
        for unit, _ in group:
            self._judge_again(unit, tasks[unit.unit])

    def _judge_again(self, unit: Unit, task: Task) -> None:
        """Judge a unit again that could not be decided, as often as the lot file says."""
        for _ in range(self._lot.content.retests):
            if unit.verdict != "undecided" or unit.tries[-1].other:
                break
            self._judge(unit, replace(task, name=self._name(unit)))
        self._look_at_bench(unit)

    def _judge(self, unit: Unit, task: Task) -> None:
        self._begin([task])
        self._done(unit, self._judging.judge(task))

    def _task(self, unit: Unit, node_id: int | None, others: Sequence[int | None]) -> Task:
        ids = tuple(it for it in others if it is not None)
        return Task(unit.unit, node_id, self._folder, self._name(unit), ids)

    def _name(self, unit: Unit) -> str:
        """Return a name for the folder of a unit's next run."""
        name = f"units/{unit.unit}-{len(unit.tries) + 1}"
        while (self._folder / name).exists():  # of a run that was killed
            name += "-again"
        return name

    def _begin(self, tasks: Sequence[Task]) -> None:
        self._inspection.running = [Running(unit=it.unit, folder=it.name) for it in tasks]
        self._inspection.keep(self._folder)

    def _done(self, unit: Unit, tried: Try) -> None:
        """Keep what a run came to, and tell it."""
        inspection = self._inspection
        nth = sum(bool(it.tries) for it in inspection.units) + (not unit.tries)
        tried.doubt_twice({it.serial for other in self._others(unit) for it in other.tries})
        unit.tries.append(tried)
        inspection.running = [it for it in inspection.running if it.unit != unit.unit]
        inspection.keep(self._folder)
        say_try(nth, inspection, unit, console)

    def _others(self, unit: Unit) -> list[Unit]:
        return [it for it in self._inspection.units if it is not unit]

    def _look_at_bench(self, unit: Unit) -> None:
        """Stop where no item could be run of two units in a row.

        Raises:
            BenchError: That is so.
        """
        last = unit.tries[-1]
        self._in_vain = 0 if last.reached else self._in_vain + 1
        if self._in_vain >= IN_VAIN:
            raise BenchError(
                f"{IN_VAIN} units in a row could not be judged; look at the bench: {last.reason}"
            )
