"""What a TPDO's parameters must satisfy when they are written (CiA 301 v4.2.0, 7.5.2.37, 7.5.2.38)."""

from __future__ import annotations

from functools import partial

from conformance.simulator.cob_id_rules import NOT_VALID
from conformance.simulator.node import Node
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.document import Tpdo as TpdoSpec
from conformance.wire.abort import AbortCode
from conformance.wire.datatypes import Value
from conformance.wire.pdo import MappingEntry

_PDO_BITS = 64


def is_too_short(period_ms: int, spec: TpdoSpec) -> bool:
    """Return whether an event time is shorter than the least cycle."""
    return 0 < period_ms < (spec.min_cycle_ms or 0)


class TpdoRules:
    """Guards of one TPDO's communication and mapping parameters.

    Args:
        node: The node.
        spec: The TPDO service.
        number: 0 for the first TPDO.
    """

    def __init__(self, node: Node, spec: TpdoSpec, number: int) -> None:
        self._dictionary = node.dictionary
        self._faults = node.faults
        self._spec = spec
        self._communication = spec.communication + number
        self._mapping = spec.mapping + number
        self._gaps_allowed = self._has_gaps()
        guards = node.dictionary.guards
        guards[self._communication, 2].append(self._check_type)
        guards[self._communication, 3].append(partial(self._check_while_valid, 3))
        if self._faults.tpdo_drops_inhibit_time:
            node.dictionary.adjusts[self._communication, 3] = self._unless_valid
        guards[self._communication, 5].append(self._check_cycle)
        guards[self._communication, 6].append(partial(self._check_while_valid, 6))
        guards[self._mapping, 0].append(self._check_count)
        if self._faults.tpdo_maps_too_much:
            node.dictionary.ranges[self._mapping, 0] = None
        for sub in range(1, spec.max_mapped + 1):
            guards[self._mapping, sub].append(self._check_entry)

    def _is_valid(self) -> bool:
        return not self._dictionary.number(self._communication, 1) & NOT_VALID

    def _has_gaps(self) -> bool:
        """Return whether the device itself counts empty mapping entries as mapped."""
        entries, mapping = self._dictionary.entries, self._mapping
        count = self._dictionary.default((mapping, 0)) if (mapping, 0) in entries else 0
        used = [
            sub
            for sub in range(1, int(count) + 1)
            if (mapping, sub) in entries and self._dictionary.default((mapping, sub))
        ]
        return len(used) < int(count)

    def _check_type(self, value: Value) -> None:
        known = any(
            int(low) <= int(value) <= int(high) for low, high in self._spec.transmission_types
        )
        lax = self._spec.other_types == "accepted" or self._faults.accepts_out_of_range
        if not known and not lax:
            raise SdoAbortError(AbortCode.INVALID_VALUE)

    def _check_while_valid(self, sub: int, value: Value) -> None:
        if self._spec.change_while_valid == "accepted" or self._faults.tpdo_drops_inhibit_time:
            return
        if self._is_valid() and value != self._dictionary.number(self._communication, sub):
            raise SdoAbortError(AbortCode.INVALID_VALUE)

    def _unless_valid(self, value: Value) -> Value:
        return self._dictionary.number(self._communication, 3) if self._is_valid() else value

    def _check_cycle(self, value: Value) -> None:
        if self._spec.below_min_cycle != "refused" or self._faults.accepts_out_of_range:
            return
        if is_too_short(int(value), self._spec):
            raise SdoAbortError(AbortCode.INVALID_VALUE)

    def _may_map_at_any_time(self) -> bool:
        return self._spec.map_otherwise == "waits" or self._faults.tpdo_maps_while_valid

    def _check_disabled(self) -> None:
        if self._may_map_at_any_time():
            return
        if "disabled" in self._spec.map_only_while and self._is_valid():
            raise SdoAbortError(AbortCode.UNSUPPORTED_ACCESS)

    def _check_entry(self, value: Value) -> None:
        self._check_disabled()
        count = self._dictionary.entries[self._mapping, 0]
        must_be_zero = "count-zero" in self._spec.map_only_while and count.writable
        lax = self._may_map_at_any_time()
        if must_be_zero and self._dictionary.number(self._mapping) and not lax:
            raise SdoAbortError(AbortCode.UNSUPPORTED_ACCESS)
        if value:
            self._check_mappable(int(value))

    def _check_count(self, value: Value) -> None:
        self._check_disabled()
        if self._faults.tpdo_maps_too_much:
            return
        count = int(value)
        if count > self._spec.max_mapped:
            raise SdoAbortError(AbortCode.PDO_LENGTH_EXCEEDED)
        words = [self._dictionary.number(self._mapping, sub) for sub in range(1, count + 1)]
        for word in words:
            if word or not self._gaps_allowed:
                self._check_mappable(word)
        if sum(word & 0xFF for word in words) > _PDO_BITS:
            raise SdoAbortError(AbortCode.PDO_LENGTH_EXCEEDED)

    def _check_mappable(self, word: int) -> None:
        if self._faults.tpdo_maps_anything:
            return
        mapped = MappingEntry.from_word(word)
        target = self._dictionary.entries.get((mapped.index, mapped.sub))
        if target is None or target.reserved:
            raise SdoAbortError(AbortCode.OBJECT_DOES_NOT_EXIST)
        if not target.mappable or not target.readable or target.type.bits != mapped.bits:
            raise SdoAbortError(AbortCode.OBJECT_NOT_MAPPABLE)
