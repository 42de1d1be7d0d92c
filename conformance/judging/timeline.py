"""What is known of a node at each place of a recording: what it was told, and what it holds."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from dataclasses import dataclass, field

from conformance.judging.exchanges import Exchange, Exchanges, Unanswered, exchanges
from conformance.judging.recording import Recording, Seen
from conformance.spec.model import DeviceSpec, Entry, Key
from conformance.wire import cob_id, nmt
from conformance.wire.cob_id import LSS_MASTER
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtRequest

RESETS = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)


@dataclass(frozen=True, slots=True)
class Known:
    """What an object holds, as an exchange told.

    Args:
        value: As a number.
        line: Where that exchange ended.
    """

    value: int
    line: int


@dataclass(slots=True)
class Timeline:
    """A recording from the point of view of one node.

    Args:
        recording: What was recorded.
        spec: What the device is held against.
        bitrate: Of the bus, in bit/s.
        jitter_ms: How far a timestamp may be off.

    Attributes:
        exchanges: With its SDO server.
        commands: NMT commands that it obeys, whoever sent them.
        error_control: Frames on its heartbeat identifier.
    """

    recording: Recording
    spec: DeviceSpec
    bitrate: int
    jitter_ms: float
    exchanges: Exchanges = field(init=False)
    commands: list[tuple[Seen, NmtRequest]] = field(init=False)
    error_control: list[Seen] = field(init=False)
    _sent: list[Seen] = field(init=False)
    _forgotten: list[int] = field(init=False)
    _facts: dict[Key, list[tuple[int, int | None]]] = field(init=False)

    def __post_init__(self) -> None:
        node_id = self.spec.node_id
        self.exchanges = exchanges(self.recording, node_id)
        self.commands = [
            (seen, request)
            for seen in self.recording.seen
            if (request := _command(seen.frame)) is not None and request.node_id in (0, node_id)
        ]
        self.error_control = self.on(cob_id.heartbeat(node_id))
        self._sent = self._of_node()
        self.exchanges.disturbed -= sum(map(self._is_explained, self.exchanges.unanswered))
        self._forgotten = self._forgetting()
        self._facts = defaultdict(list)
        for exchange in self.exchanges.all:
            self._learn(exchange)

    def on(self, *can_ids: int) -> list[Seen]:
        """Return the data frames on some 11-bit identifiers."""
        return [
            it
            for it in self.recording.seen
            if it.frame.can_id in can_ids and not it.frame.remote and not it.frame.extended
        ]

    @property
    def boot_ups(self) -> list[Seen]:
        """The node's boot-up messages."""
        return [it for it in self.error_control if it.frame.data == b"\0"]

    def known(self, key: Key, line: int) -> Known | None:
        """Return what an object holds at a line, None where nothing since the last start tells."""
        facts = [fact for fact in self._facts[key] if fact[0] <= line]
        if not facts or facts[-1][1] is None:
            return None
        told, value = facts[-1]
        if bisect_right(self._forgotten, line) != bisect_right(self._forgotten, told):
            return None
        return Known(value, told) if value is not None else None

    def told(self, key: Key) -> list[int]:
        """Return all that exchanges told of an object."""
        return [value for _, value in self._facts[key] if value is not None]

    def changes(self, keys: set[Key]) -> list[int]:
        """Return the lines at which some objects may have been given other values."""
        return [
            it.first.line
            for it in self.exchanges.all
            if it.kind == "download" and not keys.isdisjoint(self.spec.companions(it.key))
        ]

    def may_differ(self, first: int, last: int) -> bool:
        """Tell whether something between two lines may have changed what the node does."""
        return bisect_right(self._forgotten, first) != bisect_right(self._forgotten, last)

    def commanded(self, line: int) -> NmtCommand | None:
        """Return the last NMT command before a line, None without one that the standard has."""
        place = bisect_right(self.commands, line, key=lambda it: it[0].line) - 1
        if place < 0:
            return None
        word = self.commands[place][1].command
        return next((it for it in NmtCommand if it == word), None)

    def _is_explained(self, requests: Unanswered) -> bool:
        """Tell whether requests were not answered because the node was stopped, or not up yet.

        A download to a node that is not up may as well have come, and its response been lost.
        """
        first, last = requests.first, requests.last
        if self.commanded(first) is self.commanded(last) is NmtCommand.STOP:
            return True
        place = bisect_right(self._sent, first, key=lambda it: it.line)
        if not requests.reads or place == len(self._sent):
            return False
        sent, breaks = self._sent[place], self.recording.breaks
        lost = bisect_right(breaks, first) != bisect_right(breaks, sent.line)
        return not lost and sent.frame == Frame(cob_id.heartbeat(self.spec.node_id), b"\0")

    def _of_node(self) -> list[Seen]:
        """Return the frames on the identifiers that are the node's by default."""
        node_id = self.spec.node_id
        own = [make(node_id) for make in (cob_id.emcy, cob_id.sdo_response, cob_id.heartbeat)]
        return self.on(*own, *(cob_id.tpdo(number, node_id) for number in range(1, 5)))

    def lasts_until(self, line: int) -> int:
        """Return the line after one at which something may change what the node does."""
        place = bisect_right(self._forgotten, line)
        past = len(self.recording.seen) + 1
        return self._forgotten[place] if place < len(self._forgotten) else past

    def _forgetting(self) -> list[int]:
        lines = [*self.recording.breaks, *(it.line for it in self.boot_ups)]
        lines += [seen.line for seen, request in self.commands if request.command in RESETS]
        lines += [it.line for it in self.on(LSS_MASTER)]
        lines += [it.first.line for it in self.exchanges.all if self._may_change_others(it)]
        return sorted(set(lines))

    def _may_change_others(self, exchange: Exchange) -> bool:
        """Tell whether a download may change other objects than its own."""
        entry = self.spec.entries.get(exchange.key)
        restore = self.spec.services.restore
        if exchange.kind == "upload":
            return False
        if restore is not None and exchange.index == restore.object:
            return True
        return entry is None or entry.kind == "command"

    def _learn(self, exchange: Exchange) -> None:
        entry = self.spec.entries.get(exchange.key)
        if entry is None or not entry.type.is_integer:
            return
        if exchange.kind == "download":
            for key in self.spec.companions(exchange.key):
                self._facts[key].append((exchange.first.line, None))
        acts = all(it.effective == "at-once" for it in entry.readings)
        if not exchange.clean or exchange.data is None or exchange.abort is not None or not acts:
            return
        value = number(entry, exchange)
        if value is None or (exchange.kind == "download" and not entry.always_legal(value)):
            return
        self._facts[exchange.key].append((exchange.last.line, value))


def number(entry: Entry, exchange: Exchange) -> int | None:
    """Return the number that an exchange carried, None where it has not the length of the type."""
    data = exchange.data or b""
    if not exchange.sized:
        data = data[: entry.type.size]
    try:
        value = entry.type.decode(data)
    except WireError:
        return None
    return value if isinstance(value, int) else None


def _command(frame: Frame) -> NmtRequest | None:
    try:
        return nmt.decode_request(frame)
    except WireError:
        return None
