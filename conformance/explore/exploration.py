"""An exploration: search, make what was found short, try to explain it, go on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from conformance.errors import BenchError
from conformance.explore.choices import choices
from conformance.explore.explanation import explained
from conformance.explore.laboratory import Laboratory
from conformance.explore.search import search
from conformance.explore.shortest import Finding, Steps, shortest
from conformance.options import RunOptions
from conformance.spec.model import DeviceSpec


@dataclass(frozen=True, slots=True)
class Explored:
    """What an exploration has come to.

    Args:
        spec: What the device was held against.
        seed: Of the choice.
        steps: Taken.
        sequences: Begun.
        finding: The shortest sequence that shows a difference that no reading explains.
        readings: What explains the device, where not as judged.
    """

    spec: DeviceSpec
    seed: int
    steps: int
    sequences: int
    finding: Finding | None = None
    readings: Mapping[str, int] = field(default_factory=dict)


def explore(options: RunOptions, budget: int, trace: Path) -> Explored:
    """Take a device and the model of it through random steps.

    Args:
        options: What the user asked for, as of a run.
        budget: How many steps to take at most.
        trace: File for what was on the bus when a difference showed.

    Raises:
        SpecError: The input is wrong; nothing was opened or sent.
        BenchError: There is no device, or what was seen was not seen again.
    """
    laboratory = Laboratory(options)
    try:
        return _explore(laboratory, options.seed, budget, trace)
    finally:
        laboratory.close()


def _explore(laboratory: Laboratory, seed: int, budget: int, trace: Path) -> Explored:
    allowed = choices(laboratory.spec, laboratory.definition, as_made=laboratory.as_made)
    readings: Mapping[str, int] = {}
    shown: list[Steps] = []
    steps = sequences = 0
    while steps < budget:
        searched = search(laboratory, allowed, readings, budget - steps, seed + len(shown))
        steps += searched.steps
        sequences += searched.sequences
        if searched.finding is None:
            break
        finding = _shortened(laboratory, searched.finding, readings)
        explanation = explained(laboratory, readings, shown, finding)
        shown.append(finding.steps)
        if explanation is None:
            laboratory.replay(finding.steps, readings, trace)
            return Explored(laboratory.spec, seed, steps, sequences, finding, readings)
        readings = explanation
    return Explored(laboratory.spec, seed, steps, sequences, None, readings)


def _shortened(laboratory: Laboratory, finding: Finding, readings: Mapping[str, int]) -> Finding:
    short = shortest(finding, lambda steps: laboratory.replay(steps, readings))
    if short is None:
        what = finding.difference
        raise BenchError(
            f"{what.quantity}: expected {what.expected}, got {what.actual}; "
            "the same steps did not show it again"
        )
    return short
