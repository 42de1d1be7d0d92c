"""TPDO content: what it carries, and what can be mapped into it (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from dataclasses import dataclass

from conformance.bench.node import Node
from conformance.bench.tpdo import TpdoPort
from conformance.checks import cases
from conformance.checks.steps import tpdo_service
from conformance.checks.tpdos import (
    is_number,
    listen,
    mappable,
    mappable_entries,
    paced,
    port_of,
    tpdos,
)
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire.datatypes import DataType, Value
from conformance.wire.nmt import NmtCommand
from conformance.wire.pdo import MappingEntry, unpack

MAPPING = f"{CIA301}, 7.5.2.38"
MOST_BITS = 64
SAMPLES = 5
NOISE = 2
"""Steps by which a measured value may move between two looks at it, for a REAL hundredths of it."""


@requirement(
    "TPDO-05",
    level="manual",
    cases=("number", tpdos),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_tpdo_carries_the_mapped_objects(node: Node, number: int, verdict: Verdict) -> None:
    """A TPDO carries the mapped objects' values, in the mapping's order."""
    port, pace = port_of(node, number), paced(node, number)
    fixed = port.fixed_mapping()
    if fixed is not None:
        verdict.follows(fixed.ambiguity, fixed.reading)
    writable = port.can_be_mapped and fixed is None
    mapped = _told_apart(node) if writable else _as_mapped(node, port)
    port.configure(
        pace.transmission_type,
        event_ms=pace.event_ms,
        mapped=[field.entry for field in mapped] if writable else (),
    )
    node.nmt(NmtCommand.START)

    seen = listen(node, port, pace)

    if not seen:
        raise SetupRefused("the TPDO does not come, see TPDO-01")
    data = seen[0].frame.data
    bits = [field.entry.type.bits or 0 for field in mapped]
    _judge_length(node.spec, len(data), (sum(bits) + 7) // 8, verdict)
    if len(data) * 8 < sum(bits):
        return
    for field, raw in zip(mapped, unpack(data[: (sum(bits) + 7) // 8], bits), strict=True):
        value = field.decode(raw)
        verdict.holds(
            f"{field.entry.address} in the TPDO",
            expected=field.expected,
            actual=str(value),
            ok=field.low <= value <= field.high,
        )


def _judge_length(spec: DeviceSpec, octets: int, mapped: int, verdict: Verdict) -> None:
    readings = {
        (services.tpdo.octets or mapped) if services.tpdo else mapped: other
        for services, other in spec.services_readings[::-1]
    }
    expected = " or ".join(str(length) for length in sorted(readings))
    verdict.holds("octets", expected=expected, actual=str(octets), ok=octets in readings)
    followed = readings.get(octets)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)


def _to_be_mapped(entry: Entry, spec: DeviceSpec) -> bool:
    tpdo = spec.services.tpdo
    place = tpdo and spec.entry(tpdo.mapping, 1)
    return bool(place and place.writable) and mappable_entries(entry, spec)


@requirement(
    "TPDO-06",
    level="manual",
    cases=cases.entries(_to_be_mapped, "mappable"),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_mappable_object_is_mapped(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An object documented as mappable can be mapped into a TPDO by the documented procedure."""
    tpdo = tpdo_service(node)
    port = port_of(node, 1)
    node.upload(entry.index, entry.sub)
    fixed = port.fixed_mapping()
    if fixed is not None:
        verdict.follows(fixed.ambiguity, fixed.reading)
        verdict.holds("mapping", expected="writable, or fixed", actual="fixed", ok=True)
        return
    port.disable()
    node.download(tpdo.mapping, 0, 0)
    word = MappingEntry(entry.index, entry.sub, entry.type.bits or 0).to_word()

    mapped = node.try_download(tpdo.mapping, 1, DataType.UNSIGNED32.encode(word))
    verdict.holds(
        f"download of {word:08X}h to {address(tpdo.mapping, 1)}",
        expected="confirmed",
        actual=str(mapped),
        ok=mapped.confirmed,
    )
    if mapped.confirmed:
        counted = node.try_download(tpdo.mapping, 0, DataType.UNSIGNED8.encode(1))
        verdict.holds(
            f"download of 1 to {address(tpdo.mapping, 0)}",
            expected="confirmed",
            actual=str(counted),
            ok=counted.confirmed,
        )


@dataclass(frozen=True, slots=True)
class Held:
    """A mapped entry and between which values it was seen.

    Args:
        entry: An entry that holds a number.
        low: Least value a TPDO may carry.
        high: Greatest value a TPDO may carry.
    """

    entry: Entry
    low: float
    high: float

    @property
    def expected(self) -> str:
        """The values in words."""
        return f"{self.low}" if self.low == self.high else f"{self.low} to {self.high}"

    def decode(self, raw: int) -> float:
        """Return the field of a TPDO as a number of the entry's type."""
        size = self.entry.type.size or 0
        return _as_number(self.entry.type.decode(raw.to_bytes(size, "little")))


def _told_apart(node: Node) -> list[Held]:
    """Mappable entries that fit one TPDO and hold different values, so that their order shows.

    What is no whole octet comes last, so that all others begin with an octet.
    """
    chosen: list[Held] = []
    found = mappable(node)
    most = tpdo_service(node).max_mapped
    most_bits = MOST_BITS - 8 if _may_be_filled_up(node.spec) else MOST_BITS  # so filling shows
    for entry in sorted(found, key=lambda entry: ((entry.type.bits or 0) % 8 > 0, -entry.index)):
        bits = sum(field.entry.type.bits or 0 for field in chosen) + (entry.type.bits or 0)
        if bits > most_bits or len(chosen) == most:
            continue
        try:
            held = _held(node, entry)
        except SetupRefused:
            continue
        if all(held.high < other.low or other.high < held.low for other in chosen):
            chosen.append(held)
    if len(chosen) < min(2, most, len(found)):
        raise SetupRefused("the mappable objects all hold one value, so their order cannot be seen")
    return chosen


def _may_be_filled_up(spec: DeviceSpec) -> bool:
    """Tell whether a TPDO is longer than its mapped objects under some reading of the manual."""
    tpdos = (services.tpdo for services, _ in spec.services_readings)
    return any(tpdo is not None and tpdo.octets is not None for tpdo in tpdos)


def _as_mapped(node: Node, port: TpdoPort) -> list[Held]:
    """The entries of a mapping that cannot be written."""
    entries = [node.spec.entry(word.index, word.sub) for word in port.mapping()]
    found = [entry for entry in entries if entry is not None]
    if len(found) < len(entries) or not found:
        raise SetupRefused("the mapping names an object that the manual does not document")
    for entry in found:
        if not is_number(entry):
            raise SetupRefused(f"{entry.address} is mapped and holds no number ({entry.type.name})")
    return [_held(node, entry) for entry in found]


def _held(node: Node, entry: Entry) -> Held:
    """Watch an entry; a measured value may move on by as much as it was seen to, and a little."""
    values = [_as_number(node.value(entry.index, entry.sub)) for _ in range(SAMPLES)]
    low, high = min(values), max(values)
    step = 1 if entry.type.is_integer else max(abs(low), abs(high)) / 100
    margin = high - low + NOISE * step if entry.kind == "live" else 0
    return Held(entry, low - margin, high + margin)


def _as_number(value: Value) -> float:
    if not isinstance(value, int | float):
        raise SetupRefused(f"expected a number, got {value!r}")
    return value
