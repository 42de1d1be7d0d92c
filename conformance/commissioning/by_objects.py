"""Gives a sensor its place by its objects, where it is the only one of its node-ID on the bus."""

from __future__ import annotations

from collections.abc import Iterator

from conformance.bench.node.reach import AT_ONCE_S, Place
from conformance.bench.session import Bench
from conformance.commissioning.giving import NotSelected, serial_of
from conformance.commissioning.record import Unit
from conformance.spec.bit_rates import documented_rates
from conformance.spec.document import Changeable
from conformance.spec.model import DeviceSpec, Entry, is_legal


class ByObjects:
    """SDO client that writes node-ID and bit rate.

    Args:
        bench: The open bench.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    @staticmethod
    def can(spec: DeviceSpec) -> bool:
        """Tell whether a device documents an object that takes a node-ID."""
        return _entry(spec, spec.services.node_id) is not None

    @staticmethod
    def rates(spec: DeviceSpec) -> list[int]:
        """Return the bit rates that can be given."""
        if _entry(spec, spec.services.bitrate) is None:
            return []
        return sorted(documented_rates(spec))

    def configure(self, unit: Unit, start: Place, to: Place, *, rate: bool) -> Place:
        """Write one sensor its place, and store it.

        Args:
            unit: The sensor.
            start: Where it is.
            to: Where it is to be.
            rate: Write the bit rate as well.

        Returns:
            Where it is now, before a restart.

        Raises:
            NotSelected: Another sensor is there.
            SetupRefused: It does not take a value.
            NodeTimeout: It does not answer.
        """
        bench = self._bench
        bench.reach.go(start)
        node = bench.node()
        serial = serial_of(node)
        if serial not in (None, unit.serial):
            raise NotSelected(f"{unit} is expected as {start}, but serial {serial} is there")
        indices = set()
        for service, value, next_place in _changes(bench.spec, start, to, rate=rate):
            entry = bench.spec.entries[service.object, 0]
            for key in bench.spec.companions(entry.key):
                bench.reach.write(node, (key,), entry.type.encode(value))
                bench.link.listen(AT_ONCE_S, lambda _: False)
                places = (bench.reach.here, next_place)
                at_once = service.effective == "at-once"
                bench.reach.find(node, *(reversed(places) if at_once else places))
                indices.add(key[0])
        node.save(indices)
        bench.done(node, doubtful=False)
        return bench.reach.here


def _changes(
    spec: DeviceSpec, start: Place, to: Place, *, rate: bool
) -> Iterator[tuple[Changeable, int, Place]]:
    """Return what is written where, and where the sensor may be at once after it."""
    node_id, bitrate = spec.services.node_id, spec.services.bitrate
    if node_id is not None and _entry(spec, node_id) is not None and to.node_id != start.node_id:
        yield node_id, to.node_id, Place(to.node_id, start.bitrate)
    if bitrate is not None and _entry(spec, bitrate) is not None and rate:
        yield bitrate, documented_rates(spec)[to.bitrate], to


def _entry(spec: DeviceSpec, service: Changeable | None) -> Entry | None:
    entry = None if service is None else spec.entry(service.object)
    return entry if entry is not None and entry.writable else None


def legal_node_ids(spec: DeviceSpec) -> list[int]:
    """Return the node-IDs that a device takes."""
    entry = _entry(spec, spec.services.node_id)
    return [it for it in range(1, 128) if entry is None or is_legal(it, entry.legal)]
