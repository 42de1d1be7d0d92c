"""The command line's `mutants`: every defect of a device before the suite."""

from __future__ import annotations

import json
import time
from typing import Annotated, Self

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from conformance.commands.spec import Device, ReportDirOption, VariantOption
from conformance.mutants.campaign import Campaign
from conformance.mutants.matrix import Matrix, Row
from conformance.report.console import console
from conformance.report.folder import make_folder
from conformance.report.mutants_page import to_html

SURVIVORS = 1
SAID_EVERY_S = 10.0


def mutants(
    device: Device,
    variant: VariantOption = None,
    only: Annotated[str, typer.Option(help="Only defects with this in their id.")] = "",
    sample: Annotated[
        int | None, typer.Option(min=1, help="So many of them, chosen by the seed.")
    ] = None,
    whole: Annotated[
        bool, typer.Option("--whole", help="Run every item against every defect.")
    ] = False,
    processes: Annotated[
        int | None, typer.Option(min=1, help="How many at once; one per core by default.")
    ] = None,
    report_dir: ReportDirOption = None,
    seed: Annotated[int, typer.Option(help="Seed of the sample and of the device.")] = 0,
) -> None:
    """Give the simulated device one defect after the other; exit 1 if one goes unseen."""
    folder = make_folder(report_dir, "mutants")
    started = time.monotonic()
    campaign = Campaign(device, folder, variant, only, sample, whole, processes, seed)
    with _Told() as told:
        matrix, useless = campaign.run(told)
    data = matrix.to_json() | {
        "device": device,
        "variant": variant or "",
        "seed": seed,
        "whole": whole,
        "wall_s": round(time.monotonic() - started, 1),
        "useless_equivalents": useless,
    }
    (folder / "mutants.json").write_text(json.dumps(data, indent=1), encoding="utf-8")
    (folder / "mutants.html").write_text(to_html(data), encoding="utf-8")
    if not only and sample is None:
        _say_requirements(matrix)
    _say(matrix, useless, data["wall_s"])
    console.say(f"record: {folder} (mutants.json, mutants.html)")
    raise typer.Exit(SURVIVORS if _unseen(matrix) or useless else 0)


class _Told:
    """A bar on a terminal, a line now and then elsewhere."""

    def __init__(self) -> None:
        self._lines = not console.out.is_terminal
        self._bar = Progress(
            TextColumn("{task.description:<30.30}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            console=console.out,
            transient=True,
            disable=self._lines,
        )
        self._task = self._bar.add_task("the device as documented", total=None)
        self._said = time.monotonic()

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._bar.stop()

    def __call__(self, done: int, total: int, row: Row) -> None:
        self._bar.update(self._task, total=total, completed=done, description=row.outcome.defect.id)
        if self._lines and time.monotonic() - self._said >= SAID_EVERY_S:
            self._said = time.monotonic()
            console.say(f"{done} of {total} defects")


def _unseen(matrix: Matrix) -> list[Row]:
    return [
        row for row in matrix.rows if row.fate in ("survived", "open") or row.wrongly_equivalent
    ]


def _say_requirements(matrix: Matrix) -> None:
    kills, first, accused = matrix.kills, matrix.first, matrix.accused
    console.table(
        ("requirement", "items", "killed", "first to see", "beside another's defect"),
        (
            (name, str(items), str(kills[name]), str(first[name]), str(accused[name]))
            for name, items in sorted(matrix.requirements.items())
        ),
    )
    console.say()


def _say(matrix: Matrix, useless: list[str], wall_s: float) -> None:
    for row in _unseen(matrix):
        console.say(f"{_fate(row)}: {row.outcome.defect.id}: {row.outcome.defect.what}")
    for pattern in useless:
        console.say(f"useless: {pattern}: the list of equivalents names a defect that there is not")
    total = matrix.summary
    killed = total["killed"]
    right = f" ({100 * total['first_right'] / killed:.1f} %)" if killed else ""
    console.say(
        f"{total['defects']} defects: {killed} killed, {total['survived']} survived, "
        f"{total['open']} open, {total['equivalent']} equivalent"
    )
    console.say(
        f"the first item that failed named the defect itself: {total['first_right']} of {killed}"
        f"{right}; accused wrongly: {total['accused_wrongly']}"
    )
    console.say(
        f"requirements that saw one: {total['requirements'] - len(total['requirements_without_kill'])}"
        f" of {total['requirements']}; {wall_s:g} s"
    )


def _fate(row: Row) -> str:
    if row.wrongly_equivalent:
        return f"not equivalent (seen by {row.outcome.failed[0]})"
    left = row.outcome.aborted or next(iter(row.outcome.open.values()), "")
    return f"open ({left})" if row.fate == "open" else "survived"
