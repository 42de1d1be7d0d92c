"""The resolution of slopes and their offsets (CiA 410): its unit, and what a new one does to them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.sensor.slope import Seen
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.in_force import InForce
from conformance.checks import cases
from conformance.checks.profile.shown import confirmed, is_same, margin_of, within_a_turn
from conformance.checks.profile.slope_ports import plain_port_of, seen_with
from conformance.checks.profile.slopes import (
    MeasuredSlope,
    having,
    measured_slopes,
    operating_parameter,
    possible,
    targets,
)
from conformance.checks.waiting import at_need, require_writable_now
from conformance.numbers import figure
from conformance.requirements import Case, requirement
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict

TILT_SHARE = 0.4
TYPE_SHARE = 0.5
"""How much of its type a slope may fill, so that offsets have room beside the angle."""


@dataclass(frozen=True, slots=True)
class NewResolution:
    """A slope and a resolution to give it."""

    slope: MeasuredSlope
    entry: Entry
    value: int


def _resolutions(spec: DeviceSpec) -> Iterable[Case]:
    for slope in measured_slopes(spec):
        if not having("resolution")(slope, spec) or slope.rule is None:
            continue
        entry = spec.entries[key_of(slope.rule.resolution or 0)]
        for value in entry.values or ():
            if entry.always_legal(value):
                new = NewResolution(slope, entry, value)
                label = f"{slope.entry.address}/{value}"
                waits = at_need(entry, operating_parameter(spec, slope.rule))
                yield Case(label, new, entry.source_of("values"), at_need=waits)


@requirement(
    "DEV-16",
    level="manual",
    cases=("new", _resolutions),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_slope_counts_in_the_resolution(
    node: Node, new: NewResolution, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """With each documented resolution the slope and its offsets count in its unit, at the same tilt."""
    port = plain_port_of(node, new.slope, in_force, verdict)
    require_writable_now(node, new.entry, in_force, verdict)
    before_deg = port.step_deg
    most_deg = new.slope.entry.type.maximum * TYPE_SHARE * _unit_deg(new, before_deg, node)
    port.tilt(stimulus, min(new.slope.at(TILT_SHARE), most_deg))
    before, offsets = port.seen(), port.offset + port.differential

    data = new.entry.type.encode(new.value)
    transfer = node.try_download(new.entry.index, new.entry.sub, data)

    confirmed(verdict, f"download of {new.value} to {new.entry.address}", transfer)
    as_before = partial(is_same, before, 0.0)
    new_deg = port.step_deg != before_deg
    after = (
        seen_with(node, port, new.entry, in_force, verdict, as_before) if new_deg else port.seen()
    )
    after_deg = port.step_deg
    wanted_deg = (before.value - offsets) * before_deg
    measured_deg = (after.value - port.offset - port.differential) * after_deg
    verdict.within(
        f"measured angle with {new.entry.address} = {new.value}",
        [within_a_turn(new.slope, measured_deg, wanted_deg)],
        wanted_deg,
        (margin_of(before) * before_deg) + (margin_of(after) * after_deg),
        unit="deg",
    )


def _unit_deg(new: NewResolution, before_deg: float, node: Node) -> float:
    """Return the finer of the units before and after."""
    present = node.number(new.entry.index, new.entry.sub)
    return min(before_deg, before_deg * new.value / present)


def _changed_slopes(spec: DeviceSpec) -> Iterable[Case]:
    picks = having("resolution", "preset", "offset", "differential_offset")
    for slope in measured_slopes(spec):
        if picks(slope, spec) and slope.rule is not None:
            entry = spec.entries[key_of(slope.rule.resolution or 0)]
            coarsest = max(entry.values or (0,))
            if coarsest and cases.same_type(entry):
                new = NewResolution(slope, entry, coarsest)
                waits = at_need(entry, operating_parameter(spec, slope.rule))
                yield Case(slope.entry.address, new, entry.source, at_need=waits)


@requirement(
    "DEV-17",
    level="manual",
    cases=("new", _changed_slopes),
    effects=("reads", "writes"),
    needs=("tilt",),
)
def test_new_resolution_and_the_offsets(
    node: Node, new: NewResolution, stimulus: Stimulus, in_force: InForce, verdict: Verdict
) -> None:
    """A new resolution deletes, keeps or converts the offsets as documented."""
    port = plain_port_of(node, new.slope, in_force, verdict)
    require_writable_now(node, new.entry, in_force, verdict)
    port.tilt(stimulus, new.slope.at(TILT_SHARE))
    before_deg = port.step_deg
    wanted = targets(new.slope, before_deg)
    port.set_up("preset", wanted[0])
    port.shift(wanted[-1])
    before, offset, shift = port.seen(), port.offset, port.differential

    value = _other_value(node, new)
    node.download(new.entry.index, new.entry.sub, value)

    def goes_on(seen: Seen) -> bool:
        return (port.offset, port.differential) == (offset, shift) and is_same(before, 0.0, seen)

    after_deg = port.step_deg
    seen_with(node, port, new.entry, in_force, verdict, goes_on)
    held = {
        "keeps-numbers": (offset, shift),
        "keeps-angles": (offset * before_deg / after_deg, shift * before_deg / after_deg),
        "deletes-all": (0, 0),
        "deletes-offset": (0, shift),
    }
    got = (port.offset, port.differential)
    changes = possible(node.spec, new.slope, "resolution_change")
    fitting = [
        other
        for what, other in changes.items()
        if all(abs(a - b) <= 1 for a, b in zip(got, held[what], strict=True))
    ]
    verdict.holds(
        f"offset and differential offset with {new.entry.address} = {value}",
        expected=" or ".join(
            f"{figure(a, 4)} and {figure(b, 4)}" for a, b in (held[what] for what in changes)
        ),
        actual=f"{got[0]} and {got[1]}",
        ok=bool(fitting),
    )
    if fitting and fitting[0] is not None:
        verdict.follows(fitting[0].ambiguity, fitting[0].reading)


def _other_value(node: Node, new: NewResolution) -> int:
    """Return the resolution to write, or the next one where the node has that already."""
    if node.number(new.entry.index, new.entry.sub) != new.value:
        return new.value
    return max(value for value in new.entry.values or () if value != new.value)
