"""Mapping of one TPDO, written step by step so that every answer can be judged (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.services.tpdo import TpdoPort
from conformance.errors import SetupRefused
from conformance.spec.document import Tpdo
from conformance.spec.model import Entry, address
from conformance.wire.datatypes import DataType
from conformance.wire.pdo import MappingEntry

NOT_VALID = 1 << 31


def word_of(entry: Entry) -> int:
    """Return the mapping word of an entry.

    Raises:
        SetupRefused: It has no fixed length.
    """
    if entry.type.bits is None:
        raise SetupRefused(f"{entry.address} has no fixed length and cannot be mapped")
    return MappingEntry(entry.index, entry.sub, entry.type.bits).to_word()


@dataclass(frozen=True, slots=True)
class Step:
    """One download of a procedure.

    Args:
        what: The download in words.
        counts: It wrote the number of mapped objects.
        answer: What the node made of it.
    """

    what: str
    counts: bool
    answer: Transfer


class MappingPort(TpdoPort):
    """Mapping and COB-ID of TPDO ``number`` (1…) of a node.

    Args:
        node: The node under test.
        tpdo: The spec's TPDO service.
        number: 1…512.
    """

    def __init__(self, node: Node, tpdo: Tpdo, number: int) -> None:
        super().__init__(node, tpdo, number)
        self.mapping_index = tpdo.mapping + number - 1
        self.cob_id_key = (tpdo.communication + number - 1, 1)

    def open(self) -> None:
        """Switch the TPDO off and let it map nothing; for set-up."""
        self.disable()
        self._node.download(self.mapping_index, 0, 0)

    def offer(self, words: Sequence[int], count: int | None = None) -> list[Step]:
        """Write mapping words and their number, up to the first step that is not confirmed."""
        steps: list[Step] = []
        for place, word in enumerate(words, start=1):
            steps.append(self.try_word(place, word))
            if not steps[-1].answer.confirmed:
                return steps
        return [*steps, self.try_count(len(words) if count is None else count)]

    def remap(self, words: Sequence[int]) -> list[Step]:
        """Map by the whole procedure, up to the first step that is not confirmed."""
        steps = [*self._try_bit_31(1), self.try_count(0)]
        if all(step.answer.confirmed for step in steps):
            steps += self.offer(words)
        if all(step.answer.confirmed for step in steps):
            steps += self._try_bit_31(0)
        return steps

    def try_word(self, place: int, word: int) -> Step:
        """Write one mapping word."""
        return self._try(place, DataType.UNSIGNED32, word)

    def try_count(self, count: int) -> Step:
        """Write the number of mapped objects."""
        return self._try(0, DataType.UNSIGNED8, count)

    def words(self) -> list[int]:
        """Return the mapping words that count, of the places there are; for set-up."""
        places = range(1, self._node.number(self.mapping_index, 0) + 1)
        return [
            self._node.number(self.mapping_index, place)
            for place in places
            if self._is_there(place)
        ]

    def _is_there(self, place: int) -> bool:
        entry = self._node.spec.entry(self.mapping_index, place)
        if entry is None or not entry.optional:
            return entry is not None
        return not self._node.sdo.upload(*entry.key).refused

    def try_cob_id(self, word: int) -> Transfer:
        """Write the COB-ID."""
        return self._node.try_download(*self.cob_id_key, DataType.UNSIGNED32.encode(word))

    def write_cob_id(self, word: int) -> None:
        """Write the COB-ID; for set-up."""
        self._node.download(*self.cob_id_key, word)

    def cob_id(self) -> int:
        """Return the COB-ID as the node holds it; for set-up."""
        return self._node.number(*self.cob_id_key)

    def _try(self, sub: int, kind: DataType, value: int) -> Step:
        answer = self._node.try_download(self.mapping_index, sub, kind.encode(value))
        shown = f"{value:08X}h" if sub else str(value)
        what = f"download of {shown} to {address(self.mapping_index, sub)}"
        return Step(what, sub == 0, answer)

    def _try_bit_31(self, value: int) -> list[Step]:
        """Write bit 31 of the COB-ID, where the manual lets it be written."""
        if not self._writable(*self.cob_id_key):
            return []
        word = self.cob_id() & ~NOT_VALID | value << 31
        what = f"download of {word:08X}h to {address(*self.cob_id_key)}"
        return [Step(what, counts=False, answer=self.try_cob_id(word))]
