"""Trials: the suite's items against one defect after the other, in one session of pytest."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TypeAlias

import pytest

from conformance.bench.session import Bench
from conformance.checks import BENCH, PASSED, VERDICT
from conformance.effects import Effect
from conformance.errors import BenchError
from conformance.mutants.defect import Defect
from conformance.options import RunOptions
from conformance.report.results import Item
from conformance.run import Run

ENOUGH = 8
"""So many items that did not pass on a defect, one of them failed, are enough."""

Round: TypeAlias = frozenset[str]
"""Ids of items that are run together."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the suite said of one defect.

    Args:
        defect: The defect.
        failed: The items that failed, in their order.
        open: Other items that did not pass, with their reasons.
        aborted: Why the run ended early; empty if it did not.
        items: How many were run.
        seconds: Wall time.
    """

    defect: Defect
    failed: tuple[str, ...]
    open: Mapping[str, str] = field(default_factory=dict)
    aborted: str = ""
    items: int = 0
    seconds: float = 0.0


class TrialRun(Run):
    """A run without a record on disk, of which the simulated device changes.

    Args:
        options: As of a run on the simulator.
    """

    def __init__(self, options: RunOptions) -> None:
        super().__init__(options, self._note)
        self.made: list[Item] = []

    def _note(self, item: Item) -> None:
        self.made.append(item)

    def open(self, total: int, effects: Collection[Effect]) -> Bench:  # noqa: ARG002 - as of a run
        """Open the bench with the device as documented."""
        return self.begin(())

    def begin(self, faults: tuple[str, ...]) -> Bench:
        """Open the bench anew, with a device that has some faults.

        Raises:
            BenchError: There is no node.
        """
        self.end()
        self.made.clear()
        self.results.items.clear()
        self.results.aborted = ""
        simulation = {**self.simulation, "faults": list(faults)}
        self._bench = Bench.open(self.definition, self.spec, simulation, None)
        self._bench.find_node()
        return self._bench

    @property
    def has_seen_enough(self) -> bool:
        """An item has failed, and not much more is to be learned from further ones."""
        failed = any(item.verdict == "fail" for item in self.made)
        return failed and sum(item.verdict != "pass" for item in self.made) >= ENOUGH

    def end(self) -> None:
        """Close the bench."""
        bench, self._bench = self._bench, None
        if bench is not None:
            bench.close()


class Trials:
    """The loop of a session that runs chosen items against each defect.

    Args:
        run: The run whose device changes.
        tasks: Each defect, and rounds of items: the next is run when the one before saw nothing.
        tell: Called with each outcome.
        whole: A round goes on when enough was seen.
    """

    def __init__(
        self,
        run: TrialRun,
        tasks: Iterable[tuple[Defect, list[Round]]],
        tell: Callable[[Outcome], None],
        *,
        whole: bool,
    ) -> None:
        self._run = run
        self._enough = not whole
        self._tasks = tasks
        self._tell = tell

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """Forget what the item said of the defect before."""
        if VERDICT in item.stash:
            del item.stash[VERDICT]
        if PASSED in item.stash:
            del item.stash[PASSED]

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run all tasks."""
        items = {item.name.partition("[")[2].removesuffix("]"): item for item in session.items}
        for defect, rounds in self._tasks:
            self._tell(self._try(session, defect, rounds, items))
        self._run.end()
        return True

    def _try(
        self,
        session: pytest.Session,
        defect: Defect,
        rounds: list[Round],
        items: Mapping[str, pytest.Item],
    ) -> Outcome:
        start = time.monotonic()
        outcome = Outcome(defect, ())
        left: dict[str, str] = {}
        aborted = ""
        for names in rounds:
            chosen = [item for name, item in items.items() if name in names]
            if not chosen:
                continue
            outcome = self._round(session, defect, chosen)
            left |= outcome.open
            aborted = aborted or outcome.aborted
            if outcome.failed:
                break
        return replace(outcome, open=left, aborted=aborted, seconds=time.monotonic() - start)

    def _round(self, session: pytest.Session, defect: Defect, items: list[pytest.Item]) -> Outcome:
        run, config = self._run, session.config
        session._shouldstop = False  # noqa: SLF001 - pytest has no other way to take it back
        try:
            config.stash[BENCH] = run.begin(defect.faults)
        except BenchError as error:
            return Outcome(defect, (), aborted=str(error))
        except Exception as error:  # noqa: BLE001 - one defect that the simulated device cannot have
            return Outcome(defect, (), aborted=f"{type(error).__name__}: {error}")
        for item, following in pairwise([*items, None]):
            config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if session.shouldstop or (self._enough and run.has_seen_enough):
                session._setupstate.teardown_exact(None)  # noqa: SLF001 - no other way to end a run early
                break
        failed = tuple(it.id for it in run.made if it.verdict == "fail")
        left = {it.id: it.reason for it in run.made if it.verdict == "inconclusive"}
        return Outcome(defect, failed, left, run.results.aborted, len(run.made))
