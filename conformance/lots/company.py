"""A unit that is judged beside others on its bus: first what touches it alone, then, alone, all the rest."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import pytest

from conformance.bench.bus.other_units import OtherUnits
from conformance.bench.definition import BenchDefinition
from conformance.bench.opening import open_bus
from conformance.bench.session import Bench
from conformance.bench.settings.second_values import is_cob_id
from conformance.checks import BENCH
from conformance.effects import Effect, Need
from conformance.errors import ConformanceError
from conformance.options import RunOptions, refusal
from conformance.report.results import Item
from conformance.run import Run
from conformance.session import what

OWN: Final[tuple[Effect, ...]] = ("reads", "writes", "resets", "restores", "non-volatile")
"""Effects that checks have on the unit alone."""

SURROUNDINGS: Final[frozenset[Need]] = frozenset({"tilt", "sudden-tilt", "temperature", "supply"})
"""What all units of a bench are exposed to at once."""

BESIDE_OTHERS: Final = "other units are on the bus"


@dataclass(frozen=True, slots=True)
class Task:
    """A unit to judge.

    Args:
        unit: By serial number or place.
        node_id: At which it is; None for that of the bench.
        folder: Of the inspection.
        name: Of the record's folder, below that one; not there yet.
        others: Node-IDs of other units on the bus.
    """

    unit: int
    node_id: int | None
    folder: Path = Path()
    name: str = ""
    others: tuple[int, ...] = ()


def beside_others(definition: BenchDefinition) -> BenchDefinition:
    """Return a bench as it is for one of several units on it: nothing may be done to the others."""
    stimulus = {name: who for name, who in definition.stimulus.items() if who != "operator"}
    return definition.model_copy(
        update={
            "allow": [effect for effect in definition.allow if effect in OWN],
            "power": "none",
            "stimulus": stimulus,
            "operator": "none",
            "second_node": "none",
            "bus_errors": "none",
        }
    )


class UnitRun(Run):
    """A run of one unit.

    Args:
        options: As of a run.
        serial: Number that the simulated device tells; None on another bench.
        bus: Arguments of the simulated bus, where it is another process'; None elsewhere.
        others: Node-IDs of other units on the bus.
        judged: They are judged at the same time.
    """

    def __init__(
        self,
        options: RunOptions,
        serial: int | None,
        bus: Mapping[str, Any] | None = None,
        others: Sequence[int] = (),
        *,
        judged: bool = False,
    ) -> None:
        super().__init__(options)
        if serial is not None:
            self.simulation = {**self.simulation, "serial_number": serial}
        if bus is not None:
            self.simulation = dict(bus)
            self.definition = self.definition.model_copy(update={"options": {}})
        self._bench_itself = self.definition
        self._others, self._judged = others, judged
        if others:
            self.definition = beside_others(self.definition)
            self.results.run["other_units"] = list(others)

    def _respect_others(self, bench: Bench) -> None:
        if self._others:
            entries = self.spec.entries.values()
            keys = [entry.key for entry in entries if is_cob_id(entry, self.spec)]
            bench.link.others = OtherUnits(self._others, keys, judged=self._judged)

    def refuses(self, effects: tuple[Effect, ...], needs: tuple[Need, ...]) -> str:
        """Return why an item cannot be run, empty if it can."""
        reason = super().refuses(effects, needs)
        alone = self._bench_itself is self.definition
        if alone or not reason or refusal(self._bench_itself, effects, needs):
            return reason
        return BESIDE_OTHERS if refusal(self.definition, effects, needs) else reason

    @property
    def over(self) -> bool:
        """The run has ended early."""
        return self._bench is None or bool(self.results.aborted)

    @contextmanager
    def away(self) -> Iterator[None]:
        """Leave the bus to the other units for a while.

        Raises:
            BenchError: The bus cannot be opened again.
        """
        bench = self._bench
        assert bench is not None  # the run is not over
        bench.look()
        bitrate = bench.link.bus_time.bitrate
        with bench.link.left(lambda: open_bus(self.definition, bitrate, self.simulation)):
            yield


class Company:
    """Runs the items of a unit beside others', and those again alone that did not pass.

    What passed beside others counts, for it was no easier there. Of all else counts what it comes to alone;
    what came of it beside others is told with it.

    Args:
        run: Of the unit.
        turn: Waits until no other unit of the bus is being judged.
    """

    def __init__(self, run: UnitRun, turn: Callable[[], None]) -> None:
        self._run = run
        self._turn = turn
        self._first: dict[str, Item] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run all items."""
        run = self._run
        if not session.items:
            return True
        others = session.config.stash[BENCH].link.others
        assert others is not None  # nobody takes turns alone
        alone = [item for item in session.items if _needs(item) & SURROUNDINGS]
        try:
            alone += self._beside_others(session, [it for it in session.items if it not in alone])
            others.judged = False
            if not run.over and alone:
                with run.away():
                    self._turn()
                self._by_itself(session, alone)
        except ConformanceError as error:
            run.abort(str(error))
        finally:
            run.results.items += [_not_alone(it) for it in self._first.values()]
            run.results.put_in_order([_id(item) for item in session.items])
        return True

    def _beside_others(
        self, session: pytest.Session, items: Sequence[pytest.Item]
    ) -> list[pytest.Item]:
        """Run items and return those that have not passed, taken off the record."""
        run, left = self._run, []
        for item in _run(session, items):
            if not run.over and run.results.items[-1].verdict in ("fail", "inconclusive"):
                self._first[_id(item)] = run.take_back()
                left.append(item)
        return left

    def _by_itself(self, session: pytest.Session, items: Sequence[pytest.Item]) -> None:
        """Run items while no other unit is judged."""
        results = self._run.results
        for item in _run(session, items):
            first = self._first.pop(_id(item), None)
            if first is not None and first.verdict == "fail":
                tried = f"beside other units it failed: {first.seen} ({first.trace})"
                last = results.items[-1]
                results.replace_last(
                    replace(last, tried="; ".join(filter(None, (tried, last.tried))))
                )


def _run(session: pytest.Session, items: Sequence[pytest.Item]) -> Iterator[pytest.Item]:
    """Run items and return each when it is over, until something ends the session."""
    for item, following in pairwise([*items, None]):
        assert item is not None  # the last one follows alone
        item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        yield item
        if session.shouldstop:
            return


def _id(item: pytest.Item) -> str:
    """Return the id of an item, as records have it."""
    return item.name.partition("[")[2].removesuffix("]")


def _not_alone(item: Item) -> Item:
    """Return what is left of an item that was not judged alone any more."""
    return item.undecided(f"{BESIDE_OTHERS}, and the run ended before it was judged alone")


def _needs(item: pytest.Item) -> set[Need]:
    requirement, case = what(item)
    return set() if requirement is None or case is None else {*requirement.needs, *case.needs}
