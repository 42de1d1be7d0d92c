"""The node's settings as a whole: read, written in an order that it takes, and put back as they were."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache

from conformance.bench.node.keeping import groups_of
from conformance.bench.node.node import Node
from conformance.errors import NodeTimeout, SetupRefused
from conformance.interrupts import uninterrupted
from conformance.spec.behaviours import Slope
from conformance.spec.document import Tpdo
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry, Key, address

_PASSES = 5
_NOT_VALID = 1 << 31
_COB_ID_OCTETS = 4
Values = dict[Key, bytes]


def is_setting(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether an entry is a setting that does not say how the node is reached."""
    return entry.kind == "config" and entry.readable and entry.key not in _reaching(spec)


@lru_cache(maxsize=8)
def _reaching(spec: DeviceSpec) -> frozenset[Key]:
    """Return the entries that say how the node is reached."""
    moved = [it for it in (spec.services.node_id, spec.services.bitrate) if it is not None]
    return frozenset(key for it in moved for key in spec.companions((it.object, 0)))


def unmet_conditions(node: Node, entry: Entry) -> Iterator[tuple[Entry, int]]:
    """Return what other entries must hold before this one accepts a new value, as far as they do not."""
    for condition in entry.writable_while:
        other = node.spec.entries.get(condition.key)
        if other is None or not other.type.is_integer:
            continue
        if other.optional and node.sdo.upload(*other.key).refused:
            continue
        present = node.number(*other.key)
        if not condition.holds(present):
            yield other, condition.applied(present)


class Settings:
    """The settings of the node under test.

    Storing keeps all of them at once. So `begin` resets the node first: what it then holds is what
    it has stored, and `put_back` can give it back exactly.

    Args:
        node: The node under test.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._spec = node.spec
        self.found: Values = {}

    def begin(self) -> None:
        """Reset the node and note what it has stored.

        Raises:
            SetupRefused: It holds what nothing could give back.
        """
        self._node.reset()
        self._refuse_offsets()
        self.found = self.look()

    def look(self) -> Values:
        """Return what every setting that the node has holds now.

        Raises:
            SetupRefused: One cannot be read.
            NodeTimeout: The node does not answer.
        """
        held: Values = {}
        for entry in self._spec.entries.values():
            if any(
                is_setting(reading, self._spec) and reading.writable for reading in entry.readings
            ):
                try:
                    held[entry.key] = self._node.upload(*entry.key)
                except (NodeTimeout, SetupRefused):
                    if not entry.optional:
                        raise
        return held

    def _refuse_offsets(self) -> None:
        """Refuse to begin with offsets that only a preset at the same tilt would bring back."""
        for rule in self._spec.behaviours.values():
            if not isinstance(rule, Slope) or rule.offset is None:
                continue
            entry = self._spec.entry(*key_of(rule.offset))
            if entry is None or entry.optional or entry.writable:
                continue
            if self._node.number(*entry.key):
                raise SetupRefused(
                    f"{entry.address} holds an offset, which could not be written back afterwards"
                )

    def read(self, known: Mapping[Key, bytes] | None = None) -> Values:
        """Return what the settings hold now.

        Args:
            known: What some of them hold, read since the last write.
        """
        held = known or {}
        return {key: held[key] if key in held else self._node.upload(*key) for key in self.found}

    def write(self, values: Mapping[Key, bytes], held: Mapping[Key, bytes] | None = None) -> Values:
        """Give settings other values, as far as the node takes them.

        Args:
            values: What they are to hold.
            held: What they hold, read since the last write.

        Returns:
            What they hold then.
        """
        for _ in range(_PASSES):
            now = {key: held[key] if held else self._node.upload(*key) for key in values}
            wrong = [key for key, data in values.items() if now[key] != data]
            if not wrong:
                return now
            self._write(wrong, values)
            held = None
        return {key: self._node.upload(*key) for key in values}

    def save(self) -> None:
        """Store all settings.

        Raises:
            SetupRefused: The node refuses.
        """
        self._node.save({index for index, _ in self.found})

    @uninterrupted()
    def put_back(self) -> None:
        """Give the node back what it had stored; costs no store when that is still there.

        Raises:
            SetupRefused: It does not take it.
        """
        if not self.found:
            return
        self._node.reset()
        held = self.read()
        if held == self.found:
            return
        self._write_and_save(held)
        held = self.read()
        if held != self.found:
            self._load()
            self._write_and_save()
            held = self.read()
        left = [key for key, data in held.items() if data != self.found[key]]
        if left:
            names = ", ".join(address(*key) for key in left)
            raise SetupRefused(f"the node does not take back what it had stored: {names}")

    def _write_and_save(self, held: Mapping[Key, bytes] | None = None) -> None:
        self.write(self.found, held)
        self.save()
        self._node.reset()

    def _load(self) -> None:
        restore = self._spec.services.restore
        if restore is not None:
            for sub in groups_of(restore, {index for index, _ in self.found}):
                self._node.download(restore.object, sub, restore.word)
            self._node.reset()

    # One pass: TPDOs are disabled while their parameters change

    def _write(self, keys: list[Key], values: Mapping[Key, bytes]) -> None:
        tpdo = self._spec.services.tpdo
        numbers: dict[int, None] = {}
        for key in keys:
            number = None if tpdo is None else tpdo_number(tpdo, key[0])
            if number is None:
                self._write_one(key, values[key])
            else:
                numbers[number] = None
        for number in numbers:
            if tpdo is not None:
                self._write_tpdo(tpdo, number, keys, values)

    def _write_one(self, key: Key, data: bytes) -> None:
        # their own values come after that
        for other, wanted in unmet_conditions(self._node, self._spec.entries[key]):
            self._node.write(*other.key, other.type.encode(wanted))
        emcy = self._spec.services.emcy_producer
        if emcy is not None and key == (emcy.object, 0):
            self._node.write(*key, _disabled(self._node.upload(*key)))
        self._node.write(*key, data)

    def _write_tpdo(
        self, tpdo: Tpdo, number: int, keys: list[Key], values: Mapping[Key, bytes]
    ) -> None:
        communication, mapping = tpdo.communication + number, tpdo.mapping + number
        cob_id = communication, 1
        word = values.get(cob_id) or self._node.upload(*cob_id)
        movable = self._writable(cob_id)
        if movable:
            self._node.write(*cob_id, _disabled(self._node.upload(*cob_id)))
        if any(index == mapping for index, _ in keys):
            self._write_mapping(mapping, values)
        for key in keys:
            if key[0] == communication and key != cob_id:
                self._node.write(*key, values[key])
        if movable:
            self._node.write(*cob_id, word)

    def _write_mapping(self, mapping: int, values: Mapping[Key, bytes]) -> None:
        count = values.get((mapping, 0)) or self._node.upload(mapping, 0)
        self._node.write(mapping, 0, b"\0")
        for key, data in values.items():
            if key[0] == mapping and key[1] and self._node.upload(*key) != data:
                self._node.write(*key, data)
        self._node.write(mapping, 0, count)

    def _writable(self, key: Key) -> bool:
        entry = self._spec.entry(*key)
        return entry is not None and entry.writable


def tpdo_number(tpdo: Tpdo, index: int) -> int | None:
    """Return which TPDO, from 0, an object is a parameter of."""
    for first in (tpdo.communication, tpdo.mapping):
        if first <= index < first + tpdo.count:
            return index - first
    return None


def _disabled(data: bytes) -> bytes:
    if len(data) != _COB_ID_OCTETS:
        raise SetupRefused(f"the COB-ID of a TPDO has {len(data)} octets, see OD-03")
    return (int.from_bytes(data, "little") | _NOT_VALID).to_bytes(_COB_ID_OCTETS, "little")
