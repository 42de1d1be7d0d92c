"""Error history of a simulated device (CiA 301 v4.2.0, 7.5.2.4)."""

from __future__ import annotations

from functools import partial

from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.node import Node
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.document import EmcyProducer
from conformance.wire.abort import AbortCode
from conformance.wire.datatypes import Value

_ERASED = 0xFFFF_FFFF


class ErrorHistory:
    """The codes of past errors, the latest in sub-index 1; empty for a device without the object.

    Args:
        node: The node.
        producer: What the manual says of its EMCY; None where it says nothing.
        memory: Keeps the history of a device whose history is persistent.
    """

    def __init__(
        self, node: Node, producer: EmcyProducer | None, memory: NonVolatileMemory
    ) -> None:
        self._faults = node.faults
        self._codes: list[int] = []
        self._depth = 1
        if producer is None or producer.history is None:
            return
        self._takes = producer.history_takes
        dictionary, index = node.dictionary, producer.history
        places = [e for key, e in dictionary.entries.items() if key[0] == index and e.sub]
        self._depth = sum(1 for entry in places if not entry.optional)
        if any(entry.persistent for entry in places) or self._faults.history_codes_lost:
            self._codes = memory.history
        if self._faults.history_codes_lost:
            self._codes[:] = [0] * len(self._codes)
        dictionary.computed[index, 0] = lambda: len(self._codes)
        dictionary.guards[index, 0].append(self._check)
        dictionary.actions[index, 0] = self._written
        for entry in places:
            dictionary.computed[entry.key] = partial(self._past, entry.sub, entry.default)

    def enter(self, code: int) -> None:
        """Put a code in front of the others."""
        if self._faults.history_stays_empty:
            return
        depth = self._faults.history_depth or self._depth
        if self._faults.history_oldest_first:
            self._codes.append(code)
            del self._codes[:-depth]
            return
        del self._codes[depth - 1 :]
        self._codes.insert(0, code)

    def _check(self, value: Value) -> None:
        anything = self._takes == "any" or self._faults.history_takes_any
        if value != 0 and not anything:
            raise SdoAbortError(AbortCode.INVALID_VALUE)

    def _written(self, value: Value) -> None:
        if value == 0 and not self._faults.history_never_clears:
            self._codes.clear()

    def _past(self, sub: int, default: Value | None) -> Value:
        if sub <= len(self._codes):
            return self._codes[sub - 1]
        if self._faults.history_unused_erased:
            return _ERASED
        if default is None:
            raise SdoAbortError(AbortCode.NO_DATA_AVAILABLE)
        return default
