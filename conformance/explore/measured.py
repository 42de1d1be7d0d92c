"""Which bits of a TPDO are measured: asked of the model, as what it maps."""

from __future__ import annotations

from typing import Final

from conformance.bench.node.node import Node
from conformance.explore.steps import Download, Nmt, PowerCycle, Step
from conformance.spec.model import DeviceSpec, Entry
from conformance.wire.pdo import MappingEntry

_CAN_ID: Final = 0x7FF
_ALL: Final = (1 << 64) - 1


class Measured:
    """The measured bits of the model's TPDOs.

    Args:
        model: The model's node.
        spec: What the manual says.
    """

    def __init__(self, model: Node, spec: DeviceSpec) -> None:
        self._model = model
        self._spec = spec
        self._known: dict[int, int] | None = None

    def expect(self, step: Step) -> None:
        """Note a step that may change a mapping."""
        if isinstance(step, Download | Nmt | PowerCycle):
            self._known = None

    def bits(self, can_id: int) -> int:
        """Return the bits of a frame that are measured, or of which nothing is known."""
        if self._known is None:
            self._known = self._ask()
        return self._known.get(can_id, _ALL)

    def _ask(self) -> dict[int, int]:
        tpdo, found = self._spec.services.tpdo, {}
        for number in range(tpdo.count if tpdo is not None else 0):
            assert tpdo is not None
            can_id = self._number(tpdo.communication + number, 1)
            count = self._number(tpdo.mapping + number, 0)
            if can_id is None or count is None:
                continue
            words = [self._number(tpdo.mapping + number, sub + 1) or 0 for sub in range(count)]
            found[can_id & _CAN_ID] = self._mask([MappingEntry.from_word(word) for word in words])
        return found

    def _number(self, index: int, sub: int) -> int | None:
        data = self._model.sdo.upload(index, sub).data
        return None if data is None else int.from_bytes(data, "little")

    def _mask(self, mapped: list[MappingEntry]) -> int:
        mask = place = 0
        for it in mapped:
            if _is_measured(self._spec.entry(it.index, it.sub)):
                mask |= ((1 << it.bits) - 1) << place
            place += it.bits
        order = self._spec.services.tpdo.byte_order if self._spec.services.tpdo else None
        return _ALL if mask and order is not None and order.reverses == "pdo" else mask


def _is_measured(entry: Entry | None) -> bool:
    return entry is None or entry.kind in ("live", "counter") or entry.follows is not None
