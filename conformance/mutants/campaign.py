"""All defects of a device before the suite: what is tried, in which order, and the matrix of it."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from conformance import resources, runner
from conformance.errors import BenchError, SpecError
from conformance.mutants.collection import all_defects, real_defects
from conformance.mutants.defect import Defect
from conformance.mutants.equivalents import Equivalents, load_equivalents
from conformance.mutants.matrix import Matrix, Row, row
from conformance.mutants.touched import touched
from conformance.mutants.trial import Round
from conformance.mutants.workers import Task, outcomes
from conformance.options import RunOptions
from conformance.report.results import Results
from conformance.run import Run
from conformance.spec.load import load_spec
from conformance.spec.model import Key

BASELINE = "as-documented"
"""Folder of the record of the device without a defect."""

Progress: TypeAlias = Callable[[int, int, Row], None]
"""Told the number of defects done, that of all, and the latest row."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """What to try.

    Args:
        device: Built-in name or path of a spec.
        folder: Where the records go.
        variant: The spec's first when None.
        only: Part of the ids of the defects to try; all when empty.
        sample: How many of them to try, chosen by the seed; all when None.
        whole: Every item is run against every defect, not only until one has seen it.
        processes: How many at once; as many as there are cores when None.
        seed: Of the sample and of everything random in the device.
    """

    device: str
    folder: Path
    variant: str | None = None
    only: str = ""
    sample: int | None = None
    whole: bool = False
    processes: int | None = None
    seed: int = 0

    def run(self, progress: Progress) -> tuple[Matrix, list[str]]:
        """Try the defects.

        Returns:
            The matrix, and ids in the list of equivalents that no defect has.

        Raises:
            SpecError: The spec or the list beside it is wrong, or no defect is meant.
            BenchError: The device without a defect does not conform, or the trials ended early.
        """
        path = resources.find("device_specs", self.device, "DEVICE")
        file = load_spec(path)
        spec = file.resolve(self.variant)
        equivalents = load_equivalents(path, spec.variant)
        every = all_defects(file, spec)
        chosen = self._chosen(list(real_defects(file, spec, self._meant(every))))
        options = RunOptions(device=self.device, variant=spec.variant, seed=self.seed, strict=True)
        baseline = self._baseline(options)
        tasks = self._tasks(chosen, baseline, equivalents)
        rows: dict[str, Row] = {}
        for outcome in outcomes(options, tasks, self.processes, whole=self.whole):
            made = row(outcome, equivalents.why(outcome.defect))
            rows[outcome.defect.id] = made
            progress(len(rows), len(tasks), made)
        counts = Counter(it.requirement for it in baseline.results.items if it.verdict == "pass")
        matrix = Matrix(tuple(rows[it.id] for it in chosen), counts)
        return matrix, equivalents.useless(every)

    def _meant(self, defects: list[Defect]) -> list[Defect]:
        meant = [it for it in defects if self.only in it.id]
        if not meant:
            raise SpecError(f"--only: expected a part of a defect's id, got {self.only!r}")
        return meant

    def _chosen(self, defects: list[Defect]) -> list[Defect]:
        if self.sample is None or self.sample >= len(defects):
            return defects
        picked = random.Random(self.seed).sample(range(len(defects)), self.sample)  # noqa: S311
        return [defects[place] for place in sorted(picked)]

    def _baseline(self, options: RunOptions) -> _Baseline:
        folder = self.folder / BASELINE
        run = Run(replace(options, report_dir=folder))
        runner.play(run)
        if run.results.exit_code:
            raise BenchError(f"the device as documented does not conform, see {folder}")
        return _Baseline(run.results, touched(run.results, folder / "trace.log"))

    def _tasks(
        self, defects: list[Defect], baseline: _Baseline, equivalents: Equivalents
    ) -> list[Task]:
        every = frozenset(it.id for it in baseline.results.items if it.verdict == "pass")
        tasks: list[Task] = []
        for defect in defects:
            named = baseline.named(defect) & every
            likely = named | baseline.touching(defect) & every
            if self.whole:
                rounds: list[Round] = [every]
            elif equivalents.why(defect):
                rounds = [likely]
            else:
                rounds = [named, likely - named, every - likely]
            tasks.append((defect, rounds))
        return tasks


@dataclass(frozen=True, slots=True)
class _Baseline:
    """The device without a defect: its record, and which items asked for which entry."""

    results: Results
    touched: Mapping[Key, frozenset[str]]

    def named(self, defect: Defect) -> Round:
        """Return the items that name a defect's object, or its requirements where it has none."""
        if defect.key is None:
            return frozenset(
                it.id for it in self.results.items if it.requirement.startswith(defect.seen_by)
            )
        place = f"{defect.key[0]:04X}h"
        return frozenset(it.id for it in self.results.items if it.object.startswith(place))

    def touching(self, defect: Defect) -> Round:
        """Return the items that ask for the entry that differs."""
        return frozenset() if defect.key is None else self.touched.get(defect.key, frozenset())
