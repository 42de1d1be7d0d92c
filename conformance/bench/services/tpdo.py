"""One TPDO of the node: configured by the procedure of CiA 301 v4.2.0, 7.5.2.37 and 7.5.2.38, and observed."""

from __future__ import annotations

from collections.abc import Sequence

from conformance.bench.bus.intervals import gaps_ms, mean_ms
from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.errors import SetupRefused
from conformance.spec.document import Tpdo
from conformance.spec.model import Alternative, DeviceSpec, Entry, address, is_legal
from conformance.wire.cob_id import is_restricted
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand
from conformance.wire.pdo import MappingEntry

_COB_ID, _TYPE, _INHIBIT, _EVENT_TIMER = 1, 2, 3, 5
_BY_TIMER = (254, 255)
_NOT_VALID = 1 << 31
_BIT_30 = 1 << 30
_EXTENDED = 1 << 29
_CAN_ID = 0x7FF


def pace_entries(spec: DeviceSpec, communication: int) -> list[Entry]:
    """Return the entries that say when a TPDO is sent: transmission type and event timer."""
    entries = (spec.entry(communication, sub) for sub in (_TYPE, _EVENT_TIMER))
    return [entry for entry in entries if entry is not None]


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
        self._cob_id = self._usable(node.number(self._communication, _COB_ID))
        self._can_id = self._cob_id & _CAN_ID

    def _usable(self, word: int) -> int:
        """Return the COB-ID to try: the node's own, or the documented one if that is unusable."""
        documented = self._node.spec.entry(self._communication, _COB_ID)
        for candidate in (word, documented.default if documented else None):
            if isinstance(candidate, int) and not (
                candidate & _EXTENDED or is_restricted(candidate & _CAN_ID)
            ):
                return candidate
        raise SetupRefused(
            f"{address(self._communication, _COB_ID)} holds {word:08X}h, no usable COB-ID"
        )

    def matches(self, frame: Frame) -> bool:
        """Tell whether a frame is on the TPDO's identifier."""
        return frame.can_id == self._can_id and not frame.remote and not frame.extended

    @property
    def can_be_mapped(self) -> bool:
        """The manual lets the mapping be written."""
        return self._writable(self._mapping, 0) and self._writable(self._mapping, 1)

    def _writable(self, index: int, sub: int) -> bool:
        entry = self._node.spec.entry(index, sub)
        return entry is not None and entry.writable

    def disable(self) -> None:
        """Set bit 31 of the COB-ID, where the manual lets it be written."""
        self._write_cob_id(self._cob_id | _NOT_VALID)

    def enable(self) -> None:
        """Clear bit 31 of the COB-ID, where the manual lets it be written."""
        self._write_cob_id(self._cob_id & ~_NOT_VALID)

    def _write_cob_id(self, word: int) -> None:
        if self._writable(self._communication, _COB_ID):
            self._node.download(self._communication, _COB_ID, word)

    @property
    def bits_30(self) -> tuple[int, ...]:
        """The values that bit 30 of the COB-ID can have, or always has."""
        if self._writable(self._communication, _COB_ID):
            return 0, 1
        return (int(bool(self._cob_id & _BIT_30)),)

    def allow_remote(self, bit_30: int) -> None:
        """Give bit 30 of the COB-ID a value; the TPDO is disabled before and enabled after."""
        self.disable()
        self._cob_id = self._cob_id & ~_BIT_30 | bit_30 << 30
        self.enable()

    def set_inhibit_time(self, value: int) -> None:
        """Write the inhibit time; the TPDO is disabled before and enabled after."""
        self.disable()
        self._node.download(self._communication, _INHIBIT, value)
        self.enable()

    def request(self, octets: int) -> Stamped:
        """Ask for the TPDO by a remote frame of its length."""
        return self._node.send(Frame(self._can_id, remote=True, dlc=octets))

    def configure(
        self, transmission_type: int, *, event_ms: int = 0, mapped: Sequence[Entry] = ()
    ) -> None:
        """Set the TPDO up and enable it; what the manual does not let be written stays as it is.

        Args:
            transmission_type: 0..255.
            event_ms: Event timer; 0 switches it off.
            mapped: Objects to map; the mapping stays as it is when empty.
        """
        self.disable()
        if self._writable(self._communication, _TYPE):
            self._node.download(self._communication, _TYPE, transmission_type)
        if self._writable(self._communication, _INHIBIT):
            self._node.download(self._communication, _INHIBIT, 0)
        if self._writable(self._communication, _EVENT_TIMER) and (event_ms or self._takes_zero):
            self._node.download(self._communication, _EVENT_TIMER, event_ms)
        if mapped:
            self._map(mapped)
        self.enable()

    @property
    def _takes_zero(self) -> bool:
        """Every reading of the manual lets the event timer be switched off."""
        entry = self._node.spec.entry(self._communication, _EVENT_TIMER)
        return entry is not None and all(is_legal(0, r.legal) for r in entry.readings)

    @property
    def pace(self) -> list[Entry]:
        """The entries that say when it is sent."""
        return pace_entries(self._node.spec, self._communication)

    @property
    def period_ms(self) -> int:
        """What the event timer holds, if it sends the TPDO by the type that the node holds; else 0."""
        spec = self._node.spec
        kind = spec.entry(self._communication, _TYPE)
        timer = spec.entry(self._communication, _EVENT_TIMER)
        if timer is None or (kind is not None and self._node.number(*kind.key) not in _BY_TIMER):
            return 0
        return self._node.number(*timer.key)

    def fixed_mapping(self) -> Alternative | None:
        """Return the reading by which the mapping is fixed, if there is one and the node follows it."""
        entry = self._node.spec.entry(self._mapping, 0)
        fixed = [other for other in entry.alternatives if not other.entry.writable] if entry else []
        if entry is None or not fixed:
            return None
        self.disable()
        numbers = (self._node.upload(self._mapping, 0), b"\0")
        refused = all(self._node.try_download(self._mapping, 0, it).refused for it in numbers)
        self.enable()
        return fixed[0] if refused else None

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

    @property
    def mapped_octets(self) -> int:
        """Octets of the mapped objects."""
        return (sum(word.bits for word in self.mapping()) + 7) // 8

    def listen(self, duration_s: float) -> list[Stamped]:
        """Receive for a while and return this TPDO's frames."""
        return self._node.link.listen(duration_s, self.matches)

    def collect(self, count: int, timeout_s: float) -> list[Stamped]:
        """Receive until ``count`` frames of this TPDO came, or the time is over."""
        return self._node.link.collect(count, timeout_s, self.matches)

    def gaps_ms(self, seen: Sequence[Stamped], near_ms: float) -> list[float]:
        """Return the times from one frame to the next, as near to a figure as waits for the bus allow."""
        return gaps_ms(self._node.link, seen, near_ms)

    def mean_ms(self, seen: Sequence[Stamped], near_ms: float) -> list[float]:
        """Return their mean as a list of one, as near to a figure as waits for the bus allow."""
        return mean_ms(self._node.link, seen, near_ms)

    def start(self) -> None:
        """Enter NMT state Operational."""
        self._node.nmt(NmtCommand.START)
