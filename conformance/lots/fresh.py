"""Units fresh from the box, which share one node-ID: each has its own for as long as it is judged."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final, TypeAlias

from conformance.bench.definition import BenchDefinition
from conformance.commissioning.doing import Commissioning
from conformance.commissioning.record import Record, load_record
from conformance.commissioning.record import Unit as Found
from conformance.errors import BenchError
from conformance.lots.inspection import Unit
from conformance.lots.judging import Judging
from conformance.report.console import console

FOLDER: Final = "commissioned"

Group: TypeAlias = Sequence[tuple[Unit, int | None]]
"""Units that are on the bus together, each with its node-ID."""


class Fresh:
    """Gives units their node-IDs, and takes those back.

    Args:
        judging: How units are judged.
        folder: Of the inspection.
        bench: That they are connected to.
        options: Arguments of the interface beyond those that the bench says.
    """

    def __init__(
        self,
        judging: Judging,
        folder: Path,
        bench: BenchDefinition,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        self._judging = judging
        self._folder = folder / FOLDER
        self._bench = bench
        self._options = options or {}

    @property
    def needs_operator(self) -> bool:
        """Nothing tells units apart on the bus, so that one after the other is to be connected."""
        return not self._doing(Path()).finds(self._judging.lot.content.serials or [])

    @contextmanager
    def commissioned(self, group: Group) -> Iterator[Group]:
        """Have each unit at a node-ID of its own, and in the end where it was.

        Yields:
            The units with the node-IDs at which they are. One alone that got none is left where it was;
            several that got none are missing.

        Raises:
            BenchError: Some are not back where they were.
        """
        doing = self._doing(self._free_path())
        record = Record(
            device=str(self._judging.device.resolve()),
            variant=self._judging.spec.variant,
            bench=str(self._judging.bench_file.resolve()),
        )
        try:
            for wrong in self._give(doing, record, group):
                console.warn(wrong)
            yield self._placed(group, record)
        finally:
            self._take_back(doing, record)

    def _doing(self, path: Path) -> Commissioning:
        return Commissioning(self._bench, self._judging.spec, path, self._options)

    def _give(self, doing: Commissioning, record: Record, group: Group) -> list[str]:
        serials = [unit.unit for unit, _ in group] if self._judging.lot.content.serials else []
        ids = [node_id for _, node_id in group if node_id is not None]
        rate = self._bench.bitrate or self._judging.spec.bitrate
        try:
            return doing.give(record, serials, ids, rate, one_by_one=False)
        except BenchError as error:  # each is judged alone, where that comes to light as well
            return [str(error)]

    def _placed(self, group: Group, record: Record) -> Group:
        """Return who is where."""
        placed: list[tuple[Unit, int | None]] = []
        left: list[tuple[Unit, Found | None]] = []
        for unit, found in self._whose([unit for unit, _ in group], record.units):
            if found is None or found.state != "given":
                left.append((unit, found))
                continue
            placed.append((unit, found.given.node_id))
            console.say(f"unit {unit.unit} is node {found.given.node_id} meanwhile ({found})")
        if len(left) == 1:
            ((unit, found),) = left
            if not self.needs_operator if found is None else found.state == "planned":
                placed.append((unit, self._judging.spec.node_id))
        return placed

    def _whose(
        self, units: Sequence[Unit], found: Sequence[Found]
    ) -> Iterable[tuple[Unit, Found | None]]:
        """Tell units by serial number where the lot file has those, else by their order."""
        if not self._judging.lot.content.serials:
            return zip_longest(units, found)
        serials = {it.serial: it for it in found}
        return [(unit, serials.get(unit.unit)) for unit in units]

    def _take_back(self, doing: Commissioning, record: Record) -> None:
        if not record.in_force:
            return
        wrong = doing.take_back(record, one_by_one=False)
        if wrong:
            raise BenchError(
                f"{'; '.join(wrong)}; with them connected: "
                f"canopen-conformance commission --undo {doing.path}"
            )

    def _free_path(self) -> Path:
        """Return a path for a record that is not there yet."""
        try:
            self._folder.mkdir(exist_ok=True)
        except OSError as error:
            raise BenchError(f"cannot make {self._folder}: {error.strerror}") from error
        return self._folder / f"{len(list(self._folder.glob('*.json'))) + 1}.json"


def left_behind(folder: Path) -> list[Path]:
    """Return the records of an inspection's units that are not back where they were."""
    return [path for path in sorted((folder / FOLDER).glob("*.json")) if load_record(path).in_force]
