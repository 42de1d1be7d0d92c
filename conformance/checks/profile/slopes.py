"""Slopes as several checks need them: which a device has, their ranges, and what they may show."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from conformance.bench.in_force import InForce, may_wait
from conformance.bench.node import Node
from conformance.bench.sdo import Transfer
from conformance.bench.settling import Settling
from conformance.bench.slope import Seen, SlopePort, degrees
from conformance.checks import cases
from conformance.checks.limits import STEPS, tilt_tolerance_deg
from conformance.checks.waiting import at_need, put_in_force
from conformance.requirements import Case, Cases
from conformance.spec.behaviours import Slope
from conformance.spec.fields import key_of, of_variant
from conformance.spec.model import Alternative, DeviceSpec, Entry, OtherBehaviours, OtherServices
from conformance.verdict import Verdict

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


def port_of(node: Node, slope: MeasuredSlope) -> SlopePort:
    """Return a slope of the node."""
    return SlopePort(node, slope.entry, slope.rule)


def operating_parameter(spec: DeviceSpec, rule: Slope | None) -> Entry | None:
    """Return the entry that inverts and scales a slope, None without one."""
    named = None if rule is None else rule.operating_parameter
    return None if named is None else spec.entry(*key_of(named))


def upright_port_of(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> SlopePort:
    """Return a slope of the node, which is not inverted; stored first where it may have to be."""
    port = port_of(node, slope)
    _set_up(node, port, partial(port.invert, on=False), in_force, verdict)
    return port


def plain_port_of(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> SlopePort:
    """Return such a slope whose offsets count, without a differential offset."""
    port = port_of(node, slope)
    _set_up(node, port, port.count_upright, in_force, verdict)
    port.make_plain()
    return port


def _set_up(
    node: Node,
    port: SlopePort,
    change: Callable[[], None],
    in_force: InForce,
    verdict: Verdict,
) -> None:
    """Change a slope's operating parameter, which has to be stored unless the slope shows that it acts."""
    parameter = operating_parameter(node.spec, port.rule)
    if parameter is None or not may_wait(parameter):
        change()
        return
    held, before = node.number(*parameter.key), port.seen()
    change()

    def goes_on() -> bool | None:
        return None if is_same(before, 0.0, port.seen()) else False

    if node.number(*parameter.key) != held:
        put_in_force(in_force, verdict, [parameter], goes_on, Settling(node).wait)


def is_same(before: Seen, turn: float, seen: Seen) -> bool:
    """Tell whether a slope shows what it did before, whole turns left out of account."""
    return distance(seen.value, before.value, turn) <= margin_of(seen, before)


def targets(slope: MeasuredSlope, step_deg: float) -> list[int]:
    """Return values in steps well inside the range and the type, so that a slope may show them."""
    shares = (-0.5, 0.0, 0.5) if slope.low_deg < 0 else (0.0, 0.25, 0.5)
    most = slope.entry.type.maximum // 2
    wanted = [round(slope.at(share) / step_deg) for share in shares]
    return sorted({min(max(value, -most), most) for value in wanted})


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a slope or an offset may show, and the readings by which it does.

    Args:
        steps: The value.
        others: The readings, none for what is judged first.
    """

    steps: float
    others: tuple[Other | None, ...] = ()


def judge(
    verdict: Verdict,
    quantity: str,
    seen: Seen,
    outcomes: Sequence[Outcome],
    *,
    before: Seen | None = None,
    turn_steps: float = 0.0,
) -> None:
    """Judge that a value is one of several, as exactly as it was seen to be steady.

    Args:
        verdict: The check's verdict.
        quantity: What was seen.
        seen: The value.
        outcomes: What it may be.
        before: The value from which the outcomes were calculated.
        turn_steps: Steps of a whole turn, by which it may be off; 0 for none.
    """
    margin = margin_of(seen, before)
    fitting = [it for it in outcomes if distance(seen.value, it.steps, turn_steps) <= margin]
    values = dict.fromkeys(f"{it.steps:g}" for it in outcomes)
    verdict.holds(
        quantity,
        expected=f"{' or '.join(values)} ± {margin}",
        actual=str(seen.value),
        ok=bool(fitting),
    )
    if fitting and len({it.steps for it in outcomes}) > 1:
        for other in fitting[0].others:
            if other is not None:
                verdict.follows(other.ambiguity, other.reading)


def margin_of(seen: Seen, before: Seen | None = None) -> int:
    """Return how exact a comparison of two values can be, in steps."""
    return STEPS + seen.spread + (before.spread if before is not None else 0)


def distance(value: float, wanted: float, turn_steps: float) -> float:
    """Return how far two values are apart, whole turns left out of account."""
    apart = abs(value - wanted)
    return min(apart % turn_steps, -apart % turn_steps) if turn_steps else apart


def within_a_turn(slope: MeasuredSlope, value_deg: float, near_deg: float) -> float:
    """Return an angle without the whole turns that a slope may show more or less."""
    if not slope.turn:
        return value_deg
    return math.remainder(value_deg - near_deg, TURN_DEG) + near_deg


def judge_angle(
    verdict: Verdict,
    what: str,
    slope: MeasuredSlope,
    shown_deg: float,
    tilt_deg: float,
    step_deg: float,
    doubt_deg: float,
) -> None:
    """Judge that a slope shows the angle of a tilt, or one a whole turn from it where it may."""
    verdict.within(
        what,
        [within_a_turn(slope, shown_deg, tilt_deg)],
        tilt_deg,
        tilt_tolerance_deg(step_deg),
        unit="deg",
        doubt=doubt_deg,
    )


def told_apart(margins: Sequence[float], doubt: float) -> bool:
    """Tell whether a bench that may be off by so much knows if a value is inside any of its limits.

    Args:
        margins: How far it is inside each, negative where it is not.
        doubt: By how much the bench may have put it off.
    """
    return not doubt or abs(max(margins)) > doubt


def turn_steps(slope: MeasuredSlope, step_deg: float) -> float:
    """Return the steps of a turn where a slope may show one more or less, else 0."""
    return TURN_DEG / step_deg if slope.turn else 0.0


def confirmed(verdict: Verdict, what: str, transfer: Transfer) -> None:
    """Judge that a download was confirmed."""
    verdict.holds(what, expected="confirmed", actual=str(transfer), ok=transfer.confirmed)


def seen_with(
    node: Node,
    port: SlopePort,
    setting: Entry | None,
    in_force: InForce,
    verdict: Verdict,
    is_as_before: Callable[[Seen], bool],
) -> Seen:
    """Return what a slope shows with a new setting, stored first where it may have to be.

    Args:
        node: The node under test.
        port: The slope.
        setting: What was written.
        in_force: What stores it.
        verdict: To note the reading that the node follows.
        is_as_before: Tells whether what the slope shows says that the setting does not act.
    """

    def goes_on() -> bool:
        return is_as_before(port.seen())

    written = [] if setting is None else [setting]
    put_in_force(in_force, verdict, written, goes_on, Settling(node).wait)
    return port.seen()
