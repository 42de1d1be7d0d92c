"""Commands: entries whose download does something, such as zeroing an axis or resetting the node."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Final

from conformance.simulator.live import TILTS, LiveValues, World, clipped, counts, physical_deg
from conformance.simulator.node import Node
from conformance.spec.document import Follows
from conformance.spec.model import Entry
from conformance.wire.datatypes import Value

RESET_DELAY_NS: Final = 5_000_000
"""From a command that resets the node to the reset, so that its answer is on the bus before."""

_RESET: Final = re.compile(r"\breset", re.IGNORECASE)


class Commands:
    """The command entries of a node, except those of the store and restore services.

    A command that ``affects`` objects zeroes the tilt axes whose bits its value has set; the first
    object affected belongs to the first axis, and so on. An object affected that is a setting holds
    the axis's offset. A command whose documented value speaks of a reset resets the node.
    """

    def __init__(
        self, node: Node, world: World, live: LiveValues, reset: Callable[[], None]
    ) -> None:
        self._node = node
        self._world = world
        self._live = live
        self._reset = reset
        self._hidden_deg: dict[Follows, float] = {}
        for entry in node.dictionary.entries.values():
            if entry.kind != "command" or not entry.writable:
                continue
            if entry.affects:
                self._link_offsets(entry)
                node.dictionary.actions[entry.key] = partial(self._zero, entry)
            else:
                node.dictionary.actions[entry.key] = partial(self._run, entry)

    def _run(self, entry: Entry, value: Value) -> None:
        meaning = (entry.values or {}).get(int(value), "") if entry.type.is_integer else ""
        if _RESET.search(meaning):
            self._node.agenda.after(RESET_DELAY_NS, self._reset)

    def _link_offsets(self, command: Entry) -> None:
        for axis, offset in self._offsets(command):
            if offset is None:
                self._hidden_deg[axis] = 0.0
                self._live.offsets_deg[axis] = partial(self._hidden_deg.__getitem__, axis)
            else:
                self._live.offsets_deg[axis] = partial(self._stored_deg, offset)

    def _stored_deg(self, offset: Entry) -> float:
        return physical_deg(offset, self._node.dictionary.number(*offset.key))

    def _zero(self, command: Entry, value: Value) -> None:
        if self._node.faults.zero_command_ignored:
            return
        for place, (axis, offset) in enumerate(self._offsets(command)):
            if not int(value) >> place & 1:
                continue
            zero_deg = -self._world.tilt_deg(axis)
            if offset is None:
                self._hidden_deg[axis] = zero_deg
            else:
                raw = clipped(offset, counts(offset, zero_deg))
                self._node.dictionary.set(offset.key, raw)

    def _offsets(self, command: Entry) -> list[tuple[Follows, Entry | None]]:
        """Return the axes that a command can zero, each with the setting that holds its offset."""
        entries = self._node.dictionary.entries
        result: list[tuple[Follows, Entry | None]] = []
        for axis, index in zip(TILTS, command.affects, strict=False):
            entry = entries.get((index, 0))
            result.append((axis, entry if entry is not None and entry.kind == "config" else None))
        return result
