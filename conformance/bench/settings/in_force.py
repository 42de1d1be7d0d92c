"""New values put in force on a node that acts on them only after a store and a restart."""

from __future__ import annotations

from collections.abc import Callable

from conformance.bench.node.node import Node
from conformance.bench.node.offsets import all_offset_steps, read_offsets
from conformance.bench.settings.settings import Settings, Values
from conformance.errors import SetupRefused
from conformance.interrupts import uninterrupted
from conformance.spec.model import Entry, Key


def may_wait(entry: Entry) -> bool:
    """Tell whether by any reading an entry acts only after a store."""
    return any(reading.effective != "at-once" for reading in entry.readings)


class InForce:
    """Stores what a check has written and restarts the node; `leave` puts back what it had stored.

    A store keeps every setting. So the first one begins with a restart, as `Settings` has it, and
    what the check has written is written again.

    Args:
        node: The node under test.
        allowed: The bench allows a store and a restart.
        by_supply: The node is restarted by its supply, else by NMT.
    """

    def __init__(self, node: Node, *, allowed: bool, by_supply: bool) -> None:
        self._node = node
        self._allowed = allowed
        self.by_supply = by_supply
        self._settings = Settings(node)
        self._offsets: dict[Key, int] = {}
        self._offsets_back: list[Callable[[], None]] = []

    def put(self, what: str) -> frozenset[Key]:
        """Store every setting as it is and restart the node, which is Pre-operational then.

        Args:
            what: What shows no effect.

        Returns:
            The settings that do not hold any more what they held.

        Raises:
            SetupRefused: The bench does not allow it, or the node does not take it.
        """
        if not self._allowed:
            raise SetupRefused(
                f"{what} may act only after a store and a restart, which the bench does not allow"
            )
        wanted = self._settings.look()
        if not self._settings.found:
            self._begin(wanted)
        self._settings.save()
        self._restart()
        self._settings.write({key: data for key, data in wanted.items() if self._may_be_lost(key)})
        held = self._settings.read()
        return frozenset(key for key, data in wanted.items() if held.get(key) != data)

    def repeat(self) -> bool:
        """Do so again with what was written since, where it was needed before; tell whether it was."""
        needed = bool(self._settings.found)
        if needed:
            self.put("what was written")
        return needed

    def _begin(self, wanted: Values) -> None:
        offsets = list(all_offset_steps(self._node))
        self._settings.begin()
        self._offsets = read_offsets(self._node)
        self._offsets_back = list(all_offset_steps(self._node))
        self._settings.write(wanted)
        for step in reversed(offsets):
            step()

    def _restart(self) -> None:
        if self.by_supply:
            self._node.power_cycle()
        else:
            self._node.reset()

    def _may_be_lost(self, key: Key) -> bool:
        """Tell whether by any reading no store keeps a setting over a restart."""
        return not all(reading.persistent for reading in self._node.spec.entries[key].readings)

    @uninterrupted()
    def leave(self) -> None:
        """Give the node back what it had stored.

        Raises:
            SetupRefused: It does not take it.
        """
        if not self._settings.found:
            return
        try:
            if read_offsets(self._node) != self._offsets:
                for step in reversed(self._offsets_back):
                    step()
                self._settings.save()
        finally:
            self._settings.put_back()
            if self.by_supply:
                self._node.power_cycle()
