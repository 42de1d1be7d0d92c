"""A commissioning on a bench, from opening its bus to closing it, and the way back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from conformance.bench.definition import BenchDefinition
from conformance.bench.session import Bench
from conformance.commissioning.by_lss import ByLss
from conformance.commissioning.by_objects import ByObjects
from conformance.commissioning.procedure import Procedure
from conformance.commissioning.record import Record
from conformance.errors import SpecError
from conformance.interrupts import interruptible
from conformance.spec.model import DeviceSpec

TRACE: Final = ".log"
"""Ending of the trace beside the record."""


@dataclass(frozen=True, slots=True)
class Commissioning:
    """Sensors fresh from the box on a bench.

    Args:
        definition: The bench; who types is the operator where it has none.
        spec: The sensors' spec, at the node-ID that they have fresh from the box.
        path: Of the record.
        options: Arguments of the interface beyond those in the bench's file.
    """

    definition: BenchDefinition
    spec: DeviceSpec
    path: Path
    options: Mapping[str, Any] = field(default_factory=dict)

    def require_way(self, bitrate: int) -> None:
        """Make sure that the manual says how a node-ID is given, and the bit rate if it is another.

        Raises:
            SpecError: It does not.
        """
        way = ByLss if ByLss.can(self.spec) else ByObjects
        if not way.can(self.spec):
            raise SpecError(
                "DEVICE: expected one whose manual tells how a node-ID is given, "
                f"got {self.spec.name}"
            )
        present = self.definition.bitrate or self.spec.bitrate
        if bitrate == present:
            return
        if not self.definition.sets_bitrate:
            raise SpecError(
                f"--to-bitrate: expected none on interface {self.definition.interface}, whose bit "
                f"rate is set up by others, got {bitrate}"
            )
        known = way.rates(self.spec)
        if bitrate not in known or present not in known:
            raise SpecError(
                f"--to-bitrate: expected one of {known} bit/s, from which the device can be brought "
                f"back to {present} bit/s, got {bitrate}"
            )

    def give(
        self,
        record: Record,
        serials: Sequence[int],
        node_ids: Sequence[int],
        bitrate: int,
        *,
        one_by_one: bool,
    ) -> list[str]:
        """Give all sensors their places; return what went wrong, a sentence each.

        Args:
            record: Where it is noted.
            serials: Their serial numbers; looked for where there are none.
            node_ids: To give, as far as nobody has them.
            bitrate: To give, in bit/s.
            one_by_one: The operator connects one after the other, as always where nothing else will do.

        Raises:
            BenchError: Nobody is there, or there are too few node-IDs.
        """
        opened = self._open(TRACE)
        try:
            with interruptible():
                procedure = Procedure(opened, record, self.path)
                if one_by_one or not self.finds(serials):
                    return procedure.one_by_one(node_ids, bitrate)
                return procedure.all_at_once(serials, node_ids, bitrate)
        finally:
            opened.close()

    def finds(self, serials: Sequence[int]) -> bool:
        """Tell whether sensors of one node-ID can be told from each other, with serial numbers or without."""
        return ByLss.can(self.spec) and (bool(serials) or ByLss.finds(self.spec))

    def take_back(self, record: Record, *, one_by_one: bool) -> list[str]:
        """Bring all sensors of a record to where they were found; return what went wrong.

        Args:
            record: Of those.
            one_by_one: The operator connects one after the other.
        """
        opened = self._open(".undo" + TRACE)
        try:
            with interruptible():
                return Procedure(opened, record, self.path).back(one_by_one=one_by_one)
        finally:
            opened.close()

    def _open(self, ending: str) -> Bench:
        definition = self.definition
        if definition.operator == "none":
            definition = definition.model_copy(update={"operator": "terminal"})
        return Bench.open(definition, self.spec, self.options, self.path.with_suffix(ending))
