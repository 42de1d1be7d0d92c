"""Gives sensors their places or takes them back: all are told first, then restarted, then looked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from conformance.bench.given_back.seeking import BROADCAST, answering
from conformance.bench.node.node import Node
from conformance.bench.node.reach import Place
from conformance.bench.session import SERIAL_NUMBER, Bench
from conformance.commissioning.record import State, Unit
from conformance.errors import ConformanceError, NodeTimeout, SetupRefused
from conformance.interrupts import uninterrupted
from conformance.spec.model import DeviceSpec

NONE_RESTARTED: Final = (
    "no sensor was restarted, for all must change their bit rate at the same moment; one that does "
    "so at once is brought back alone, by --undo with --one-by-one"
)


class NotSelected(SetupRefused):
    """No sensor took a selection for itself; nothing was changed."""


class Way(Protocol):
    """How a sensor is told its place."""

    def configure(self, unit: Unit, start: Place, to: Place, *, rate: bool) -> Place:
        """Tell one sensor its node-ID, and its bit rate if asked; return where it is until a restart.

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

    def give_node_ids(self, units: Sequence[Unit]) -> list[str]:
        """Give sensors their node-IDs at the bit rate they have; return what went wrong, a sentence each."""
        trips = [Trip(unit, unit.found.place, unit.between) for unit in units]
        state: State = "touched" if any(unit.switches for unit in units) else "given"
        return self._go(trips, state, rate=False)

    def switch(self, units: Sequence[Unit]) -> list[str]:
        """Give sensors that have their node-IDs another bit rate; return what went wrong."""
        return self._switch([Trip(unit, unit.between, unit.given.place) for unit in units], "given")

    def take_back(self, units: Sequence[Unit]) -> list[str]:
        """Bring sensors to where they were found; return what went wrong, a sentence each.

        The bit rate comes first, while each has a node-ID of its own.
        """
        present = self._present(units)
        fast = [Trip(it, present[n], it.between) for n, it in enumerate(units) if it.switches]
        away = [trip for trip in fast if trip.start == trip.unit.given.place]
        if away and (wrong := self._switch(away, "touched")):
            return wrong
        homes = [unit.found for unit in units]
        trips = [
            Trip(
                unit,
                unit.found.place if present[n] == unit.found.place else unit.between,
                unit.found.place,
                shared=homes.count(unit.found) > 1,
            )
            for n, unit in enumerate(units)
        ]
        return self._go(trips, "undone", rate=True)  # they may have been told, and not restarted

    def _present(self, units: Sequence[Unit]) -> list[Place]:
        """Return where sensors are; where they were found if they answer nowhere.

        All are at one bit rate: where one is seen the other bit rate is left alone.
        """
        spots = [it for unit in units for it in (unit.found, unit.given)]
        if any(unit.state == "given" for unit in units):
            spots.reverse()
        for bitrate in dict.fromkeys(it.bitrate for it in spots):
            seen = [self._seen(unit, bitrate) for unit in units]
            if any(seen):
                return [it or unit.found.place for it, unit in zip(seen, units, strict=True)]
        return [unit.found.place for unit in units]

    def _seen(self, unit: Unit, bitrate: int) -> Place | None:
        """Return the place of a bit rate at which a sensor answers, None where it does at none."""
        places = dict.fromkeys((unit.given.place, unit.between, unit.found.place))
        there = (it for it in places if it.bitrate == bitrate)
        return next((it for it in there if self._answers(it) or self._answers(it)), None)

    def _go(self, trips: Sequence[Trip], state: State, *, rate: bool) -> list[str]:
        """Bring sensors to other node-IDs; each goes for itself."""
        wrong, told = [], []
        for trip in trips:
            before = trip.unit.state
            try:
                told.append((self._tell(trip, rate=rate and trip.unit.switches), trip))
            except NotSelected as error:
                trip.unit.state = before
                wrong.append(str(error))
            except (SetupRefused, NodeTimeout) as error:
                wrong.append(str(error))
        if not told:
            self._keep()
            return wrong
        missing = self._restart({here for here, _ in told}, [trip for _, trip in told])
        return wrong + self._note([trip for _, trip in told], missing, state)

    def _note(self, trips: Sequence[Trip], missing: Sequence[Trip], state: State) -> list[str]:
        """Keep how far sensors came, and say which did not come where they should."""
        for trip in trips:
            if trip not in missing:
                trip.unit.state = state
        self._keep()
        return [
            f"{trip.unit} was told to be {trip.to} and is not found there: switch the supply off and "
            "on, for the change may wait for that, and look at the label for its serial number"
            for trip in missing
        ]

    def _switch(self, trips: Sequence[Trip], state: State) -> list[str]:
        """Bring sensors to another bit rate, all at the same moment.

        One at another bit rate than the rest destroys their frames. So nobody else may be on the bus, none
        restarts unless all were told, and all do by one frame.
        """
        start = trips[0].start
        if others := self._others(trips):
            return [others]
        told: list[Trip] = []
        for trip in trips:
            try:
                here = self._tell(trip, rate=True)
            except (SetupRefused, NodeTimeout) as error:
                told += [] if isinstance(error, NotSelected) else [trip]
                return [str(error), *self._as_before(told), NONE_RESTARTED]
            if here.bitrate != start.bitrate and len(trips) > 1:
                too_soon = f"{trip.unit} changed its bit rate at once"
                return [too_soon, *self._as_before(told), NONE_RESTARTED]
            told.append(trip)
        missing = self._restart({here}, trips, everybody=True)
        return self._note(trips, missing, state)

    def _others(self, trips: Sequence[Trip]) -> str:
        """Say who else is on the bus of sensors on their way, empty if nobody answers."""
        bench, start = self._bench, trips[0].start
        bench.reach.go(start)
        answer = answering(bench.link, bench.definition.sdo_timeout_s)
        return in_the_way(set(answer) - {trip.start.node_id for trip in trips}, start.bitrate)

    def _as_before(self, trips: Sequence[Trip]) -> list[str]:
        """Tell sensors the bit rate that they still have; say what came of it."""
        said = []
        for trip in trips:
            try:
                self._way.configure(trip.unit, trip.start, trip.start, rate=True)
            except (SetupRefused, NodeTimeout) as error:
                said.append(f"{error}: it may be {trip.to} when it is switched on next")
        return said

    @uninterrupted()
    def _tell(self, trip: Trip, *, rate: bool) -> Place:
        trip.unit.state = "touched"
        self._keep()
        return self._way.configure(trip.unit, trip.start, trip.to, rate=rate)

    @uninterrupted()
    def _restart(
        self, places: set[Place], trips: Sequence[Trip], *, everybody: bool = False
    ) -> list[Trip]:
        """Restart the sensors at some places, and return those that do not come where they should."""
        for place in places:
            self._bench.reach.go(place)
            self._bench.node().begin_reset(node_id=BROADCAST if everybody else None)
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
            left = trip.start == trip.to or not self._answers(trip.start)
            return left and self._answers(trip.to)
        if not self._answers(trip.to):
            return False
        try:
            return serial_of(self._bench.node()) in (None, trip.unit.serial)
        except ConformanceError:
            return False

    def _answers(self, place: Place) -> bool:
        self._bench.reach.go(place)
        return self._bench.node().answers()


def in_the_way(node_ids: Iterable[int], bitrate: int) -> str:
    """Say that some nodes keep others from another bit rate, empty where there are none."""
    named = ", ".join(map(str, sorted(node_ids)))
    return named and (
        f"somebody answers as node-ID {named} and would stay at {bitrate / 1000:g} kbit/s, where it "
        "destroys the frames of all others: disconnect it"
    )


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
