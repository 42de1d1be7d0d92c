"""Zero points that a preset set: whether a store keeps them, and a restore takes them away (CiA 410)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.node.offsets import offset_steps
from conformance.bench.settings.settings import Settings
from conformance.errors import SetupRefused
from conformance.spec.document import Store
from conformance.spec.model import Key

SHIFT = 7
"""Steps by which a preset moves the slope."""


@dataclass(frozen=True, slots=True)
class ZeroPoint:
    """Where a slope's zero point is set and seen.

    Args:
        value: The slope.
        preset: The object that sets it.
        offset: The object that shows it, and that no download changes.
    """

    value: Key
    preset: Key
    offset: Key


@dataclass(frozen=True, slots=True)
class Tried:
    """What became of zero points, by preset and offset.

    Args:
        found: What they held before.
        stored: What they held when they were stored.
        after: After the restart.
        restored: After a restore and another restart.
    """

    found: Mapping[Key, int]
    stored: Mapping[Key, int]
    after: Mapping[Key, int]
    restored: Mapping[Key, int]


def observe_zero_points(node: Node, points: Sequence[ZeroPoint], restore: Store, sub: int) -> Tried:
    """Move zero points by presets, store and restart, restore and restart.

    Args:
        node: The node under test, left as it was.
        points: All its zero points.
        restore: What takes them away again.
        sub: Its sub-index that does so.
    """
    settings = Settings(node)
    back: list[Callable[[], None]] = []
    try:
        settings.begin()
        found = _read(node, points)
        for point in points:
            back += offset_steps(node, point.preset)
            _preset(node, point, node.number(*point.value) + SHIFT)
        stored = _read(node, points)
        _save(node, settings, points)
        node.reset()
        after = _read(node, points)
        restored = _restored(node, settings, points, restore, sub)
        return Tried(found, stored, after, restored)
    finally:
        if back and any(node.number(*point.offset) for point in points):
            for step in reversed(back):
                step()
            _save(node, settings, points)
        settings.put_back()


def _preset(node: Node, point: ZeroPoint, steps: int) -> None:
    entry = node.spec.entries[point.preset]
    answer = node.write(*point.preset, entry.type.encode(steps))
    if not answer.confirmed or not node.number(*point.offset):
        raise SetupRefused(f"a preset of {steps} has no effect ({answer}), see DEV-11")


def _restored(
    node: Node, settings: Settings, points: Sequence[ZeroPoint], restore: Store, sub: int
) -> Mapping[Key, int]:
    """Return what is left after a restore, with a store before the restart where it takes one."""
    held: Mapping[Key, int] = {}
    for save in (False, True):
        node.download(restore.object, sub, restore.word)
        if save:
            _save(node, settings, points)
        node.reset()
        held = _read(node, points)
        if not any(held.values()):
            break
    return held


def _save(node: Node, settings: Settings, points: Sequence[ZeroPoint]) -> None:
    indices = {index for point in points for index, _ in (point.preset, point.offset)}
    node.save({index for index, _ in settings.found} | indices)


def _read(node: Node, points: Sequence[ZeroPoint]) -> dict[Key, int]:
    return {key: node.number(*key) for point in points for key in (point.preset, point.offset)}
