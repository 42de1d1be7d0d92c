"""Rules between objects: one value with several addresses, pairs, status bits, reset commands."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from conformance.simulator.live import clipped
from conformance.simulator.node import Node
from conformance.spec.behaviours import Paired, ResetCommand, SameValue, StatusBit, StatusBits
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Key
from conformance.wire.datatypes import Value

RESET_DELAY_NS: Final = 5_000_000
"""From a command that resets the node to the reset, so that its answer is on the bus before."""


def follow_rules(
    node: Node,
    spec: DeviceSpec,
    reset: Callable[[], None],
    has_error: Callable[[int], bool],
) -> None:
    """Let the rules of a spec hold, apart from those on slopes.

    Args:
        node: The node.
        spec: The spec.
        reset: Restarts the node.
        has_error: Tells whether the error with a code is present.
    """
    dictionary = node.dictionary
    for entry in dictionary.entries.values():
        if entry.kind == "command" and entry.writable and entry.key not in dictionary.actions:
            dictionary.actions[entry.key] = _do_nothing
    for rule in spec.behaviours.values():
        match rule:
            case SameValue() if not node.faults.twins_apart:
                _SameValue(node, [key_of(it) for it in rule.objects])
            case Paired() if rule.reads == "in-force":
                _Pair(node, [key_of(it) for it in rule.objects])
            case ResetCommand():
                act = partial(_reset_on, node, rule.value, reset)
                dictionary.actions[key_of(rule.command)] = act
            case StatusBits():
                read = partial(_status, node, rule, has_error)
                dictionary.computed[key_of(rule.object)] = read
            case _:
                pass


def _do_nothing(_value: Value) -> None:
    """Act on a command that changes nothing of what is simulated."""


def _reset_on(node: Node, wanted: int, reset: Callable[[], None], value: Value) -> None:
    if value == wanted and not node.faults.reset_command_ignored:
        node.agenda.after(RESET_DELAY_NS, reset)


def _status(node: Node, rule: StatusBits, has_error: Callable[[int], bool]) -> int:
    def is_set(meaning: StatusBit) -> bool:
        if meaning.object is not None:
            return node.dictionary.number(*key_of(meaning.object)) == meaning.value
        if meaning.factory_settings:
            return _has_factory_settings(node)
        return any(has_error(code) for code in meaning.errors)

    if node.faults.status_bits_set:
        return 0xFF
    return sum(1 << bit for bit, meaning in rule.bits.items() if is_set(meaning))


def _has_factory_settings(node: Node) -> bool:
    entries = node.dictionary.entries
    return all(entries[key].kind != "config" for key in node.dictionary.changed())


class _SameValue:
    """Writes what one of some objects is given to the others, as far as their types go."""

    def __init__(self, node: Node, keys: list[Key]) -> None:
        self._dictionary = node.dictionary
        self._keys = keys
        self._busy = False
        for key in keys:
            node.dictionary.observers[key].append(partial(self._written, key))

    def _written(self, source: Key, value: Value) -> None:
        if self._busy:
            return
        self._busy = True
        for key in self._keys:
            if key != source:
                entry = self._dictionary.entries[key]
                self._dictionary.set(key, clipped(entry, int(value)))
        self._busy = False


class _Pair:
    """Keeps both objects of a pair as they are until both have been given the same value."""

    def __init__(self, node: Node, keys: list[Key]) -> None:
        self._dictionary = node.dictionary
        self._given: dict[Key, Value] = {}
        self._keys = keys
        for key in keys:
            node.dictionary.actions[key] = partial(self._written, key)

    def _written(self, key: Key, value: Value) -> None:
        self._given[key] = value
        if len(self._given) == len(self._keys) and len(set(self._given.values())) == 1:
            self._given.clear()
            for each in self._keys:
                self._dictionary.set(each, value)
