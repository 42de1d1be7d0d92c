"""What the sensor measures: the physical world, and live entries that show it in their scale."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Final

from conformance.simulator.dictionary import ObjectDictionary
from conformance.simulator.faults import Faults
from conformance.spec.document import Follows
from conformance.spec.fields import key_of
from conformance.spec.model import Entry, Key
from conformance.wire.datatypes import DataType, Value

TILTS: Final[tuple[Follows, ...]] = ("tilt-x", "tilt-y")
"""The axes."""

_TURN_DEG: Final = 360.0
_PER_UNIT: Final = {"mV": 1e3, "mg": 1e3, "mdeg": 1e3, "mdeg/s": 1e3, "rad": math.pi / 180}
"""What a physical value is multiplied with to be in a unit other than V, g, deg, deg/s, degC."""


FORGOTTEN_NS: Final = 60_000_000_000
"""After that time every filter has followed a turn."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A sudden change of the tilt.

    Args:
        at_ns: When.
        x_deg: By how much about X.
        y_deg: By how much about Y.
    """

    at_ns: int
    x_deg: float
    y_deg: float

    def deg(self, axis: Follows) -> float:
        """Return by how much an axis was tilted."""
        return self.x_deg if axis == "tilt-x" else self.y_deg


@dataclass(slots=True)
class World:
    """The physical values at the sensor."""

    tilt_x_deg: float = 10.5
    tilt_y_deg: float = -4.25
    rate_x_deg_s: float = 0.0
    rate_y_deg_s: float = 0.0
    rate_z_deg_s: float = 0.0
    temperature_degc: float = 25.0
    supply_v: float = 24.0
    turns: list[Turn] = field(default_factory=list, init=False)

    def tilt(self, x_deg: float, y_deg: float, now_ns: int) -> None:
        """Tilt the sensor at once; what filters its angles has yet to follow."""
        self.turns = [it for it in self.turns if now_ns - it.at_ns < FORGOTTEN_NS]
        self.turns.append(Turn(now_ns, x_deg - self.tilt_x_deg, y_deg - self.tilt_y_deg))
        self.tilt_x_deg, self.tilt_y_deg = x_deg, y_deg

    def rest(self, now_ns: int) -> None:
        """Bring everything back to what it was at first."""
        at_first = World()
        self.tilt(at_first.tilt_x_deg, at_first.tilt_y_deg, now_ns)
        for quantity in fields(self):
            if quantity.init:
                setattr(self, quantity.name, getattr(at_first, quantity.name))

    def tilt_deg(self, axis: Follows) -> float:
        """Return the tilt of an axis."""
        return self.tilt_x_deg if axis == "tilt-x" else self.tilt_y_deg

    def quantity(self, follows: Follows) -> float | None:
        """Return a quantity in V, g, deg, deg/s or degC; None when it is none of the world's."""
        sin_x = math.sin(math.radians(self.tilt_x_deg))
        sin_y = math.sin(math.radians(self.tilt_y_deg))
        return {
            "tilt-x": self.tilt_x_deg,
            "tilt-y": self.tilt_y_deg,
            "acceleration-x": sin_x,
            "acceleration-y": sin_y,
            "acceleration-z": math.sqrt(max(0.0, 1.0 - sin_x**2 - sin_y**2)),
            "rate-x": self.rate_x_deg_s,
            "rate-y": self.rate_y_deg_s,
            "rate-z": self.rate_z_deg_s,
            "temperature": self.temperature_degc,
            "supply-voltage": self.supply_v,
        }.get(follows)


class LiveValues:
    """Computes the live entries of a node.

    Attributes:
        slopes: Turns an angle in deg into bits of an entry, for slopes with offsets.
        units: Returns the documented bits that one bit of an entry stands for now.
        stops: Lowest and highest angle that is shown of an axis, in deg.
        lags: Returns the angle in deg by which an axis is ahead of its filter.
    """

    def __init__(self, world: World, dictionary: ObjectDictionary, faults: Faults) -> None:
        self._world = world
        self._faults = faults
        self._factors = {key_of(it): factor for it, factor in faults.live_factors.items()}
        self._frozen: dict[tuple[int, int], Value] = {}
        self.slopes: dict[Key, Callable[[float], float]] = {}
        self.units: dict[Key, Callable[[], float]] = {}
        self.stops: dict[Follows, tuple[float, float]] = {}
        self.lags: dict[Follows, Callable[[], float]] = {}
        for entry in dictionary.entries.values():
            if entry.follows is not None and world.quantity(entry.follows) is not None:
                dictionary.computed[entry.key] = partial(self._value, entry, entry.follows)

    def beyond(self, axis: Follows, low: float, high: float) -> bool:
        """Return whether the sensor is tilted further than some limits, in deg."""
        return not low <= self._world.tilt_deg(axis) <= high

    def out_of_range(self, entry: Entry) -> bool:
        """Return whether the physical value exceeds what the entry can show."""
        if entry.follows is None or _whole_turn(entry):
            return False
        low, high = _limits(entry)
        return not low <= self._counts(entry, entry.follows, filtered=False) <= high

    def _value(self, entry: Entry, follows: Follows) -> Value:
        bits = self._counts(entry, follows)
        if self._faults.live_factors:
            bits *= self._factors.get(entry.key, 1.0)
        if self._faults.live_sign_lost:
            bits = abs(bits)
        unit = self.units.get(entry.key)
        value = _shown(entry, bits, unit() if unit else 1.0)
        return self._frozen.setdefault(entry.key, value) if self._faults.live_frozen else value

    def tilt_deg(self, axis: Follows, *, filtered: bool = True) -> float:
        """Return the angle that the sensor makes of an axis."""
        low, high = self.stops.get(axis, (-math.inf, math.inf))
        if self._faults.live_swaps_axes:
            axis = TILTS[1 - TILTS.index(axis)]
        tilt = self._world.tilt_deg(axis) + self._faults.live_bias_deg
        if filtered and axis in self.lags:
            tilt -= self.lags[axis]()
        if self._faults.live_most_deg is not None:
            tilt = math.copysign(min(abs(tilt), self._faults.live_most_deg), tilt)
        return min(max(-tilt if self._faults.live_negated else tilt, low), high)

    def _counts(self, entry: Entry, follows: Follows, *, filtered: bool = True) -> float:
        if follows not in TILTS:
            return counts(entry, self._world.quantity(follows) or 0.0)
        tilt = self.tilt_deg(follows, filtered=filtered)
        slope = self.slopes.get(entry.key)
        return counts(entry, tilt) if slope is None else slope(tilt)


def counts(entry: Entry, physical: float) -> float:
    """Return a physical value in bits of an entry, not yet rounded."""
    return physical * _PER_UNIT.get(entry.unit or "", 1.0) / (entry.scale or 1.0)


def physical_deg(entry: Entry, value: int) -> float:
    """Return the angle that an entry's value stands for."""
    return value * (entry.scale or 1.0) / _PER_UNIT.get(entry.unit or "", 1.0)


def clipped(entry: Entry, value: float) -> int:
    """Return a number of bits rounded and within what the entry can show."""
    low, high = _limits(entry)
    return min(max(round(value), low), high)


def _shown(entry: Entry, value: float, unit: float) -> Value:
    """Return what an entry shows whose bits are now ``unit`` times as large as documented."""
    if entry.type in (DataType.REAL32, DataType.REAL64):
        return value
    low, high = (round(limit / unit) for limit in _limits(entry))
    turn = _whole_turn(entry) / unit
    if turn:
        value = low + round(value - low) % round(turn)
    low, high = max(low, entry.type.minimum), min(high, entry.type.maximum)
    return min(max(round(value), low), high)


def _whole_turn(entry: Entry) -> int:
    """Return the bits of 360 deg when the entry's range is all of it, else 0."""
    if entry.follows not in TILTS or entry.ranges is None:
        return 0
    turn = round(counts(entry, _TURN_DEG))
    low, high = _limits(entry)
    return turn if turn <= high - low + 1 <= turn + 1 else 0


def _limits(entry: Entry) -> tuple[int, int]:
    if entry.ranges:
        return min(low for low, _ in entry.ranges), max(high for _, high in entry.ranges)
    return entry.type.minimum, entry.type.maximum
