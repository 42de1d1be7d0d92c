"""EMCY producer, error register and error history (CiA 301 v4.2.0, 7.2.7, 7.5.2.2, 7.5.2.4)."""

from __future__ import annotations

from functools import partial
from typing import Final

from conformance.simulator.cob_id_rules import CAN_ID, NOT_VALID
from conformance.simulator.live import LiveValues
from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.node import Node
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.document import EmcyProducer as EmcySpec
from conformance.spec.document import Follows
from conformance.wire import emcy
from conformance.wire.abort import AbortCode
from conformance.wire.datatypes import Value

NO_ERROR: Final = 0x0000
OUT_OF_RANGE: Final[dict[Follows, int]] = {"tilt-x": 0x5010, "tilt-y": 0x5020}
"""Error codes of CiA 410 for an axis beyond its range."""

_GENERIC: Final = 0
_MANUFACTURER: Final = 7
_BITS: Final = {0x20: 1, 0x30: 2, 0x40: 3, 0x81: 4, 0x82: 4}
"""Error register bit by the upper byte of the code, its lower half ignored but for 81h and 82h."""


class EmcyProducer:
    """Sends an EMCY when an error comes or goes, and keeps register and history.

    Args:
        node: The node.
        spec: The EMCY service, None for a device without.
        live: The measured values.
        memory: Keeps the history of a device whose history is persistent.
    """

    def __init__(
        self, node: Node, spec: EmcySpec | None, live: LiveValues, memory: NonVolatileMemory
    ) -> None:
        self._node = node
        self._spec = spec
        self._live = live
        self._errors: dict[int, None] = {}
        self._history: list[int] = []
        for entry in node.dictionary.entries.values():
            if entry.follows == "error-register":
                node.dictionary.computed[entry.key] = self._register
        if spec is not None and spec.history is not None:
            self._offer_history(spec.history, memory)

    def update(self) -> None:
        """Find out which axes are beyond their range now."""
        if self._spec is None:
            return
        beyond: dict[int, bool] = {}
        for entry in self._node.dictionary.entries.values():
            code = OUT_OF_RANGE.get(entry.follows) if entry.follows is not None else None
            if code is not None and code in self._spec.codes:
                beyond[code] = beyond.get(code, False) or self._live.out_of_range(entry)
        for code, present in beyond.items():
            if present:
                self.raise_error(code)
            else:
                self.clear_error(code)

    def raise_error(self, code: int) -> None:
        """An error has occurred."""
        if code in self._errors:
            return
        self._errors[code] = None
        del self._history[self._depth - 1 :]
        self._history.insert(0, code)
        self._send(code)

    def clear_error(self, code: int) -> None:
        """An error has gone."""
        if code not in self._errors:
            return
        del self._errors[code]
        if not self._node.faults.emcy_never_clears:
            self._send(NO_ERROR)

    def boot(self) -> None:
        """Tell the errors found during initialisation."""
        self.update()
        if self._node.faults.emcy_at_boot:
            self._send(NO_ERROR)

    def _offer_history(self, index: int, memory: NonVolatileMemory) -> None:
        dictionary = self._node.dictionary
        entries = [entry for key, entry in dictionary.entries.items() if key[0] == index]
        errors = [entry for entry in entries if entry.sub]
        if any(entry.persistent for entry in errors):
            self._history = memory.history
        dictionary.computed[index, 0] = lambda: len(self._history)
        dictionary.guards[index, 0].append(_check_zero)
        dictionary.actions[index, 0] = lambda _value: self._history.clear()
        for entry in errors:
            dictionary.computed[entry.key] = partial(self._past_error, entry.sub, entry.default)

    @property
    def _depth(self) -> int:
        if self._spec is None or self._spec.history is None:
            return 1
        entries = self._node.dictionary.entries
        return sum(
            1
            for key, entry in entries.items()
            if key[0] == self._spec.history and entry.sub and not entry.optional
        )

    def _past_error(self, sub: int, default: Value | None) -> Value:
        if sub <= len(self._history):
            return self._history[sub - 1]
        if default is None:
            raise SdoAbortError(AbortCode.NO_DATA_AVAILABLE)
        return default

    def _register(self) -> int:
        register = 0
        for code in self._errors:
            register |= 1 << _GENERIC | 1 << self._bit(code)
        return register

    def _bit(self, code: int) -> int:
        upper = code >> 8
        bit = _BITS.get(upper if upper in _BITS else upper & 0xF0, _MANUFACTURER)
        known = self._spec.register_bits if self._spec is not None else {}
        if bit in known:
            return bit
        return _MANUFACTURER if _MANUFACTURER in known else _GENERIC

    def _send(self, code: int) -> None:
        spec, node = self._spec, self._node
        if spec is None or node.faults.emcy_missing:
            return
        if node.dictionary.state not in spec.states:
            return
        word = node.dictionary.number(spec.object)
        if word & NOT_VALID:
            return
        frame = emcy.encode(emcy.Emergency(code, self._register()), word & CAN_ID)
        for _ in range(1 + node.faults.emcy_repeats):
            node.send(frame)


def _check_zero(value: Value) -> None:
    if value != 0:
        raise SdoAbortError(AbortCode.INVALID_VALUE)
