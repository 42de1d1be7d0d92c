"""EMCY: the object that holds the manufacturer's error code (CiA 301 v4.2.0, 7.2.7.3.1)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict


def _manufacturer_codes(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.emcy_producer
    place = producer.manufacturer_code if producer is not None else None
    entry = spec.entry(place.object) if place is not None else None
    if entry is not None and _documented_by_all(entry):
        yield Case(entry.address, entry, entry.source_of("bits"))


def _documented_by_all(entry: Entry) -> set[int]:
    """Return the bits that stand for an error by every reading."""
    return set.intersection(*(set(reading.bits or ()) for reading in entry.readings))


@requirement(
    "EMCY-36",
    level="manual",
    cases=("entry", _manufacturer_codes),
    effects=("reads", "resets"),
    needs=("tilt",),
)
def test_manufacturers_code_without_an_error(
    node: Node, entry: Entry, stimulus: Stimulus, verdict: Verdict
) -> None:
    """Without an error no documented bit of the manufacturer's error code is set after a start."""
    stimulus.tilt(0.0, 0.0)
    node.reset()

    code = node.number(*entry.key)

    bits = sorted(_documented_by_all(entry))
    verdict.holds(
        f"value of {entry.address}",
        expected=f"bits {', '.join(map(str, bits))} clear",
        actual=f"{code:02X}h",
        ok=not any(code >> bit & 1 for bit in bits),
    )
