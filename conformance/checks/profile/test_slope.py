"""Slopes: inversion, scaling, differential offset, preset and offset (CiA 410)."""

from __future__ import annotations

from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.in_force import InForce
from conformance.checks.profile.shown import (
    Outcome,
    confirmed,
    is_same,
    judge,
    margin_of,
    turn_steps,
)
from conformance.checks.profile.slope_ports import plain_port_of, seen_with
from conformance.checks.profile.slopes import (
    MeasuredSlope,
    having,
    idle_offsets,
    offset_writable,
    operating_parameter,
    possible,
    slopes,
    targets,
)
from conformance.errors import SetupRefused
from conformance.requirements import requirement
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict

TILT_SHARE = 0.4
SHIFT_SHARE = 0.25


@requirement(
    "DEV-08",
    level="manual",
    cases=slopes(having("operating_parameter", "inversion")),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_inversion_changes_the_sign(
    node: Node, slope: MeasuredSlope, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """With the inversion set a slope has the other sign."""
    port = plain_port_of(node, slope, in_force, verdict)
    port.tilt(stimulus, slope.at(TILT_SHARE))
    before, offsets = port.seen(), port.offset

    port.invert(on=True)

    shown = {"measured": 2 * offsets - before.value, "sum": -before.value}
    inverts = possible(node.spec, slope, "inverts")
    outcomes = [Outcome(shown[what], (other,)) for what, other in inverts.items()]
    turn = turn_steps(slope, port.step_deg)
    as_before = partial(is_same, before, turn)
    parameter = operating_parameter(node.spec, slope.rule)
    after = seen_with(node, port, parameter, in_force, verdict, as_before)
    judge(
        verdict, f"{slope.entry.address} inverted", after, outcomes, before=before, turn_steps=turn
    )


def _is_plain_unscaled(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
    """Pick the slopes of which every reading says what they show with scaling off."""
    needed = having("operating_parameter", "scaling", "differential_offset")(slope, spec)
    return needed and "own-steps" not in possible(spec, slope, "unscaled")


@requirement(
    "DEV-09",
    level="manual",
    cases=slopes(_is_plain_unscaled),
    effects=("reads", "writes"),
)
def test_offsets_count_with_scaling_only(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """With scaling off a slope shows the measured angle without its offsets."""
    port = plain_port_of(node, slope, in_force, verdict)
    plain, offsets = port.seen(), port.offset
    step_deg = port.step_deg
    port.shift(_shift(slope, plain.value, step_deg))
    before = port.seen()

    port.scale(on=False)

    shown = {"measured": plain.value - offsets, "with-offsets": before.value}
    unscaled = possible(node.spec, slope, "unscaled")
    outcomes = [Outcome(shown[what], (other,)) for what, other in unscaled.items()]
    turn = turn_steps(slope, step_deg)
    as_before = partial(is_same, before, turn)
    parameter = operating_parameter(node.spec, slope.rule)
    after = seen_with(node, port, parameter, in_force, verdict, as_before)
    judge(
        verdict, f"{slope.entry.address} unscaled", after, outcomes, before=before, turn_steps=turn
    )


def _shift(slope: MeasuredSlope, shown: int, step_deg: float) -> int:
    """Return a differential offset in steps that leaves the slope inside its range."""
    middle = (slope.low_deg + slope.high_deg) / 2 / step_deg
    steps = round(SHIFT_SHARE * slope.high_deg / step_deg)
    return steps if shown <= middle else -steps


@requirement(
    "DEV-10",
    level="manual",
    cases=slopes(having("differential_offset")),
    effects=("reads", "writes"),
)
def test_differential_offset_shifts_the_slope(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """A differential offset shifts the slope by its value, and leaves the offset alone."""
    port = plain_port_of(node, slope, in_force, verdict)
    before, offset = port.seen(), port.offset
    step_deg = port.step_deg

    for target in targets(slope, step_deg):
        shift = target - before.value
        transfer = port.write("differential_offset", shift)
        confirmed(verdict, f"differential offset of {shift}", transfer)
        judge(
            verdict,
            f"{slope.entry.address}, shifted by {shift}",
            port.seen(),
            [Outcome(target)],
            before=before,
            turn_steps=turn_steps(slope, step_deg),
        )
        verdict.equal("offset", port.offset, offset)


@requirement(
    "DEV-11",
    level="manual",
    cases=slopes(having("preset")),
    effects=("reads", "writes"),
)
def test_preset_sets_the_slope(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """A preset makes the slope show it at that instant."""
    port = plain_port_of(node, slope, in_force, verdict)
    step_deg = port.step_deg

    for preset in targets(slope, step_deg):
        confirmed(verdict, f"preset of {preset}", port.write("preset", preset))
        judge(
            verdict,
            f"{slope.entry.address} after a preset of {preset}",
            port.seen(),
            [Outcome(preset)],
            turn_steps=turn_steps(slope, step_deg),
        )


@requirement(
    "DEV-12",
    level="manual",
    cases=slopes(having("preset", "differential_offset")),
    effects=("reads", "writes"),
)
def test_preset_with_a_differential_offset(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """A preset takes a differential offset into account as documented."""
    port = plain_port_of(node, slope, in_force, verdict)
    step_deg = port.step_deg
    shift = _shift(slope, port.seen().value, step_deg)
    port.shift(shift)
    preset = targets(slope, step_deg)[1]

    confirmed(verdict, f"preset of {preset}", port.write("preset", preset))

    shown = {"measured": preset + shift, "measured-and-differential": preset}
    subtracts = possible(node.spec, slope, "preset_subtracts")
    judge(
        verdict,
        f"{slope.entry.address} after a preset of {preset} with a differential offset of {shift}",
        port.seen(),
        [Outcome(shown[what], (other,)) for what, other in subtracts.items()],
        turn_steps=turn_steps(slope, step_deg),
    )


@requirement(
    "DEV-13",
    level="manual",
    cases=slopes(having("preset", "offset")),
    effects=("reads", "writes"),
)
def test_offset_is_preset_less_measured(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """After a preset the offset is the preset less the measured angle, as documented."""
    port = plain_port_of(node, slope, in_force, verdict)
    step_deg = port.step_deg
    before = port.seen()
    measured = before.value - port.offset
    shift = 0
    if slope.rule is not None and slope.rule.differential_offset is not None:
        shift = _shift(slope, before.value, step_deg)
        port.shift(shift)

    for preset in targets(slope, step_deg):
        confirmed(verdict, f"preset of {preset}", port.write("preset", preset))
        shown = {
            "measured": preset - measured,
            "measured-and-differential": preset - measured - shift,
        }
        subtracts = possible(node.spec, slope, "preset_subtracts")
        judge(
            verdict,
            f"offset after a preset of {preset}",
            port.seen_offset(),
            [Outcome(shown[what], (other,)) for what, other in subtracts.items()],
            before=before,
            turn_steps=turn_steps(slope, step_deg),
        )


@requirement(
    "DEV-14",
    level="manual",
    cases=slopes(having("preset")),
    effects=("reads", "writes"),
)
def test_preset_is_read_back(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """After its download a preset reads as written, or 0, as documented."""
    port = plain_port_of(node, slope, in_force, verdict)
    preset = targets(slope, port.step_deg)[-1]

    confirmed(verdict, f"preset of {preset}", port.write("preset", preset))

    read = node.number(*key_of(port.rule_of("preset")))
    readings = possible(node.spec, slope, "preset_reads")
    allowed = {preset if what == "preset" else 0: other for what, other in readings.items()}
    verdict.one_of("preset read", read, list(allowed))
    if (other := allowed.get(read)) is not None:
        verdict.follows(other.ambiguity, other.reading)


@requirement(
    "DEV-15",
    level="manual",
    cases=slopes(offset_writable),
    effects=("reads", "writes"),
)
def test_written_offset_shifts_the_slope(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """An offset that is written shifts the slope by its change."""
    port = plain_port_of(node, slope, in_force, verdict)
    before, offset = port.seen(), port.offset
    step_deg = port.step_deg
    change = _shift(slope, before.value, step_deg)
    if abs(change) <= margin_of(before):
        raise SetupRefused("the resolution is too coarse for an offset to show")

    confirmed(verdict, f"offset of {offset + change}", port.write("offset", offset + change))

    outcomes = [
        Outcome(before.value + (change if sign == "added" else -change), (other,))
        for sign, other in possible(node.spec, slope, "offset_is").items()
    ]
    outcomes += [Outcome(before.value, (other,)) for other in idle_offsets(node.spec, slope)]
    judge(
        verdict,
        f"{slope.entry.address} with an offset changed by {change}",
        port.seen(),
        outcomes,
        before=before,
        turn_steps=turn_steps(slope, step_deg),
    )
