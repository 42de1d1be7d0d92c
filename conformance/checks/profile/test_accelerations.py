"""Accelerations whose unit no manual prints: gravity shows that they are those of three axes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from conformance.bench.node.node import Node
from conformance.bench.sensor.slope import watch
from conformance.bench.sensor.stimulus import Stimulus
from conformance.checks import cases
from conformance.checks.limits import GRAVITY_G
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict

TILTED_DEG: Final = 40.0
TOLERANCE_DEG: Final = 10.0
"""Sensor elements that nobody has adjusted are off by a tenth of gravity."""


@dataclass(frozen=True, slots=True)
class Triple:
    """The accelerations along X, Y and Z, and the axes about which tilting is shown elsewhere."""

    entries: tuple[Entry, Entry, Entry]
    axes: tuple[str, ...]


def _without_unit(spec: DeviceSpec) -> Iterable[Case]:
    shown = {entry.follows for entry in spec.entries.values() if cases.readable(entry, spec)}
    axes = tuple(axis for axis in "xy" if f"tilt-{axis}" in shown)
    for x, y, z in cases.accelerations(spec):
        if x.unit is None:
            yield Case(x.address, Triple((x, y, z), axes), x.source)


@requirement("DEV-36", level="manual", cases=("triple", _without_unit), needs=("tilt",))
def test_accelerations_turn_with_the_device(
    node: Node, triple: Triple, stimulus: Stimulus, verdict: Verdict
) -> None:
    """Accelerations turn by the tilt without a change of size, and not along the axis left alone."""
    for axis in triple.axes:
        other = 1 - "xy".index(axis)
        seen = []
        for tilt_deg in (-TILTED_DEG, TILTED_DEG):
            stimulus.tilt(*(tilt_deg if it == axis else 0.0 for it in "xy"))
            seen.append([float(watch(node, entry.key).value) for entry in triple.entries])

        before, after = seen
        size = math.hypot(*before)
        quantity = f"by a tilt of {axis.upper()}"
        verdict.at_least("size of the acceleration", size, 1.0, unit="steps")
        verdict.within(
            "size afterwards", [math.hypot(*after)], size, GRAVITY_G * size, unit="steps"
        )
        verdict.within(
            f"turn {quantity}",
            [_angle_deg(before, after)],
            2 * TILTED_DEG,
            TOLERANCE_DEG,
            unit="deg",
            doubt=3 * stimulus.tolerance_deg,  # two tilts, of which both axes may be off
        )
        if len(triple.axes) > 1:  # the one axis of a sensor may be any of the three
            change = abs(after[other] - before[other])
            name = f"change along {'XY'[other]} {quantity}"
            doubt = 2 * size * math.sin(math.radians(stimulus.tolerance_deg))
            verdict.at_most(name, change, GRAVITY_G * size, unit="steps", doubt=doubt)


def _angle_deg(one: list[float], other: list[float]) -> float:
    """Return the angle between two vectors; 0 where one is nothing."""
    size = math.hypot(*one) * math.hypot(*other)
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / size if size else 1.0
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
