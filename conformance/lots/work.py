"""The units of an inspection are judged, in groups that are on the bus together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from conformance.errors import BenchError
from conformance.lots.company import Task
from conformance.lots.fresh import Fresh, Group, left_behind
from conformance.lots.inspection import Inspection, Running, Try, Unit
from conformance.lots.judging import Judging
from conformance.lots.lot_file import Lot
from conformance.lots.page import say_try
from conformance.lots.together import Together
from conformance.lots.verdict import decide
from conformance.numbers import node_ids
from conformance.report.console import console

IN_VAIN: Final = 2
"""So many units in a row of which no item could be run are the bench's doing."""


class Work:
    """The units of one inspection are judged.

    Args:
        lot: The lot.
        judging: How its units are judged.
        inspection: Its state.
        folder: Of the inspection.
    """

    def __init__(
        self,
        lot: Lot,
        judging: Judging,
        inspection: Inspection,
        folder: Path,
    ) -> None:
        self._lot = lot
        self._judging = judging
        self._inspection = inspection
        self._folder = folder
        self._in_vain = 0
        self._together: Together | None = None
        self._fresh: Fresh | None = None
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
        self._tell_broken_off()
        asked = {it.unit for it in again}
        waiting = [it for it in self._waiting() if it.unit not in asked]
        self._inspection.keep(self._folder)
        with ExitStack() as stack:
            if self._node_ids != [None] and self._judging.bench.shared:
                self._together = Together(self._judging, len(self._node_ids))
                stack.callback(self._together.close)
            if self._lot.content.commission:
                self._fresh = self._units_fresh()
            for group in self._groups([*again, *waiting]):
                if not self._connect(group):
                    return
                with self._in_place(group) as placed:
                    self._judge_group(placed)
                there = [unit.unit for unit, _ in placed]
                if not self._judge_alone([unit for unit, _ in group if unit.unit not in there]):
                    return

    def _units_fresh(self) -> Fresh:
        judging, folder, together = self._judging, self._folder, self._together
        if together is None:
            return Fresh(judging, folder, judging.bench)
        return Fresh(judging, folder, together.bench, together.options)

    def _waiting(self) -> list[Unit]:
        """Return the units to judge, those that were never reached among them while the lot is not decided."""
        open_ = decide(self._inspection).word == "not decided"
        return [
            it
            for it in self._inspection.units
            if it.declared_so is None
            and (not it.tries or (open_ and not any(tried.reached for tried in it.tries)))
        ]

    def _tell_broken_off(self) -> None:
        """Tell of runs that were killed; what is run again is, in other folders."""
        broken, self._inspection.running = self._inspection.running, []
        again = {it.unit for it in self._waiting()}
        for run in broken:
            text = f"the run of unit {run.unit} was broken off"
            if run.unit in again:
                text += ", and is run again"
            if not self._judging.bench.simulated:
                text += (
                    "; if that sensor is still connected: canopen-conformance recover "
                    f"{self._folder / run.folder}"
                )
            console.warn(text)
        if not self._judging.bench.simulated:
            for path in left_behind(self._folder):
                console.warn(
                    f"units are not back where they were: with them connected, "
                    f"canopen-conformance commission --undo {path}"
                )

    def _groups(self, units: list[Unit]) -> Iterator[Group]:
        """Return the units that are on the bus together, each with its node-ID."""
        for first in range(0, len(units), len(self._node_ids)):
            some = units[first : first + len(self._node_ids)]
            yield list(zip(some, self._node_ids, strict=False))

    def _connect(self, group: Group) -> bool:
        """Have a person connect some units; tell whether that was done. The simulator needs nobody."""
        if self._together is not None:
            self._together.connect(self._tasks(group), fresh=self._fresh is not None)
        if self._judging.bench.simulated:
            return True
        console.say(f"{self._asked_for(group)}; press Enter (q: stop here)")
        try:
            return input().strip().lower() != "q"
        except EOFError as error:
            raise BenchError("nobody is there to connect the units") from error

    def _asked_for(self, group: Group) -> str:
        """Say what a person is to do for some units."""
        if self._fresh is None:
            names = [
                f"unit {unit.unit}" if node_id is None else f"unit {unit.unit} as node {node_id}"
                for unit, node_id in group
            ]
            return f"connect {', '.join(names)}, and no other"
        names = [f"unit {unit.unit}" for unit, _ in group]
        if self._fresh.needs_operator and group[0][1] is not None:
            return f"disconnect all units, and have at hand, to be connected one after the other: {', '.join(names)}"
        return f"connect {', '.join(names)} fresh from the box, and no other"

    @contextmanager
    def _in_place(self, group: Group) -> Iterator[Group]:
        """Have units fresh from the box at node-IDs of their own."""
        if self._fresh is None:
            yield group
            return
        with self._fresh.commissioned(group) as placed:
            yield placed

    def _judge_alone(self, units: Sequence[Unit]) -> bool:
        """Judge units that could not be given a node-ID; tell whether they were connected."""
        for unit in units:
            group = [(unit, None)]
            if not self._connect(group):
                return False
            self._judge_group(group)
        return True

    def _judge_group(self, group: Group) -> None:
        """Judge units that are on the bus, and those once more that could not be decided."""
        tasks = self._tasks(group)
        if self._together is not None:
            self._judge(tasks)
        for (unit, _), task in zip(group, tasks, strict=True):
            if self._together is None:
                self._judge([task])
            for _ in range(self._lot.content.retests):
                if unit.verdict != "undecided" or unit.tries[-1].other:
                    break
                self._judge([replace(task, name=self._name(unit))])
            self._look_at_bench(unit)

    def _judge(self, tasks: Sequence[Task]) -> None:
        """Judge units that are on the bus, at once where that is possible."""
        self._inspection.running = [Running(unit=it.unit, folder=it.name) for it in tasks]
        self._inspection.keep(self._folder)
        units = {it.unit: it for it in self._inspection.units}
        together = self._together
        tries = (
            ((it, self._judging.judge(it)) for it in tasks)
            if together is None
            else together.judge(tasks)
        )
        for task, tried in tries:
            self._done(units[task.unit], tried)

    def _tasks(self, group: Group) -> list[Task]:
        ids = [node_id for _, node_id in group if node_id is not None]
        return [
            Task(
                unit.unit,
                node_id,
                self._folder,
                self._name(unit),
                tuple(it for it in ids if it != node_id),
            )
            for unit, node_id in group
        ]

    def _name(self, unit: Unit) -> str:
        """Return a name for the folder of a unit's next run."""
        name = f"units/{unit.unit}-{len(unit.tries) + 1}"
        while (self._folder / name).exists():  # of a run that was killed
            name += "-again"
        return name

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
