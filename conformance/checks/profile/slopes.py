"""Slopes as several checks need them: which a device has, their ranges, and what they may show."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from conformance.bench.sensor.slope import degrees
from conformance.checks import cases
from conformance.checks.waiting import at_need
from conformance.requirements import Case, Cases
from conformance.spec.behaviours import Slope
from conformance.spec.fields import key_of, of_variant
from conformance.spec.model import Alternative, DeviceSpec, Entry, OtherBehaviours, OtherServices

TURN_DEG = 360.0


NARROW_DEG = 10.0
"""Range to stay in where a manual prints none: that of the narrowest sensors."""


Other = OtherBehaviours | OtherServices


AXES = ("tilt-x", "tilt-y")


@dataclass(frozen=True, slots=True)
class MeasuredSlope:
    """A slope and what the manual says of it.

    Args:
        name: Name of its rule; empty without one.
        entry: Its value.
        rule: The rule on its offsets as judged.
        low_deg: Least angle that every reading lets it show.
        high_deg: Greatest angle that every reading lets it show.
        turn: It may show an angle a whole turn more or less.
    """

    name: str
    entry: Entry
    rule: Slope | None
    low_deg: float
    high_deg: float
    turn: bool

    def at(self, share: float) -> float:
        """Return a share of the range in deg; below 0 of its negative part, where it has one."""
        return -share * self.low_deg if share < 0 else share * self.high_deg

    @property
    def tilts(self) -> list[float]:
        """Angles over the range, in deg."""
        return sorted({self.at(share) for share in (-0.8, -0.4, 0.4, 0.8)} - {0.0})


def measured_slopes(spec: DeviceSpec) -> Iterator[MeasuredSlope]:
    """Return the slopes that every reading of the manual has."""
    rules = {
        key_of(rule.value): (name, rule)
        for name, rule in spec.behaviours.items()
        if isinstance(rule, Slope)
    }
    for entry in spec.entries.values():
        name, rule = rules.get(entry.key, ("", None))
        has_unit = degrees(entry) is not None or (rule is not None and rule.resolution is not None)
        known = all(cases.present(it, spec) and it.readable for it in entry.readings)
        if entry.follows in AXES and known and has_unit and cases.same_type(entry):
            low, high, turn = _range(spec, entry)
            yield MeasuredSlope(name, entry, rule, low, high, turn)


def _range(spec: DeviceSpec, slope: Entry) -> tuple[float, float, bool]:
    """Return the range that all readings and all values of one axis have in common, in deg."""
    ranges = [*_of_entries(spec, slope), *_of_errors(spec, slope)]
    known = [it for it in ranges if it[1] - it[0] <= TURN_DEG]
    if not known:
        return -NARROW_DEG, NARROW_DEG, True
    low, high = max(low for low, _ in known), min(high for _, high in known)
    return low, high, all(high - low > TURN_DEG - 1 for low, high in known)


def _of_entries(spec: DeviceSpec, slope: Entry) -> Iterator[tuple[float, float]]:
    for entry in spec.entries.values():
        if entry.follows == slope.follows:
            for ends_deg, _ in range_readings(entry):
                yield ends_deg


def range_readings(entry: Entry) -> Iterator[tuple[tuple[float, float], Alternative | None]]:
    """Return the least and greatest angle that an entry may show, under each reading that has them."""
    unit = degrees(entry)
    for number, reading in enumerate(entry.readings):
        if reading.ranges and unit:
            lows, highs = zip(*reading.ranges, strict=True)
            other = entry.alternatives[number - 1] if number else None
            yield (min(lows) * unit, max(highs) * unit), other


def _of_errors(spec: DeviceSpec, slope: Entry) -> Iterator[tuple[float, float]]:
    for limits in error_limits(spec, slope):
        yield limits.ends_deg


@dataclass(frozen=True, slots=True)
class ErrorLimits:
    """The angles at which an error occurs, under one reading.

    Args:
        ends_deg: The least and the greatest.
        stops: The slope goes no further.
        other: The reading, None for what is judged first.
    """

    ends_deg: tuple[float, float]
    stops: bool
    other: OtherServices | None


def error_limits(spec: DeviceSpec, slope: Entry) -> Iterator[ErrorLimits]:
    """Return the angles at which an error occurs and whether the slope stops there, per reading."""
    for services, other in spec.services_readings:
        causes = services.emcy_producer.causes if services.emcy_producer else []
        for cause in causes:
            limits = of_variant(cause.limits, spec.variant)
            if cause.cause == slope.follows and limits:
                yield ErrorLimits((float(limits[0]), float(limits[1])), cause.stops, other)


def tilted(spec: DeviceSpec, share: float) -> tuple[float, float]:
    """Return the tilt of both axes at a share of what their slopes show; 0 where there is none."""
    slopes = {it.entry.follows: it for it in measured_slopes(spec)}
    x, y = (slopes[axis].at(share) if axis in slopes else 0.0 for axis in ("tilt-x", "tilt-y"))
    return x, y


Pick = Callable[[MeasuredSlope, DeviceSpec], bool]


def slopes(
    pick: Pick = lambda slope, spec: True,  # noqa: ARG005 - its default takes all
    *,
    as_found: bool = False,
) -> tuple[str, Cases]:
    """Return cases for the slopes that ``pick`` takes.

    Args:
        pick: Which.
        as_found: The check writes no operating parameter.
    """

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for slope in measured_slopes(spec):
            if pick(slope, spec):
                section = slope.rule.source if slope.rule else slope.entry.source
                waits = () if as_found else at_need(operating_parameter(spec, slope.rule))
                yield Case(slope.entry.address, slope, section, at_need=waits)

    return "slope", generate


def having(*attributes: str) -> Pick:
    """Pick the slopes whose rule names some objects or bits that every reading has and lets write.

    Of the slope's value and a calculated offset it is enough that they can be read.
    """

    def pick(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
        if slope.rule is None:
            return False
        for attribute in attributes:
            named = getattr(slope.rule, attribute)
            if named is None:
                return False
            if attribute in ("inversion", "scaling"):
                continue
            entry = spec.entries[key_of(named)]
            if not cases.present(entry, spec) or not all(r.readable for r in entry.readings):
                return False
            settable = attribute == "offset" or all(r.writable for r in entry.readings)
            if not settable:
                return False
        return True

    return pick


def offset_writable(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
    """Pick the slopes whose offset every reading lets be written."""
    if not having("offset")(slope, spec) or slope.rule is None or slope.rule.offset is None:
        return False
    return all(r.writable for r in spec.entries[key_of(slope.rule.offset)].readings)


def possible(
    spec: DeviceSpec, slope: MeasuredSlope, attribute: str
) -> dict[Any, OtherBehaviours | None]:
    """Return what a rule's attribute is as judged, then under other readings."""
    found: dict[Hashable, OtherBehaviours | None] = {}
    for rule, other in spec.behaviour_readings(slope.name):
        if isinstance(rule, Slope):
            found.setdefault(getattr(rule, attribute), other)
    return found


def idle_offsets(spec: DeviceSpec, slope: MeasuredSlope) -> list[OtherBehaviours | None]:
    """Return the readings by which scaling is off for good, so that no offset acts."""
    found = []
    for rule, other in spec.behaviour_readings(slope.name):
        if isinstance(rule, Slope) and rule.scaling is not None and rule.operating_parameter:
            entry = spec.entries[key_of(rule.operating_parameter)]
            value = entry.default if isinstance(entry.default, int) else 0
            if not entry.writable and not value >> rule.scaling & 1:
                found.append(other)
    return found


def targets(slope: MeasuredSlope, step_deg: float) -> list[int]:
    """Return values in steps well inside the range and the type, so that a slope may show them."""
    shares = (-0.5, 0.0, 0.5) if slope.low_deg < 0 else (0.0, 0.25, 0.5)
    most = slope.entry.type.maximum // 2
    wanted = [round(slope.at(share) / step_deg) for share in shares]
    return sorted({min(max(value, -most), most) for value in wanted})


def operating_parameter(spec: DeviceSpec, rule: Slope | None) -> Entry | None:
    """Return the entry that inverts and scales a slope, None without one."""
    named = None if rule is None else rule.operating_parameter
    return None if named is None else spec.entry(*key_of(named))
