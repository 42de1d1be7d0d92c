"""TPDO producer: when a TPDO is sent and what is in it (CiA 301 v4.2.0, 7.2.2 and 7.5.2.37)."""

from __future__ import annotations

from typing import Final

from conformance.simulator.cob_id_rules import CAN_ID, NO_RTR, NOT_VALID
from conformance.simulator.node import Node
from conformance.simulator.tpdo_rules import TpdoRules, is_too_short
from conformance.spec.document import Tpdo as TpdoSpec
from conformance.spec.fields import key_of
from conformance.spec.model import Key
from conformance.wire.datatypes import Value
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtState
from conformance.wire.pdo import MappingEntry, pack

_MS: Final = 1_000_000
_US: Final = 1_000

ACYCLIC: Final = 0
MOST_SYNCS: Final = 240
MOST_OCTETS: Final = 8
RTR_AT_SYNC: Final = 0xFC
RTR: Final = 0xFD
EVENT: Final = (0xFE, 0xFF)


class Tpdo:
    """One TPDO.

    Args:
        node: The node.
        spec: The TPDO service.
        number: 0 for the first TPDO.
    """

    def __init__(self, node: Node, spec: TpdoSpec, number: int) -> None:
        self._node = node
        self._spec = spec
        self._dictionary = node.dictionary
        self._communication = spec.communication + number
        self._map = spec.mapping + number
        self._max_mapped = spec.max_mapped
        self._inhibit_unit_ns = spec.inhibit_unit_us * _US
        self._event = node.agenda.timer(self._event_due)
        self._inhibited = node.agenda.timer(lambda _due_ns: self._send())
        self._late = node.agenda.timer(lambda _due_ns: self._trigger())
        self._free_ns = self._run_ns = 0
        self._active = False
        blanks = (key_of(it) for it in node.faults.tpdo_blanks)
        self._blank = next((key for key in blanks if key in node.dictionary.entries), None)
        self._cob_id = self._type = self._syncs = 0
        self._mapping: list[tuple[Key, int]] = []
        self._mapping_taken = False
        self._sampled: bytes | None = None
        self._last: bytes | None = None
        self._frozen: bytes | None = None
        TpdoRules(node, spec, number)
        if spec.below_min_cycle == "ignored":
            node.dictionary.adjusts[self._communication, 5] = self._unless_too_short
        observers = node.dictionary.observers
        for sub in (1, 2):
            observers[self._communication, sub].append(self._parameter_written)
        observers[self._communication, 5].append(self._event_time_written)
        for sub in range(self._max_mapped + 1):
            observers[self._map, sub].append(self._parameter_written)

    def refresh(self) -> None:
        """Take over the parameters and the NMT state; start or stop accordingly."""
        number = self._dictionary.number
        self._cob_id = number(self._communication, 1)
        transmission_type = number(self._communication, 2)
        changed = transmission_type != self._type
        self._type = transmission_type
        faults = self._node.faults
        valid = not self._cob_id & NOT_VALID or faults.tpdo_ignores_bit31
        if not (valid and self._mapping_taken and self._spec.map_otherwise == "waits"):
            self._mapping = self._mapped()
            self._mapping_taken = True
        active = valid and bool(self._mapping) and self._may_send()
        if not active or changed:
            self._event.stop()
            self._inhibited.stop()
            self._late.stop()
        if active and (changed or not self._active):
            self._start()
        self._active = active

    def sync(self) -> None:
        """A SYNC has come."""
        if not self._active:
            return
        if self._type == RTR_AT_SYNC:
            self._sampled = self._data()
            if self._node.faults.tpdo_sends_unasked:
                self._send()
        elif self._type == ACYCLIC:
            if self._data() != self._last:
                self._send()
        elif self._type <= MOST_SYNCS:
            self._syncs += 1
            if self._syncs >= self._type + self._node.faults.tpdo_sync_off_by_one:
                self._syncs = 0
                self._send()

    def requested(self, can_id: int) -> None:
        """A remote frame has come."""
        if (
            not self._active
            or can_id != self._cob_id & CAN_ID
            or self._node.faults.tpdo_ignores_rtr
        ):
            return
        allowed = bool(self._cob_id & NO_RTR) == (self._spec.remote == "bit-30-set")
        forced = not allowed and self._node.faults.tpdo_answers_forbidden_rtr
        if not allowed and not forced:
            return
        if self._type == RTR or (forced and self._type != RTR_AT_SYNC):
            self._send()
        elif self._type == RTR_AT_SYNC:
            self._send(self._sampled)

    def _may_send(self) -> bool:
        name = self._node.state.name.lower().replace("_", "-")
        return name in self._node.faults.tpdo_states

    def _mapped(self) -> list[tuple[Key, int]]:
        """Return key and length in bits of each object mapped; empty entries are passed over."""
        number = self._dictionary.number
        count = number(self._map)
        if self._node.faults.tpdo_ignores_count and count:
            count = self._max_mapped
        words = [number(self._map, sub) for sub in range(1, count + 1)]
        mapped = [MappingEntry.from_word(word) for word in words if word]
        keys = [((entry.index, entry.sub), entry.bits) for entry in mapped if entry.bits]
        if self._node.faults.tpdo_swaps_mapped_entries and len(keys) > 1:
            keys[0], keys[1] = keys[1], keys[0]
        if self._node.faults.tpdo_maps_one_less and len(keys) > 1:
            keys.pop()
        while sum(bits for _, bits in keys) > 64:
            keys.pop()
        return keys

    def _start(self) -> None:
        """Begin as on entering Operational."""
        self._syncs = 0
        self._sampled = self._last = self._frozen = None
        self._free_ns = 0
        self._run_ns = self._period_ns()
        if not self._is_timed():
            return
        first = bool(self._run_ns) or self._spec.first == "always"
        if first and not self._node.faults.tpdo_first_late:
            self._trigger()
        if self._run_ns:
            self._event.start(self._node.agenda.now_ns + self._run_ns)

    def _is_timed(self) -> bool:
        always = self._spec.event_time_acts == "always" or self._node.faults.tpdo_timer_always_acts
        return self._type in EVENT or (always and ACYCLIC < self._type <= MOST_SYNCS)

    def _unless_too_short(self, value: Value) -> Value:
        present = self._dictionary.number(self._communication, 5)
        return present if is_too_short(int(value), self._spec) else value

    def _period_ns(self) -> int:
        period_ms = self._dictionary.number(self._communication, 5)
        if self._spec.below_min_cycle == "raised" and is_too_short(period_ms, self._spec):
            period_ms = self._spec.min_cycle_ms or period_ms
        return round(period_ms * _MS * self._node.faults.tpdo_event_timer_factor)

    def _event_due(self, due_ns: int) -> None:
        """Send; a period written since the last time counts from here on, or from the next start."""
        jitter_ns = round(self._node.faults.tpdo_jitter_ms * _MS)
        if jitter_ns:
            self._late.start(due_ns + self._node.random.randint(0, jitter_ns))
        else:
            self._trigger()
        kept = self._spec.new_event_time == "next-start"
        if not kept and not self._node.faults.tpdo_timer_never_stops:
            self._run_ns = self._period_ns()
        if self._run_ns:
            self._event.start(due_ns + self._run_ns)

    def _event_time_written(self, value: Value) -> None:
        faults, runs = self._node.faults, self._event.due_ns is not None
        stops = not faults.tpdo_timer_never_stops if not value else faults.tpdo_new_event_time_stops
        if runs and stops:
            self._event.stop()
        elif value and self._active and self._is_timed() and not runs:
            self._run_ns = self._period_ns()
            self._event.start(self._node.agenda.now_ns + self._run_ns)

    def _parameter_written(self, _value: Value) -> None:
        self.refresh()

    def _trigger(self) -> None:
        """Send now, or at the end of the inhibit time."""
        free = self._node.agenda.now_ns >= self._free_ns or self._spec.inhibited == "changes"
        if free or self._node.faults.tpdo_ignores_inhibit_time:
            self._send()
        elif self._inhibited.due_ns is None:
            self._inhibited.start(self._free_ns)

    def _send(self, data: bytes | None = None) -> None:
        self._last = data = self._data() if data is None else data
        if self._node.faults.tpdo_frozen:
            self._frozen = data = self._frozen or data
        inhibit = self._dictionary.number(self._communication, 3)
        self._free_ns = self._node.agenda.now_ns + inhibit * self._inhibit_unit_ns
        if self._node.faults.tpdo_short:
            data = data[:-1]
        self._node.send(Frame(self._can_id(), data))

    def _can_id(self) -> int:
        if self._node.faults.tpdo_keeps_cob_id:
            return int(self._dictionary.default((self._communication, 1))) & CAN_ID
        return self._cob_id & CAN_ID

    def _data(self) -> bytes:
        data = pack([(self._raw(key, bits), bits) for key, bits in self._mapping])
        if self._reverses("pdo"):
            data = data[::-1]
        if self._node.faults.tpdo_fills_up:
            return data.ljust(MOST_OCTETS, b"\xff")
        return data.ljust(self._spec.octets or 0, b"\0")

    def _raw(self, key: Key, bits: int) -> int:
        if key not in self._dictionary.entries or key == self._blank:
            return 0
        data = self._dictionary.data(key)
        if self._reverses("objects") or self._node.faults.tpdo_swaps_octets:
            data = data[::-1]
        return int.from_bytes(data, "little") & (1 << bits) - 1

    def _reverses(self, what: str) -> bool:
        """Return whether the octets of the objects, or those of the PDO, are turned round now."""
        order = self._spec.byte_order
        if order is None or self._node.faults.tpdo_byte_order_ignored or order.reverses != what:
            return False
        return self._dictionary.number(order.object) == order.big_endian


class TpdoProducer:
    """All TPDOs of a node."""

    def __init__(self, node: Node, spec: TpdoSpec | None) -> None:
        numbers = () if spec is None else range(spec.count)
        self._tpdos = [Tpdo(node, spec, number) for number in numbers if spec is not None]
        self._node = node

    def entered(self, before: NmtState) -> None:
        """Note a change of state."""
        if self._node.state is not before:
            for tpdo in self._tpdos:
                tpdo.refresh()

    def sync(self) -> None:
        """A SYNC has come."""
        if not self._node.faults.tpdo_ignores_sync:
            for tpdo in self._tpdos:
                tpdo.sync()

    def requested(self, can_id: int) -> None:
        """A remote frame has come."""
        for tpdo in self._tpdos:
            tpdo.requested(can_id)
