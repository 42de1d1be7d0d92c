"""TPDO content: what it carries, and what can be mapped into it (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort
from conformance.checks import cases
from conformance.checks.dictionary.held import Held, held, judge_content
from conformance.checks.pdo.tpdos import (
    is_number,
    listen,
    mappable,
    mappable_entries,
    paced,
    port_of,
    tpdos,
)
from conformance.checks.steps import tpdo_service
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire.datatypes import DataType
from conformance.wire.nmt import NmtCommand
from conformance.wire.pdo import MappingEntry

MAPPING = f"{CIA301}, 7.5.2.38"
MOST_BITS = 64


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
    judge_content(node.spec, verdict, seen[0].frame.data, mapped)


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


def _told_apart(node: Node) -> list[Held]:
    """Mappable entries that fit one TPDO and hold different values, so that their order shows.

    What is no whole octet comes last, so that all others begin with an octet.
    """
    chosen: list[Held] = []
    found = mappable(node)
    most = tpdo_service(node).max_mapped
    most_bits = MOST_BITS - 8 if _may_be_filled_up(node.spec) else MOST_BITS  # so filling shows
    for entry in sorted(found, key=lambda entry: ((entry.type.bits or 0) % 8 > 0, -entry.index)):
        bits = sum(other.entry.type.bits or 0 for other in chosen) + (entry.type.bits or 0)
        if bits > most_bits or len(chosen) == most:
            continue
        try:
            field = held(node, entry)
        except SetupRefused:
            continue
        if all(field.high < other.low or other.high < field.low for other in chosen):
            chosen.append(field)
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
    return [held(node, entry) for entry in found]
