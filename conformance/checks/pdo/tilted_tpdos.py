"""TPDOs that carry what changes with the tilt, so that a check can change it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort
from conformance.checks.pdo.tpdos import mappable_entries, tpdos
from conformance.checks.profile.slopes import AXES
from conformance.checks.steps import tpdo_service
from conformance.errors import SetupRefused
from conformance.requirements import Case
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.wire.pdo import MappingEntry, unpack


def tilted(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs into which a slope can be mapped, or is by a mapping that is fixed."""
    tpdo = spec.services.tpdo
    if tpdo is not None:
        for case in tpdos(spec):
            mapping = tpdo.mapping + case.subject - 1
            first = spec.entry(mapping, 1)
            free = first is not None and first.writable and any(_slopes(spec))
            if free or any(_as_delivered(spec, mapping)):
                yield case


def is_slope(entry: Entry) -> bool:
    """Tell whether an entry shows a tilt in whole steps."""
    return entry.follows in AXES and entry.type.is_integer


def carry_the_tilt(node: Node, port: TpdoPort, transmission_type: int, event_ms: int = 0) -> None:
    """Configure a TPDO so that it carries a slope.

    Raises:
        SetupRefused: It cannot.
    """
    order = tpdo_service(node).byte_order
    if order is not None and node.number(order.object) == order.big_endian:
        raise SetupRefused(f"{address(order.object)} has the high octets first, see DEV-26")
    free = port.can_be_mapped and port.fixed_mapping() is None
    slopes = list(_slopes(node.spec))[:1] if free else []
    port.configure(transmission_type, event_ms=event_ms, mapped=slopes)
    if not any(is_slope(entry) for entry in mapped_entries(node, port)):
        raise SetupRefused("no slope is mapped, so that a tilt would not show")


def mapped_entries(node: Node, port: TpdoPort) -> list[Entry]:
    """Return the entries that a TPDO carries, by the mapping that the node holds.

    Raises:
        SetupRefused: The manual does not document one of them.
    """
    found = [node.spec.entry(word.index, word.sub) for word in port.mapping()]
    entries = [entry for entry in found if entry is not None]
    if len(entries) < len(found):
        raise SetupRefused("the mapping names an object that the manual does not document")
    return entries


def slopes_in(data: bytes, entries: list[Entry]) -> dict[str, int]:
    """Return the slopes in a TPDO by their address; none where it is too short for its mapping."""
    bits = [entry.type.bits or 0 for entry in entries]
    if sum(bits) > 8 * len(data):
        return {}
    return {
        entry.address: int(entry.type.decode(raw.to_bytes(entry.type.size or 0, "little")))
        for entry, raw in zip(entries, unpack(data, bits), strict=True)
        if is_slope(entry)
    }


def _slopes(spec: DeviceSpec) -> Iterator[Entry]:
    """Return the slopes that every reading lets be mapped."""
    for entry in spec.entries.values():
        mappable = all(mappable_entries(reading, spec) for reading in entry.readings)
        if is_slope(entry) and mappable:
            yield entry


def _as_delivered(spec: DeviceSpec, mapping: int) -> Iterator[Entry]:
    """Return the slopes that a TPDO carries as delivered."""
    tpdo = spec.services.tpdo
    for place in range(1, tpdo.max_mapped + 1 if tpdo is not None else 1):
        word = spec.entry(mapping, place)
        if word is not None and isinstance(word.default, int):
            mapped = MappingEntry.from_word(word.default)
            entry = spec.entry(mapped.index, mapped.sub)
            if entry is not None and is_slope(entry):
                yield entry
