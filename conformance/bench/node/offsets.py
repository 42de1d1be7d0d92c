"""How the offsets of slopes come back that a preset or a new resolution has overwritten (CiA 410).

A preset acts when it is written, so writing the old one back does not undo it; an offset that cannot
be written is brought back by a preset again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

from conformance.errors import SetupRefused
from conformance.spec.behaviours import Slope
from conformance.spec.fields import key_of
from conformance.spec.model import Key

if TYPE_CHECKING:
    from conformance.bench.node.node import Node

_MOST_PRESETS = 10


def offset_steps(node: Node, key: Key) -> Iterator[Callable[[], None]]:
    """Return what brings the offsets back that a download to an entry may change.

    The offsets of the widest types are brought back last.
    """
    written = set(node.spec.companions(key))
    for rule in _slopes(node):
        if written & {key_of(it) for it in (rule.preset, rule.resolution) if it is not None}:
            yield from _steps(node, rule)


def all_offset_steps(node: Node) -> Iterator[Callable[[], None]]:
    """Return what brings every offset back to what it is now, the widest types last."""
    for rule in _slopes(node):
        yield from _steps(node, rule)


def read_offsets(node: Node) -> dict[Key, int]:
    """Return what the offsets hold that the node has."""
    keys = [key_of(rule.offset) for rule in _slopes(node) if rule.offset is not None]
    return {key: node.number(*key) for key in keys if not node.spec.entries[key].optional}


def bring_back(node: Node, wanted: Mapping[Key, int]) -> None:
    """Bring offsets back to what they were, by presets where no download can.

    Raises:
        SetupRefused: One does not become what it was.
    """
    for rule in _slopes(node):
        if rule.offset is not None and key_of(rule.offset) in wanted:
            key = key_of(rule.offset)
            _put_back(node, rule, key, node.number(*key_of(rule.value)), wanted[key])


def _slopes(node: Node) -> list[Slope]:
    """Return the rules on slopes, those of the widest types first: steps are taken back from the end."""
    rules = [rule for rule in node.spec.behaviours.values() if isinstance(rule, Slope)]
    return sorted(rules, key=lambda rule: -_octets(node, rule))


def _octets(node: Node, rule: Slope) -> int:
    return node.spec.entries[key_of(rule.value)].type.size or 0


def _steps(node: Node, rule: Slope) -> Iterator[Callable[[], None]]:
    if rule.offset is None:
        return
    try:
        shown, before = (node.number(*key_of(it)) for it in (rule.value, rule.offset))
    except SetupRefused:
        return
    yield partial(_put_back, node, rule, key_of(rule.offset), shown, before)
    differential = node.spec.entry(*key_of(rule.differential_offset or rule.offset))
    if rule.differential_offset is not None and differential is not None and differential.writable:
        yield partial(node.put_back, differential.key, node.upload(*differential.key))


def _put_back(node: Node, rule: Slope, key: Key, shown: int, before: int) -> None:
    """Bring an offset back by a download, or by presets that make the slope show what it showed.

    Raises:
        SetupRefused: It does not become what it was.
    """
    entry = node.spec.entries[key]
    if entry.writable and node.number(*key) != before:
        node.write(*key, entry.type.encode(before))
    preset = shown
    for _ in range(_MOST_PRESETS):
        now = node.number(*key)
        if now == before:
            return
        if rule.preset is None:
            break
        place = node.spec.entries[key_of(rule.preset)]
        node.put_back(place.key, place.type.encode(preset))
        preset += before - node.number(*key)
    raise SetupRefused(f"{entry.address} does not become {before} again")
