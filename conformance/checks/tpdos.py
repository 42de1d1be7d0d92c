"""TPDOs as several checks need them: which a device has, and their set-up (CiA 301 v4.2.0, 7.2.2)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node import Node
from conformance.bench.tpdo import TpdoPort
from conformance.checks import cases
from conformance.checks.steps import COB_ID_SUB, tpdo_service
from conformance.errors import SetupRefused
from conformance.requirements import Case
from conformance.spec.model import DeviceSpec, Entry, address

EVENT_MS = 50
NOT_VALID = 1 << 31
MOST_TRIED = 4


def tpdos(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs that are not documented as disabled for good, by their number."""
    tpdo = spec.services.tpdo
    if tpdo is not None:
        for number in range(1, tpdo.count + 1):
            index = tpdo.communication + number - 1
            parameter = spec.entry(index, COB_ID_SUB)
            if parameter is None or not _always_off(parameter):
                section = parameter.source if parameter is not None else tpdo.source
                yield Case(address(index), number, section)


def _always_off(cob_id: Entry) -> bool:
    """Tell whether a TPDO is documented as disabled and cannot be enabled."""
    off = isinstance(cob_id.default, int) and bool(cob_id.default & NOT_VALID)
    return off and not cob_id.writable


def disablable(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs whose COB-ID can be written."""
    for case in tpdos(spec):
        tpdo = spec.services.tpdo
        entry = tpdo and spec.entry(tpdo.communication + case.subject - 1, COB_ID_SUB)
        if entry and entry.writable:
            yield case


def port_of(node: Node, number: int) -> TpdoPort:
    """Return a TPDO of the node."""
    return TpdoPort(node, tpdo_service(node), number)


def others_off(node: Node, number: int) -> None:
    """Disable the TPDOs that are not tried, so that they do not load the bus."""
    for other in range(1, tpdo_service(node).count + 1):
        if other != number:
            port_of(node, other).disable()


def mappable_entries(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what every reading of the manual lets be mapped, with the same type."""
    bits = entry.type.bits is not None and entry.type.is_integer
    mappable = bool(entry.mappable) and not entry.optional
    return spec.services.tpdo is not None and bits and mappable and cases.same_type(entry)


def mappable(node: Node) -> list[Entry]:
    """Return the entries that can surely be mapped.

    Raises:
        SetupRefused: The manual has none.
    """
    found = [
        entry
        for entry in node.spec.entries.values()
        if all(mappable_entries(reading, node.spec) for reading in entry.readings)
    ]
    if not found:
        raise SetupRefused("the manual documents no mappable object")
    return found


def set_up(node: Node, port: TpdoPort, transmission_type: int, event_ms: int = 0) -> None:
    """Configure a TPDO with the first object that the node lets be mapped, if any can be."""
    if not port.can_be_mapped or port.fixed_mapping() is not None:
        port.configure(transmission_type, event_ms=event_ms)
        return
    for entry in mappable(node)[:MOST_TRIED]:
        try:
            port.configure(transmission_type, event_ms=event_ms, mapped=[entry])
        except SetupRefused as error:
            refused = error
        else:
            return
    raise refused
