"""One unit of a lot is judged, by a run with a record of its own."""

from __future__ import annotations

import gc
from collections.abc import Container
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from conformance import resources, runner
from conformance.bench.definition import BenchDefinition, load_bench
from conformance.errors import SpecError
from conformance.lots.inspection import Numbers, Try, Word
from conformance.lots.lot_file import Lot
from conformance.options import RunOptions
from conformance.report.report_page import NAME as PAGE
from conformance.report.results import Item
from conformance.run import Run
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec

WORDS: Final[tuple[Word, Word, Word]] = ("conforming", "nonconforming", "undecided")
"""What a unit is, by the exit code of its run."""

INTERRUPTED: Final = "interrupted by the user"


class UnitRun(Run):
    """A run of one unit.

    Args:
        options: As of a run.
        serial: Number that the simulated device tells; None on another bench.
    """

    def __init__(self, options: RunOptions, serial: int | None) -> None:
        super().__init__(options)
        if serial is not None:
            self._simulation = {**self._simulation, "serial_number": serial}


@dataclass(frozen=True, slots=True)
class Judging:
    """How the units of a lot are judged.

    Args:
        lot: The lot.
        bench: Its bench.
        spec: What the units are held against.
    """

    lot: Lot
    bench: BenchDefinition
    spec: DeviceSpec

    @classmethod
    def of(cls, lot: Lot) -> Judging:
        """Return how the units of a lot are judged; its names and paths are looked up.

        Raises:
            SpecError: There is no such bench, device or variant, or what is simulated does not fit.
        """
        content = lot.content
        bench = load_bench(resources.find("fixtures/benches", lot.beside(content.bench), "bench"))
        path = resources.find("device_specs", lot.beside(content.device), "device")
        spec = load_spec(path).resolve(content.variant, bench.node_id)
        simulation = content.simulation
        if (simulation.faults or simulation.serials) and not bench.simulated:
            raise SpecError(
                f"{lot.path}: simulation: expected the simulator as bench, got {content.bench!r}"
            )
        judging = cls(lot, bench, spec)
        for unit in (content.names[0], *simulation.faults):
            judging.run(unit, bench.node_id, Path())  # what is wrong is told before anything begins
        return judging

    def run(self, unit: int, node_id: int | None, folder: Path) -> UnitRun:
        """Return the run of a unit, not yet begun.

        Args:
            unit: By serial number or place.
            node_id: At which it is; None for that of the bench.
            folder: For its record.
        """
        content = self.lot.content
        faults = content.simulation.faults.get(unit, [])
        options = RunOptions(
            device=self.lot.beside(content.device),
            variant=content.variant,
            bench=self.lot.beside(content.bench),
            node_id=node_id,
            serial=str(unit) if content.serials else "",
            faults=tuple(self.lot.beside(it) if "=" not in it else it for it in faults),
            select=content.select,
            strict=content.strict,
            report_dir=folder,
        )
        told = content.simulation.serials.get(unit, unit) if self.bench.simulated else None
        return UnitRun(options, told)

    def judge(
        self, unit: int, node_id: int | None, folder: Path, name: str, told: Container[str] = ()
    ) -> Try:
        """Judge a unit and return what its run came to.

        Args:
            unit: By serial number or place.
            node_id: At which it is; None for that of the bench.
            folder: Of the inspection.
            name: Of the record's folder, below that one; not there yet.
            told: Serial numbers of units judged before.

        Raises:
            SpecError: No item is selected.
            KeyboardInterrupt: The user ended the run.
        """
        record = folder / name
        run = self.run(unit, node_id, record)
        errors = runner.play(run)
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
        made = self._came_to(unit, run, name, told)
        del run
        gc.collect()  # a run's items hang on each other, and garbage is seldom looked for
        return made

    def _came_to(self, unit: int, run: Run, name: str, told: Container[str]) -> Try:
        """Return what a run came to."""
        results = run.results
        serial = str(results.device.get("serial_told", ""))
        word = WORDS[results.exit_code]
        reason = _reason(run) if word == "undecided" else ""
        other = ""
        if self.lot.content.serials and serial not in ("", str(unit)):
            other = f"the sensor on the bus is {serial}, not {unit}"
        elif serial not in ("", "0") and serial in told:
            other = f"the sensor on the bus is {serial}, as that of another unit was"
        if other:
            word, reason = "undecided", other
        bus_s, wall_s = (
            results.run.get("bus_s", results.run.get("simulated_s")),
            results.run["wall_s"],
        )
        return Try(
            folder=name,
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
