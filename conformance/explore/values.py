"""Values for downloads: what makes the services of a device do something, and edges of ranges."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final

from conformance.checks import cases
from conformance.spec.model import DeviceSpec, Entry, Key
from conformance.wire.pdo import MappingEntry

NOT_VALID: Final = 1 << 31
NO_RTR: Final = 1 << 30
CAN_ID: Final = 0x7FF
PERIODS_MS: Final = (20, 50, 100, 250)
INHIBIT_MS: Final = (0, 30, 120)
TYPES: Final = (0, 1, 2, 3, 252, 253, 254, 255)
SENDING: Final = ((254, 50), (255, 20), (1, 0))
"""Transmission types and event times with which a TPDO comes."""
MOST_WORDS: Final = 4
MOST_NODES: Final = 0x7F
FREE_ID: Final = 0x10
"""Added to the CAN-ID of a TPDO to get another one of another node."""


class Values:
    """Values for the entries of a device.

    Args:
        spec: What the manual says.
        alone: No other node may use the CAN-IDs of the predefined connection set.
    """

    def __init__(self, spec: DeviceSpec, *, alone: bool) -> None:
        self._spec = spec
        self._alone = alone
        services = spec.services
        self._tpdo = services.tpdo
        self._cob_ids = {
            (it.object, 0)
            for it in (services.emcy_producer, services.sync_consumer)
            if it is not None and it.object is not None
        }
        self._periods: set[Key] = set()
        if services.heartbeat_producer is not None:
            self._periods.add((services.heartbeat_producer.object, 0))
        for number in range(self._tpdo.count if self._tpdo else 0):
            assert self._tpdo is not None
            self._cob_ids.add((self._tpdo.communication + number, 1))
            self._periods.add((self._tpdo.communication + number, 5))
        self._stores = {
            it.object: it for it in (services.store, services.restore) if it is not None
        }

    def heartbeat(self) -> Iterator[tuple[Key, bytes]]:
        """Return downloads that make the heartbeat producer do something."""
        heartbeat = self._spec.services.heartbeat_producer
        if heartbeat is not None:
            for ms in PERIODS_MS:
                yield from self._encoded((heartbeat.object, 0), max(ms, heartbeat.min_ms))
            yield from self._encoded((heartbeat.object, 0), heartbeat.off)

    def emcy(self) -> Iterator[list[tuple[Key, bytes]]]:
        """Return, per object, downloads that make the EMCY producer do something."""
        emcy = self._spec.services.emcy_producer
        if emcy is not None:
            yield list(self._cob_id((emcy.object, 0)))
            if emcy.inhibit is not None:
                yield [it for ms in INHIBIT_MS for it in self._encoded((emcy.inhibit, 0), ms * 10)]

    @property
    def tpdos(self) -> range:
        """The numbers of the TPDOs, the first of which is 0."""
        return range(self._tpdo.count if self._tpdo is not None else 0)

    def cob_id(self, number: int) -> list[tuple[Key, bytes]]:
        """Return downloads to the COB-ID of a TPDO: valid, not valid, and others."""
        assert self._tpdo is not None  # it has a number
        return list(self._cob_id((self._tpdo.communication + number, 1)))

    def communication(self, number: int) -> Iterator[list[tuple[Key, bytes]]]:
        """Return, per object, downloads that say when a TPDO is sent."""
        tpdo = self._tpdo
        assert tpdo is not None  # it has a number
        index = tpdo.communication + number
        types = [
            known
            for known in TYPES
            if any(int(low) <= known <= int(high) for low, high in tpdo.transmission_types)
        ]
        inhibits = [ms * 1000 // tpdo.inhibit_unit_us for ms in INHIBIT_MS]
        events = [max(ms, tpdo.min_cycle_ms or 0) if ms else 0 for ms in (0, *PERIODS_MS)]
        for sub, values in ((2, types), (3, inhibits), (5, events)):
            yield [it for value in values for it in self._encoded((index, sub), value)]

    def sending(self, number: int) -> Iterator[list[tuple[Key, bytes]]]:
        """Return downloads that together make a TPDO be sent."""
        tpdo = self._tpdo
        assert tpdo is not None  # it has a number
        index = tpdo.communication + number
        for kind, ms in SENDING:
            least = max(ms, tpdo.min_cycle_ms or 0) if ms else 0
            yield [*self._encoded((index, 2), kind), *self._encoded((index, 5), least)]

    def mapping(self, number: int) -> Iterator[list[tuple[Key, bytes]]]:
        """Return, per object, downloads that say what a TPDO carries; first the number of objects."""
        assert self._tpdo is not None  # it has a number
        index = self._tpdo.mapping + number
        for sub, values in ((0, [0, 1, 2]), (1, list(self._words())), (2, list(self._words()))):
            yield [it for value in values for it in self._encoded((index, sub), value)]

    @property
    def stores(self) -> Collection[int]:
        """The objects that store and restore."""
        return self._stores

    def legal(self, entry: Entry) -> Iterator[tuple[Key, bytes]]:
        """Return downloads that an entry takes, as far as they leave the node usable."""
        store = self._stores.get(entry.index)
        if store is not None:
            if entry.sub in store.groups:
                yield entry.key, entry.type.encode(store.word)
        elif entry.key in self._cob_ids or entry.key in self._periods or not entry.type.is_integer:
            return  # the services have these
        elif not cases.is_mapping(entry, self._spec):
            for value in dict.fromkeys(self._plain(entry)):
                if value not in entry.leaves_canopen:
                    yield entry.key, entry.type.encode(value)

    def _plain(self, entry: Entry) -> Iterator[int]:
        if isinstance(entry.default, int):
            yield entry.default
        if entry.legal is None and entry.limits_by is None:
            yield from (0, 1)
            return
        for limit in cases.limits(entry):
            yield from cases.legal_values(limit)
        for low, high in entry.legal or ():
            yield (low + high) // 2

    def illegal(self, entry: Entry) -> Iterator[bytes]:
        """Return data that a writable entry must refuse."""
        if entry.type.is_integer:
            if entry.index in self._stores:
                yield entry.type.encode(0x12345678 & entry.type.maximum)
            elif entry.legal is not None or entry.limits_by is not None:
                per_limit = [set(cases.illegal_values(entry, it)) for it in cases.limits(entry)]
                for value in sorted(set.intersection(*per_limit)) if per_limit else ():
                    if value not in entry.leaves_canopen:
                        yield entry.type.encode(value)
        if entry.type.size is not None:
            data = (
                entry.type.encode(entry.default)
                if isinstance(entry.default, int)
                else bytes(entry.type.size)
            )
            yield data + b"\0"
            if len(data) > 1:
                yield data[:-1]

    def unwritable(self, entry: Entry) -> Iterator[bytes]:
        """Return data for an entry that no download may change."""
        if not entry.writable and not entry.reserved and entry.type.size is not None:
            yield bytes(entry.type.size)

    def tpdo_ids(self) -> Iterator[int]:
        """Return the CAN-IDs that TPDOs may have."""
        for number in range(self._tpdo.count if self._tpdo else 0):
            assert self._tpdo is not None
            for _, data in self._cob_id((self._tpdo.communication + number, 1)):
                yield int.from_bytes(data, "little") & CAN_ID

    def _cob_id(self, key: Key) -> Iterator[tuple[Key, bytes]]:
        entry = self._spec.entry(*key)
        if entry is None or not isinstance(entry.default, int):
            return
        word = entry.default & ~NOT_VALID
        yield from self._encoded(key, word)
        yield from self._encoded(key, word | NOT_VALID)
        yield from self._encoded(key, word ^ NO_RTR)
        if self._alone and (word & MOST_NODES) + FREE_ID <= MOST_NODES:
            yield from self._encoded(key, word + FREE_ID)

    def _words(self) -> Iterator[int]:
        mappable = [it for it in self._spec.entries.values() if it.mappable and it.type.bits]
        for entry in mappable[:MOST_WORDS]:
            yield MappingEntry(entry.index, entry.sub, entry.type.bits or 0).to_word()

    def _encoded(self, key: Key, value: int) -> Iterator[tuple[Key, bytes]]:
        entry = self._spec.entry(*key)
        if entry is not None and entry.type.is_integer:
            yield key, entry.type.encode(min(value, entry.type.maximum))
