"""One TPDO of the node: configured by the procedure of CiA 301 v4.2.0, 7.5.2.36, and observed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from conformance.bench.link import Stamped
from conformance.bench.node import Node
from conformance.errors import SetupRefused
from conformance.spec.document import Tpdo
from conformance.spec.model import Entry
from conformance.wire.cob_id import CobId
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand
from conformance.wire.pdo import MappingEntry

ASYNCHRONOUS = 254
_COB_ID, _TYPE, _INHIBIT, _EVENT_TIMER = 1, 2, 3, 5
_NOT_VALID = 1 << 31


class TpdoPort:
    """TPDO ``number`` (1…) of a node.

    Args:
        node: The node under test.
        tpdo: The spec's TPDO service.
        number: 1…512.
    """

    def __init__(self, node: Node, tpdo: Tpdo, number: int) -> None:
        self._node = node
        self._communication = tpdo.communication + number - 1
        self._mapping = tpdo.mapping + number - 1
        self._can_id = CobId.from_word(self._word()).can_id

    def _word(self) -> int:
        return self._node.number(self._communication, _COB_ID)

    def matches(self, frame: Frame) -> bool:
        """Tell whether a frame is on the TPDO's identifier."""
        return frame.can_id == self._can_id and not frame.remote and not frame.extended

    @contextmanager
    def disabled(self) -> Iterator[None]:
        """Disable the TPDO for the steps in the block, then enable it."""
        word = self._word()
        self._node.download(self._communication, _COB_ID, word | _NOT_VALID)
        yield
        self._node.download(self._communication, _COB_ID, word & ~_NOT_VALID)

    def disable(self) -> None:
        """Set bit 31 of the COB-ID."""
        self._node.download(self._communication, _COB_ID, self._word() | _NOT_VALID)

    def enable(self) -> None:
        """Clear bit 31 of the COB-ID."""
        self._node.download(self._communication, _COB_ID, self._word() & ~_NOT_VALID)

    def configure(
        self, transmission_type: int, *, event_ms: int = 0, mapped: Sequence[Entry] = ()
    ) -> None:
        """Set the TPDO up and enable it.

        Args:
            transmission_type: 0..255.
            event_ms: Event timer; 0 switches it off.
            mapped: Objects to map; the mapping stays as it is when empty.
        """
        with self.disabled():
            self._node.download(self._communication, _TYPE, transmission_type)
            if self._node.spec.entry(self._communication, _INHIBIT) is not None:
                self._node.download(self._communication, _INHIBIT, 0)
            self._node.download(self._communication, _EVENT_TIMER, event_ms)
            if mapped:
                self._map(mapped)

    def _map(self, mapped: Sequence[Entry]) -> None:
        self._node.download(self._mapping, 0, 0)
        for place, entry in enumerate(mapped, start=1):
            if entry.type.bits is None:
                raise SetupRefused(f"{entry.address} has no fixed length and cannot be mapped")
            word = MappingEntry(entry.index, entry.sub, entry.type.bits).to_word()
            self._node.download(self._mapping, place, word)
        self._node.download(self._mapping, 0, len(mapped))

    def mapping(self) -> list[MappingEntry]:
        """Return the mapping as the node holds it."""
        count = self._node.number(self._mapping, 0)
        words = (self._node.number(self._mapping, place) for place in range(1, count + 1))
        return [MappingEntry.from_word(word) for word in words if word]

    def listen(self, duration_s: float) -> list[Stamped]:
        """Receive for a while and return this TPDO's frames."""
        return self._node.link.listen(duration_s, self.matches)

    def collect(self, count: int, timeout_s: float) -> list[Stamped]:
        """Receive until ``count`` frames of this TPDO came, or the time is over."""
        mark = self._node.link.mark()
        deadline = self._node.link.now() + timeout_s
        while len(self._node.link.since(mark, self.matches)) < count:
            if self._node.link.recv(deadline) is None:
                break
        return self._node.link.since(mark, self.matches)

    def start(self) -> None:
        """Enter NMT state Operational."""
        self._node.nmt(NmtCommand.START)
