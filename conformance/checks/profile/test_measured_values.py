"""Measured values against what the sensor is exposed to: tilt, temperature, supply voltage (CiA 410)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.sensor.slope import Seen, watch
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.in_force import InForce
from conformance.checks import cases
from conformance.checks.limits import (
    GRAVITY_G,
    STEPS,
    TEMPERATURE_K,
    allowed_supply_v,
    supply_tolerance_v,
    tilt_tolerance_deg,
)
from conformance.checks.profile.shown import (
    distance,
    judge_angle,
    margin_of,
    told_apart,
    turn_steps,
)
from conformance.checks.profile.slope_ports import port_of, upright_port_of
from conformance.checks.profile.slopes import (
    MeasuredSlope,
    Other,
    error_limits,
    measured_slopes,
    range_readings,
    slopes,
)
from conformance.checks.steps import own_value
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases, requirement
from conformance.spec.model import Alternative, DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire.errors import WireError

MOST_DEGC = 20.0
"""Within the range of every sensor, and below 12.7 degC, the most that 8 bits of 0.1 degC show."""

SUPPLIES_V = (18.0, 24.0)
"""Within the supply range of most sensors for 12 V or 24 V systems."""

STEEP_DEG = 70.0
"""So far that each axis in turn has nearly all of gravity: a wrong scale of one shows in the sum."""


@requirement(
    "DEV-01",
    level="manual",
    cases=slopes(),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_slope_follows_the_tilt(
    node: Node, slope: MeasuredSlope, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """A slope changes by the angle by which the device is tilted, over its range and with its sign."""
    port = upright_port_of(node, slope, in_force, verdict)
    step_deg = port.step_deg
    port.tilt(stimulus, 0.0)
    level = port.seen()

    for tilt_deg in _that_fit(slope, level, step_deg):
        port.tilt(stimulus, tilt_deg)
        change_deg = (port.seen().value - level.value) * step_deg
        what = f"change of {slope.entry.address} for {tilt_deg:g} deg"
        doubt_deg = 2 * stimulus.tolerance_deg
        judge_angle(verdict, what, slope, change_deg, tilt_deg, step_deg, doubt_deg)


def _that_fit(slope: MeasuredSlope, level: Seen, step_deg: float) -> list[float]:
    """Return the tilts that a slope's type can show.

    Raises:
        SetupRefused: There are fewer than two.
    """
    low, high = slope.entry.type.minimum, slope.entry.type.maximum
    fitting = [deg for deg in slope.tilts if low <= level.value + deg / step_deg <= high]
    if len(fitting) < 2:
        raise SetupRefused(f"steps of {step_deg:g} deg leave too small a range to be tilted over")
    return fitting


def _one_of_two(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
    return {slope.entry.follows} != {it.entry.follows for it in measured_slopes(spec)}


@requirement(
    "DEV-02",
    level="manual",
    cases=slopes(_one_of_two, as_found=True),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_slope_keeps_to_its_axis(
    node: Node, slope: MeasuredSlope, stimulus: Stimulus, verdict: Verdict
) -> None:
    """A slope stays as it is while the device is tilted about the other axis alone."""
    port = port_of(node, slope)
    step_deg = port.step_deg
    port.tilt_other(stimulus, 0.0)
    level = port.seen()

    for share in (-0.4, 0.4):
        port.tilt_other(stimulus, slope.at(share))
        change_deg = (port.seen().value - level.value) * step_deg
        verdict.within(
            f"change of {slope.entry.address} for {slope.at(share):g} deg of the other axis",
            [change_deg],
            0.0,
            tilt_tolerance_deg(step_deg),
            unit="deg",
            doubt=2 * stimulus.tolerance_deg,
        )


BEYOND_DEG = 2.0


def _has_a_limit(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
    return not slope.turn and any(error_limits(spec, slope.entry))


@requirement(
    "DEV-03",
    level="manual",
    cases=slopes(_has_a_limit),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_slope_beyond_its_limit(
    node: Node, slope: MeasuredSlope, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """Tilted beyond the limit of an error, a slope stops at the limit, or goes on, as documented."""
    port = upright_port_of(node, slope, in_force, verdict)
    step_deg = port.step_deg
    port.tilt(stimulus, 0.0)
    level = port.seen()

    every = list(error_limits(node.spec, slope.entry))
    for end in (0, 1):
        end_deg = every[0].ends_deg[end]
        tilt_deg = end_deg + math.copysign(BEYOND_DEG + stimulus.tolerance_deg, end_deg)
        port.tilt(stimulus, tilt_deg)
        change_deg = (port.seen().value - level.value) * step_deg
        shown: list[tuple[float, Other | Alternative | None]] = [
            (it.ends_deg[end] if it.stops else tilt_deg, it.other) for it in every
        ]
        shown += [
            (ends[end], other)
            for ends, other in range_readings(slope.entry)
            if abs(ends[end]) < abs(tilt_deg)
        ]
        tolerance_deg = tilt_tolerance_deg(step_deg)
        margins = [tolerance_deg - abs(change_deg - deg) for deg, _ in shown]
        fitting = [other for margin, (_, other) in zip(margins, shown, strict=True) if margin >= 0]
        wanted = dict.fromkeys(f"{deg:g}" for deg, _ in shown)
        verdict.holds(
            f"change of {slope.entry.address} for {tilt_deg:g} deg",
            expected=f"{' or '.join(wanted)} deg ± {tolerance_deg:g} deg",
            actual=f"{change_deg:.4g} deg",
            ok=bool(fitting),
            resolved=told_apart(margins, 2 * stimulus.tolerance_deg),
        )
        if fitting and fitting[0] is not None:
            verdict.follows(fitting[0].ambiguity, fitting[0].reading)


def _second_values(spec: DeviceSpec) -> Iterable[Case]:
    """Return the slopes that show what one before them shows, with the resolution of both."""
    first: dict[tuple[object, object], MeasuredSlope] = {}
    for slope in measured_slopes(spec):
        if slope.rule is not None and slope.rule.resolution is not None:
            one = first.setdefault((slope.entry.follows, slope.rule.resolution), slope)
            if one is not slope:
                yield Case(slope.entry.address, (one, slope), slope.rule.source)


@requirement("DEV-04", level="manual", cases=("pair", _second_values))
def test_two_values_of_an_axis_agree(
    node: Node, pair: tuple[MeasuredSlope, MeasuredSlope], verdict: Verdict
) -> None:
    """Two slopes of one axis in one resolution, of 16 and of 32 bits, show the same."""
    ports = [port_of(node, slope) for slope in pair]
    one, other = (port.seen() for port in ports)
    offsets = [port.offset + port.differential for port in ports]
    if offsets[0] != offsets[1]:
        raise SetupRefused(f"the two have offsets of their own, {offsets[0]} and {offsets[1]}")
    if one.value in (pair[0].entry.type.minimum, pair[0].entry.type.maximum):
        raise SetupRefused(f"{pair[0].entry.address} has come to the end of its type")

    apart = distance(other.value, one.value, turn_steps(pair[1], ports[1].step_deg))
    verdict.holds(
        f"{pair[1].entry.address} beside {pair[0].entry.address}",
        expected=f"{one.value} ± {margin_of(one, other)}",
        actual=str(other.value),
        ok=apart <= margin_of(one, other),
    )


def _follows(quantity: str) -> tuple[str, Cases]:
    def pick(entry: Entry, spec: DeviceSpec) -> bool:
        has_unit = entry.follows == quantity and entry.scale is not None
        return cases.readable(entry, spec) and entry.type.is_integer and has_unit

    return cases.entries(pick)


@requirement("DEV-05", level="manual", cases=_follows("temperature"), needs=("temperature",))
def test_temperature_follows(
    node: Node, entry: Entry, stimulus: Stimulus, verdict: Verdict
) -> None:
    """A temperature changes as that of the device does, in the documented unit."""
    warm_degc = _shown_degc(entry)
    cold_degc = -warm_degc
    stimulus.temperature(cold_degc)
    cold = own_value(node, entry)
    stimulus.temperature(warm_degc)
    warm = own_value(node, entry)

    changes = [_change(reading, cold, warm) for reading in entry.readings]
    nominal = warm_degc - cold_degc
    margins = [
        -math.inf
        if change is None
        else TEMPERATURE_K + STEPS * (reading.scale or 0) - abs(change - nominal)
        for change, reading in zip(changes, entry.readings, strict=True)
    ]
    fitting = [number for number, margin in enumerate(margins) if margin >= 0]
    verdict.holds(
        f"change of {entry.address} from {cold_degc:g} degC to {warm_degc:g} degC",
        expected=f"{nominal:g} degC ± {TEMPERATURE_K:g} degC and {STEPS} steps",
        actual=" or ".join(f"{it:g} degC" for it in changes if it is not None)
        or "of no known type",
        ok=bool(fitting),
        resolved=told_apart(margins, 2 * stimulus.tolerance_k),
    )
    if fitting and fitting[0] > 0:
        alternative = entry.alternatives[fitting[0] - 1]
        verdict.follows(alternative.ambiguity, alternative.reading)


def _shown_degc(entry: Entry) -> float:
    """Return a temperature that every reading can show, also with the other sign."""
    ends = [it.type.maximum * (it.scale or 1.0) for it in entry.readings if it.type.is_integer]
    return float(int(min(MOST_DEGC, *ends)))


def _change(entry: Entry, before: bytes, after: bytes) -> float | None:
    try:
        values = [entry.type.decode(data) for data in (before, after)]
    except WireError:
        return None
    return (int(values[1]) - int(values[0])) * (entry.scale or 1.0)


@requirement("DEV-06", level="manual", cases=_follows("supply-voltage"), needs=("supply",))
def test_supply_voltage_is_shown(
    node: Node, entry: Entry, stimulus: Stimulus, verdict: Verdict
) -> None:
    """A supply voltage is that with which the device is supplied."""
    for nominal_v in SUPPLIES_V:
        volt = allowed_supply_v(node.spec, nominal_v, stimulus.tolerance_v)
        stimulus.supply(volt)
        shown = node.number(entry.index, entry.sub) * (entry.scale or 1.0)
        verdict.within(
            f"{entry.address} with {volt:g} V",
            [shown / 1000 if entry.unit == "mV" else shown],
            volt,
            supply_tolerance_v(volt),
            unit="V",
            doubt=stimulus.tolerance_v,
        )


@dataclass(frozen=True, slots=True)
class Accelerations:
    """The accelerations of three axes in one unit, and the axes about which tilting is shown elsewhere."""

    entries: tuple[Entry, Entry, Entry]
    axes: tuple[str, ...]


def _accelerations(spec: DeviceSpec) -> Iterable[Case]:
    shown = {entry.follows for entry in spec.entries.values() if cases.readable(entry, spec)}
    axes = tuple(axis for axis in "xy" if f"tilt-{axis}" in shown)
    for x, y, z in cases.accelerations(spec):
        if x.scale is not None and x.unit in ("g", "mg") and x.scale == y.scale == z.scale:
            yield Case(x.address, Accelerations((x, y, z), axes), x.source)


@requirement("DEV-07", level="manual", cases=("group", _accelerations), needs=("tilt",))
def test_accelerations_are_those_of_gravity(
    node: Node, group: Accelerations, stimulus: Stimulus, verdict: Verdict
) -> None:
    """At rest the accelerations of the three axes make 1 g, and turn with the device."""
    seen = []
    tilts = [(axis, sign * STEEP_DEG) for axis in group.axes for sign in (-1, 1)]
    for axis, tilt_deg in (*tilts, ("x", 0.0)):
        stimulus.tilt(*(tilt_deg if it == axis else 0.0 for it in "xy"))
        seen.append([watch(node, entry.key).value for entry in group.entries])

    for reading in range(len(group.entries[0].readings)):
        units = [_gravity(entry.readings, reading) for entry in group.entries]
        sizes = [
            math.hypot(*(v * unit for v, unit in zip(vector, units, strict=True)))
            for vector in seen
        ]
        fits = all(abs(size - 1.0) <= GRAVITY_G for size in sizes)
        if fits or reading == len(group.entries[0].alternatives):
            verdict.within("acceleration at rest", sizes, 1.0, GRAVITY_G, unit="g")
            for axis, before, after in zip(group.axes, seen[::2], seen[1::2], strict=False):
                quantity = f"change from -{STEEP_DEG:g} deg to {STEEP_DEG:g} deg of {axis.upper()}"
                turned = math.dist(before, after) * units[0]
                verdict.at_least(quantity, turned, 1.0, unit="g")
            if reading > 0 and fits:
                other = group.entries[0].alternatives[reading - 1]
                verdict.follows(other.ambiguity, other.reading)
            return


def _gravity(readings: tuple[Entry, ...], number: int) -> float:
    """Return one bit of an acceleration in g, under one reading."""
    entry = readings[min(number, len(readings) - 1)]
    return (entry.scale or 1.0) / (1000 if entry.unit == "mg" else 1)
