"""The node as it was found before a run: its settings and NMT state, given back and compared at the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from conformance.bench.given_back.journal import Found, Held
from conformance.bench.node.node import Node
from conformance.bench.node.offsets import bring_back, read_offsets
from conformance.bench.node.sdo import Transfer
from conformance.bench.services.heartbeat import NO_HEARTBEAT, HeartbeatPort, name_of, state_of
from conformance.bench.session import Bench
from conformance.bench.settings.settings import Settings, is_setting
from conformance.errors import NodeTimeout, SetupRefused
from conformance.interrupts import uninterrupted
from conformance.spec.model import Entry, Key
from conformance.wire.nmt import NmtCommand, NmtState

LONGEST_WAIT_MS = 2000
"""A heartbeat of a longer period than this is not waited for."""

_LEADS_TO = {
    name_of(NmtState.OPERATIONAL): NmtCommand.START,
    name_of(NmtState.STOPPED): NmtCommand.STOP,
}

Keep = Callable[[Found], None]
"""Puts what was found where it is safe."""


@dataclass(frozen=True, slots=True)
class Difference:
    """An object that does not hold what it held before the run."""

    object: str
    before: str
    after: str


class AsFound:
    """What a run has to leave as it was.

    A restart loses what was not stored. So what is stored is seen after a reset, before and after
    the run, and what was not is written again.

    Args:
        bench: The open bench; its node was found.
        found: What the node held before anything was written to it.
        restarts: What will be run may restart the node, so this may as well.
    """

    def __init__(self, bench: Bench, found: Found, *, restarts: bool) -> None:
        self._bench = bench
        self.found = found
        self._restarts = restarts

    @classmethod
    def look(cls, bench: Bench, keep: Keep, *, restarts: bool) -> AsFound:
        """Look at the node before a run.

        Args:
            bench: The open bench; its node was found.
            keep: Called with what was found before each step that changes something.
            restarts: What will be run may restart the node, so this may as well.

        Raises:
            NodeTimeout: The node does not answer any more.
        """
        node = bench.node()
        made = cls(bench, Found({}), restarts=restarts)
        held = made._read(node)
        history, offsets = made._errors(node) == 0, made._offsets(node)
        made.found = Found(held, had_no_errors=history, offsets=offsets)
        keep(made.found)
        made.found = replace(made.found, nmt_state=made._nmt_state(node))
        keep(made.found)
        node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        bench.done(node, doubtful=False)
        if restarts and _reset(node):
            made.found = replace(made.found, stored=made._read(node))
            keep(made.found)
        else:
            made._restarts = False
        return made

    def __len__(self) -> int:
        return len(self.found.held)

    @property
    def nmt_state(self) -> str:
        """As heartbeats show it; empty where none can."""
        return self.found.nmt_state

    def put_back(self) -> None:
        """Write back what the node held, after a run that could not; what it had stored is stored again.

        Raises:
            SetupRefused: The node does not take it back.
            NodeTimeout: It does not answer any more.
        """
        node = self._bench.node()
        settings = Settings(node)
        if self.found.stored is None:  # the run would not have restarted it, nor stored anything
            settings.write(self._writable(self.found.held))
        else:
            node.reset()
            settings.found = self._writable(self.found.stored)
            offsets = self._offsets(node)
            if offsets != self.found.offsets:
                bring_back(node, self.found.offsets)
                node.save({index for index, _ in (*settings.found, *offsets)})
            settings.put_back()
        self._bench.done(node, doubtful=False)

    def _writable(self, held: Held) -> dict[Key, bytes]:
        spec = self._bench.spec
        entries = ((spec.entries[key], data) for key, data in held.items())
        return {
            entry.key: data
            for entry, data in entries
            if isinstance(data, bytes) and entry.writable and is_setting(entry, spec)
        }

    @uninterrupted()
    def give_back(self) -> list[Difference]:
        """Give back what can be, and return what is not as it was.

        Raises:
            NodeTimeout: The node does not answer any more.
        """
        node = self._bench.node()
        if self._restarts:
            node.reset()
        after = self._read(node)
        held = self.found.held
        stored = held if self.found.stored is None else self.found.stored
        found = list(self._differences(stored, after))
        unsaved = {
            key: data
            for key, data in held.items()
            if isinstance(data, bytes) and data != stored[key]
        }
        if unsaved:
            Settings(node).write(unsaved)
            now = self._read(node)
            found += self._differences(
                {key: held[key] for key in unsaved}, {key: now[key] for key in unsaved}
            )
        if self.found.had_no_errors and self._errors(node):
            node.write(self._history, 0, b"\0")
        self._bench.done(node, doubtful=False)
        if self.nmt_state in _LEADS_TO:
            self._bench.node().nmt(_LEADS_TO[self.nmt_state])
        return found

    @property
    def _history(self) -> int:
        """Index of the error history, which the checks fill; 0 without one."""
        emcy = self._bench.spec.services.emcy_producer
        return emcy.history or 0 if emcy is not None else 0

    def _errors(self, node: Node) -> int | None:
        """Return how many errors the history holds, None where it cannot be cleared."""
        number = self._bench.spec.entry(self._history)
        if number is None or not number.writable:
            return None
        data = _upload(node, number).data
        return data[0] if data else None

    def _offsets(self, node: Node) -> dict[Key, int]:
        """Return what the offsets hold that only a preset changes; none where one does not tell."""
        try:
            held = read_offsets(node)
        except SetupRefused:
            return {}
        return {key: it for key, it in held.items() if not self._bench.spec.entries[key].writable}

    def _nmt_state(self, node: Node) -> str:
        """Return the NMT state that heartbeats show, empty where none can."""
        if self._bench.was_stopped:
            return name_of(NmtState.STOPPED)
        if "writes" not in self._bench.definition.allow:
            return ""
        try:
            port = HeartbeatPort(node, self._bench.spec.services.heartbeat_producer)
            period_ms = node.number(port.producer.object)
            if period_ms == port.producer.off or period_ms > LONGEST_WAIT_MS:
                seen = port.state()
            else:
                beats = port.collect(1, 2 * period_ms / 1000)
                seen = state_of(beats[0]) if beats else NO_HEARTBEAT
        except (SetupRefused, NodeTimeout):
            return ""
        return "" if seen == NO_HEARTBEAT else seen

    def _read(self, node: Node) -> Held:
        held: dict[Key, bytes | str] = {}
        for entry in self._bench.spec.entries.values():
            if _is_setting(entry):
                transfer = _upload(node, entry)
                held[entry.key] = str(transfer) if transfer.data is None else transfer.data
        return held

    def _differences(self, before: Held, after: Held) -> Iterator[Difference]:
        for key, data in before.items():
            if after[key] != data:
                address = self._bench.spec.entries[key].address
                yield Difference(address, _shown(data), _shown(after[key]))


def _upload(node: Node, entry: Entry) -> Transfer:
    transfer = node.sdo.upload(*entry.key)
    if not transfer.answered:
        node.channel.unanswered += 1
        raise NodeTimeout(f"node {node.node_id}: upload of {entry.address}: {transfer}")
    return transfer


def _is_setting(entry: Entry) -> bool:
    return all(reading.kind == "config" and reading.readable for reading in entry.readings)


def _reset(node: Node) -> bool:
    """Reset the node; tell whether it came back."""
    try:
        node.reset()
    except (NodeTimeout, SetupRefused):
        return False
    return True


def _shown(data: bytes | str) -> str:
    return data if isinstance(data, str) else data.hex(" ").upper()
