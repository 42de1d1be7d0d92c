"""The documented measuring range: a slope follows the tilt to its ends, and shows nothing beyond (CiA 410)."""

from __future__ import annotations

from collections.abc import Iterator

from conformance.bench.node.node import Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.in_force import InForce
from conformance.checks.limits import STEPS
from conformance.checks.profile.shown import judge_angle
from conformance.checks.profile.slope_ports import upright_port_of
from conformance.checks.profile.slopes import TURN_DEG, MeasuredSlope, error_limits, slopes
from conformance.errors import SetupRefused
from conformance.requirements import requirement
from conformance.spec.behaviours import Slope
from conformance.spec.fields import of_variant
from conformance.spec.model import DeviceSpec, OtherBehaviours
from conformance.verdict import Verdict

MARGIN_DEG = 1.0
"""How far from an end the device is tilted, more than bench and device are off."""

PLACES = 8
"""Angles between the ends of a whole turn."""

Range = tuple[float, float]


def _covered(
    spec: DeviceSpec, slope: MeasuredSlope
) -> Iterator[tuple[Range, OtherBehaviours | None]]:
    """Return the angles that a slope shows with no offset, by every reading that has them."""
    for rule, other in spec.behaviour_readings(slope.name):
        covers = of_variant(rule.covers, spec.variant) if isinstance(rule, Slope) else None
        if covers is not None:
            yield (float(covers[0]), float(covers[1])), other


def _ranges(spec: DeviceSpec, slope: MeasuredSlope) -> list[Range]:
    return [ends for ends, _ in _covered(spec, slope)]


def _is_covered(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
    return bool(_ranges(spec, slope))


def _is_a_turn(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
    ranges = _ranges(spec, slope)
    return bool(ranges) and all(high - low >= TURN_DEG for low, high in ranges)


def _angles(spec: DeviceSpec, slope: MeasuredSlope, tolerance_deg: float) -> list[float]:
    """Return angles up to both ends that every reading has, in deg, on a bench so exact."""
    limits = [it.ends_deg for it in error_limits(spec, slope.entry)]
    ranges = [*_ranges(spec, slope), *limits]
    margin_deg = MARGIN_DEG + tolerance_deg
    low = max(low for low, _ in ranges) + margin_deg
    high = min(high for _, high in ranges) - margin_deg
    if not _is_a_turn(slope, spec):
        return [low, low / 2, high / 2, high]
    first = ranges[0][0]
    between = [first + TURN_DEG * place / PLACES for place in range(1, PLACES)]
    return [first + margin_deg, *between, first + TURN_DEG - margin_deg]


@requirement(
    "DEV-32",
    level="manual",
    cases=slopes(_is_covered),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_slope_covers_its_range(
    node: Node, slope: MeasuredSlope, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """A slope follows the tilt over the whole documented measuring range, up to both ends."""
    port = upright_port_of(node, slope, in_force, verdict)
    step_deg = port.step_deg
    port.tilt(stimulus, 0.0)
    level = port.seen()

    for tilt_deg in _angles(node.spec, slope, stimulus.tolerance_deg):
        port.tilt(stimulus, tilt_deg)
        change_deg = (port.seen().value - level.value) * step_deg
        what = f"change of {slope.entry.address} for {tilt_deg:g} deg"
        doubt_deg = 2 * stimulus.tolerance_deg
        judge_angle(verdict, what, slope, change_deg, tilt_deg, step_deg, doubt_deg)


@requirement(
    "DEV-38",
    level="manual",
    cases=slopes(_is_covered),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_slope_is_the_tilt_itself(
    node: Node, slope: MeasuredSlope, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """A slope without offsets is the angle of the tilt itself: 0 where the device is level."""
    port = upright_port_of(node, slope, in_force, verdict)
    if port.offset or port.differential:
        raise SetupRefused("the node has an offset, so that the slope is not the tilt itself")
    step_deg = port.step_deg

    for tilt_deg in (0.0, *_angles(node.spec, slope, stimulus.tolerance_deg)):
        port.tilt(stimulus, tilt_deg)
        what = f"{slope.entry.address} at {tilt_deg:g} deg"
        shown_deg = port.seen().value * step_deg
        doubt_deg = stimulus.tolerance_deg
        judge_angle(verdict, what, slope, shown_deg, tilt_deg, step_deg, doubt_deg)


@requirement(
    "DEV-33",
    level="manual",
    cases=slopes(_is_a_turn),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_slope_stays_within_its_turn(
    node: Node, slope: MeasuredSlope, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """Turned further than once round, a slope without offset shows angles of the documented turn alone."""
    port = upright_port_of(node, slope, in_force, verdict)
    if port.offset or port.differential:
        raise SetupRefused("the node has an offset, which may take the slope beyond its range")
    step_deg = port.step_deg
    first, last = _ranges(node.spec, slope)[0]

    shown = []
    angles = _angles(node.spec, slope, stimulus.tolerance_deg)
    for tilt_deg in (first - 90.0, *angles, last + 90.0):
        port.tilt(stimulus, tilt_deg)
        shown.append(port.seen().value * step_deg)

    found = list(_covered(node.spec, slope))
    margin_deg = STEPS * step_deg
    fitting = [
        other
        for (low, high), other in found
        if low - margin_deg <= min(shown) and max(shown) <= high + margin_deg
    ]
    words = dict.fromkeys(f"{low:g} deg to {high:g} deg" for (low, high), _ in found)
    verdict.holds(
        f"least and greatest value of {slope.entry.address}",
        expected=" or ".join(words),
        actual=f"{min(shown):.4g} deg to {max(shown):.4g} deg",
        ok=bool(fitting),
    )
    if fitting and fitting[0] is not None:
        verdict.follows(fitting[0].ambiguity, fitting[0].reading)
