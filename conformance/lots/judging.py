"""One unit of a lot is judged, by a run with a record of its own."""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from conformance import resources, runner
from conformance.bench.definition import BenchDefinition, load_bench
from conformance.commissioning.doing import Commissioning
from conformance.errors import SpecError
from conformance.lots.company import Company, Task, UnitRun
from conformance.lots.inspection import Numbers, Try, Word
from conformance.lots.lot_file import Lot
from conformance.numbers import node_ids
from conformance.options import RunOptions
from conformance.report.report_page import NAME as PAGE
from conformance.report.results import Item
from conformance.run import Run
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec

WORDS: Final[tuple[Word, Word, Word]] = ("conforming", "nonconforming", "undecided")
"""What a unit is, by the exit code of its run."""

INTERRUPTED: Final = "interrupted by the user"


@dataclass(frozen=True, slots=True)
class Judging:
    """How the units of a lot are judged.

    Args:
        lot: The lot.
        bench: Its bench.
        spec: What the units are held against.
        bench_file: Of the bench.
        device: Of the spec.
    """

    lot: Lot
    bench: BenchDefinition
    spec: DeviceSpec
    bench_file: Path
    device: Path

    @classmethod
    def of(cls, lot: Lot) -> Judging:
        """Return how the units of a lot are judged; its names and paths are looked up.

        Raises:
            SpecError: There is no such bench, device or variant, or what is simulated does not fit.
        """
        content = lot.content
        bench_file = resources.find("fixtures/benches", lot.beside(content.bench), "bench")
        bench = load_bench(bench_file)
        path = resources.find("device_specs", lot.beside(content.device), "device")
        spec = load_spec(path).resolve(content.variant, bench.node_id)
        simulation = content.simulation
        if (simulation.faults or simulation.serials) and not bench.simulated:
            raise SpecError(
                f"{lot.path}: simulation: expected the simulator as bench, got {content.bench!r}"
            )
        judging = cls(lot, bench, spec, bench_file, path)
        if content.commission:
            judging._require_way()
        for unit in (content.names[0], *simulation.faults):
            judging.run(Task(unit, bench.node_id))  # what is wrong is told before anything begins
        return judging

    def _require_way(self) -> None:
        """Make sure that units fresh from the box can be given their node-IDs."""
        lot, bench, spec = self.lot, self.bench, self.spec
        Commissioning(bench, spec, Path()).require_way(bench.bitrate or spec.bitrate)
        if spec.node_id in node_ids("node_ids", lot.content.node_ids or ""):
            raise SpecError(
                f"{lot.path}: node_ids: expected none that units have fresh from the box, "
                f"got {spec.node_id}"
            )
        if bench.simulated and not bench.shared:
            raise SpecError(
                f"{lot.path}: commission: expected the simulator on its virtual clock, "
                f"got {lot.content.bench!r}"
            )

    def run(
        self, task: Task, bus: Mapping[str, Any] | None = None, *, judged: bool = False
    ) -> UnitRun:
        """Return the run of a unit, not yet begun.

        Args:
            task: The unit.
            bus: Arguments of the simulated bus, where it is another process'; None elsewhere.
            judged: The other units on the bus are judged at the same time.
        """
        content, unit = self.lot.content, task.unit
        faults = content.simulation.faults.get(unit, [])
        options = RunOptions(
            device=self.lot.beside(content.device),
            variant=content.variant,
            bench=self.lot.beside(content.bench),
            node_id=task.node_id,
            serial=str(unit) if content.serials else "",
            faults=tuple(self.lot.beside(it) if "=" not in it else it for it in faults),
            select=content.select,
            strict=content.strict,
            report_dir=task.folder / task.name,
        )
        told = content.simulation.serials.get(unit, unit) if self.bench.simulated else None
        return UnitRun(options, told, bus, task.others, judged=judged)

    def judge(
        self,
        task: Task,
        bus: Mapping[str, Any] | None = None,
        turn: Callable[[], None] | None = None,
    ) -> Try:
        """Judge a unit and return what its run came to.

        Args:
            task: The unit.
            bus: As of `run`.
            turn: Waits until no other unit of the bus is being judged; None where none is.

        Raises:
            SpecError: No item is selected.
            KeyboardInterrupt: The user ended the run.
        """
        run = self.run(task, bus, judged=turn is not None)
        errors = runner.play(run, *([Company(run, turn)] if turn else []))
        if run.results.aborted == INTERRUPTED:
            raise KeyboardInterrupt
        if run.opened:
            runner.write_reports(run)
        elif not run.results.aborted:
            if self.lot.content.select and not errors:
                raise SpecError(
                    f"{self.lot.path}: select: expected a part of an item's id, "
                    f"got {self.lot.content.select!r}"
                )
            raise RuntimeError("\n".join(errors) or "the checks did not start")
        made = self._came_to(task, run)
        del run
        gc.collect()  # a run's items hang on each other, and garbage is seldom looked for
        return made

    def _came_to(self, task: Task, run: Run) -> Try:
        """Return what a run came to."""
        results = run.results
        serial = str(results.device.get("serial_told", ""))
        word = WORDS[results.exit_code]
        reason = _reason(run) if word == "undecided" else ""
        other = ""
        if self.lot.content.serials and serial not in ("", str(task.unit)):
            other = f"the sensor on the bus is {serial}, not {task.unit}"
            word, reason = "undecided", other
        bus_s, wall_s = (
            results.run.get("bus_s", results.run.get("simulated_s")),
            results.run["wall_s"],
        )
        return Try(
            folder=task.name,
            verdict=word,
            reason=reason,
            deviations=[_short(item) for item in results.deviations()],
            serial=serial,
            other=bool(other),
            reached=bool(results.items),
            node_id=run.spec.node_id,
            report=run.directory is not None and (run.directory / PAGE).is_file(),
            bus_s=bus_s if isinstance(bus_s, float) else 0.0,
            wall_s=wall_s if isinstance(wall_s, float) else 0.0,
            numbers=[it for item in results.items for it in _numbers(item)],
        )


def _reason(run: Run) -> str:
    """Return why a run could not decide."""
    results = run.results
    if results.aborted or results.left_changed or results.illegal:
        return results.aborted or results.left_changed or results.illegal
    open_ = [item for item in results.items if item.verdict == "inconclusive"]
    if open_:
        more = f" (and {len(open_) - 1} more)" if len(open_) > 1 else ""
        return f"{_short(open_[0])}: {open_[0].reason}{more}"
    return "no item was decided"


def _numbers(item: Item) -> list[Numbers]:
    """Return what an item measured that has limits; several measurements of a name are told apart by number."""
    found: list[Numbers] = []
    for it in item.measurements:
        values: Any = it["values"]
        least, most = it["least"], it["most"]
        if not values or (least is None and most is None):
            continue
        name = str(it["quantity"])
        again = sum(known.quantity.partition(" #")[0] == name for known in found)
        found.append(
            Numbers(
                item=_short(item),
                quantity=f"{name} #{again + 1}" if again else name,
                unit=str(it["unit"]),
                mean=sum(values) / len(values),
                lowest=min(values),
                highest=max(values),
                least=None if least is None else float(least),  # type: ignore[arg-type]  # a record's values are of JSON
                most=None if most is None else float(most),  # type: ignore[arg-type]  # likewise
            )
        )
    return found


def _short(item: Item) -> str:
    """Return an item's id without the device's name."""
    return item.id.partition("/")[2]


def require_same(lot: Lot, sha256: str, folder: Path) -> None:
    """Make sure that an inspection that has begun goes by the lot file as it is.

    Raises:
        SpecError: The file was changed meanwhile.
    """
    if sha256 != lot.sha256:
        raise SpecError(
            f"{lot.path}: expected the lot file that the inspection in {folder} began with, got "
            f"another: give another --report-dir, or that file"
        )
