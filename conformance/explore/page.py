"""What an exploration found, as text."""

from __future__ import annotations

from collections.abc import Iterator

from conformance.explore.exploration import Explored
from conformance.explore.shortest import Finding
from conformance.explore.steps import shell, words
from conformance.spec.model import DeviceSpec


def to_text(explored: Explored) -> str:
    """Return what was found, for people: steps in words, then as a script with can-utils."""
    return "\n".join(_lines(explored)) + "\n"


def _lines(explored: Explored) -> Iterator[str]:
    spec = explored.spec
    device = " ".join(it for it in (spec.name, spec.variant, f"node {spec.node_id}") if it)
    yield f"{device}: {explored.steps} steps in {explored.sequences} sequences, seed {explored.seed}"
    for name, number in explored.readings.items():
        ambiguity = next(it for it in spec.ambiguities if it.id == name)
        yield f"the device follows reading {number} of {name}: {ambiguity.readings[number - 1].says}"
    if explored.finding is None:
        yield "no difference from what the manual says"
    else:
        yield from _finding(explored.finding, spec)


def _finding(finding: Finding, spec: DeviceSpec) -> Iterator[str]:
    difference = finding.difference
    yield f"difference: {difference.quantity}"
    yield f"  expected  {difference.expected}"
    yield f"  actual    {difference.actual}"
    yield "  after switching on:"
    for number, step in enumerate(finding.steps, start=1):
        yield f"  {number:2}. {words(step, spec)}"
    yield "  in a shell:"
    for step in finding.steps:
        yield from (f"      {line}" for line in shell(step, spec.node_id))
