"""Gives sensors their places or takes them back: all are told first, then restarted, then looked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from conformance.bench.node.interrupts import uninterrupted
from conformance.bench.node.node import Node
from conformance.bench.node.reach import Place
from conformance.bench.session import SERIAL_NUMBER, Bench
from conformance.commissioning.record import State, Unit
from conformance.errors import ConformanceError, NodeTimeout, SetupRefused
from conformance.spec.model import DeviceSpec


class NotSelected(SetupRefused):
    """No sensor took a selection for itself; nothing was changed."""


class Way(Protocol):
    """How a sensor is told its place."""

    def configure(self, unit: Unit, start: Place, to: Place) -> Place:
        """Tell one sensor its place; return where it is until it is restarted.

        Raises:
            NotSelected: It is not there.
            SetupRefused: It does not take its place, or not all of it.
            NodeTimeout: It does not answer.
        """


@dataclass(frozen=True, slots=True)
class Trip:
    """A sensor on its way.

    Args:
        unit: The sensor.
        start: Where it is.
        to: Where it is to be.
        shared: Others go to the same place.
    """

    unit: Unit
    start: Place
    to: Place
    shared: bool = False


class Giving:
    """Brings sensors to their places.

    Args:
        bench: The open bench.
        way: How a sensor is told its place.
        keep: Puts the record on the disk; called before each step that changes something.
    """

    def __init__(self, bench: Bench, way: Way, keep: Callable[[], None]) -> None:
        self._bench = bench
        self._way = way
        self._keep = keep

    def give(self, units: Sequence[Unit]) -> list[str]:
        """Give sensors their places; return what went wrong, a sentence each."""
        trips = [Trip(unit, unit.found.place, unit.given.place) for unit in units]
        return self._go(trips, "given")

    def take_back(self, units: Sequence[Unit]) -> list[str]:
        """Bring sensors to where they were found; return what went wrong, a sentence each."""
        homes = [unit.found for unit in units]
        trips = [
            Trip(unit, self._present(unit), unit.found.place, shared=homes.count(unit.found) > 1)
            for unit in units
        ]
        return self._go(trips, "undone")

    def _present(self, unit: Unit) -> Place:
        """Return where a sensor is: at its new place, or still where it was found."""
        given, found = unit.given.place, unit.found.place
        return given if self._answers(given) else found

    def _go(self, trips: Sequence[Trip], state: State) -> list[str]:
        wrong, told = [], []
        for trip in trips:
            before = trip.unit.state
            try:
                told.append((self._tell(trip), trip))
            except NotSelected as error:
                trip.unit.state = before
                wrong.append(str(error))
            except (SetupRefused, NodeTimeout) as error:
                wrong.append(str(error))
        if not told:
            self._keep()
            return wrong
        missing = self._restart({here for here, _ in told}, [trip for _, trip in told])
        for _, trip in told:
            if trip not in missing:
                trip.unit.state = state
        self._keep()
        wrong += [
            f"{trip.unit} was told to be {trip.to} and is not found there: switch the supply off and "
            "on, for the change may wait for that, and look at the label for its serial number"
            for trip in missing
        ]
        return wrong

    @uninterrupted()
    def _tell(self, trip: Trip) -> Place:
        trip.unit.state = "touched"
        self._keep()
        return self._way.configure(trip.unit, trip.start, trip.to)

    @uninterrupted()
    def _restart(self, places: set[Place], trips: Sequence[Trip]) -> list[Trip]:
        """Restart the sensors at some places, and return those that do not come where they should."""
        for place in places:
            self._bench.reach.go(place)
            self._bench.node().begin_reset()
        missing = self._missing(trips)
        node = self._bench.node()
        if missing and node.switchable:
            node.begin_power_cycle()
            missing = self._missing(missing)
        return missing

    def _missing(self, trips: Sequence[Trip]) -> list[Trip]:
        """Wait for sensors where they should be; return those that do not come."""
        link, missing = self._bench.link, list(trips)
        deadline_s = link.now() + self._bench.definition.boot_up_timeout_s
        while True:
            missing = [trip for trip in missing if not self._is_there(trip)]
            if not missing or link.now() >= deadline_s:
                return missing

    def _is_there(self, trip: Trip) -> bool:
        """Tell whether a sensor is where it should be; of several there, whether it left its start."""
        if trip.shared:
            return self._answers(trip.to) and not self._answers(trip.start)
        if not self._answers(trip.to):
            return False
        try:
            return serial_of(self._bench.node()) in (None, trip.unit.serial)
        except ConformanceError:
            return False

    def _answers(self, place: Place) -> bool:
        self._bench.reach.go(place)
        return self._bench.node().answers()


def identity_of(node: Node) -> list[int]:
    """Return the four numbers of a node's identity, fewer where it documents fewer.

    Raises:
        SetupRefused: It aborts an upload.
        NodeTimeout: It does not answer.
    """
    index, _ = SERIAL_NUMBER
    keys = [(index, sub) for sub in range(1, 5)]
    return [node.number(*key) for key in keys if _reads(node.spec, key)]


def serial_of(node: Node) -> int | None:
    """Return a node's serial number, None where it documents none."""
    return node.number(*SERIAL_NUMBER) if _reads(node.spec, SERIAL_NUMBER) else None


def _reads(spec: DeviceSpec, key: tuple[int, int]) -> bool:
    entry = spec.entry(*key)
    return entry is not None and entry.readable
