"""The node started with settings stored or not: what it does by itself, before anyone asks it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import HeartbeatPort
from conformance.bench.settings.settings import Settings
from conformance.errors import SetupRefused
from conformance.spec.fields import key_of
from conformance.spec.services import StartBy
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand

Restart: TypeAlias = Literal["reset-node", "reset-communication", "power-on"]
_COMMANDS: Mapping[Restart, NmtCommand] = {
    "reset-node": NmtCommand.RESET_NODE,
    "reset-communication": NmtCommand.RESET_COMMUNICATION,
}
_FIRST_S = 0.5
"""How long what a node sends by itself after its start is waited for."""


@dataclass(frozen=True, slots=True)
class Beating:
    """The heartbeats after a restart.

    Args:
        held_ms: The producer heartbeat time that the node then holds.
        boot_up: Its boot-up message, if there is one.
        beats: What came after that, until the time was over.
    """

    held_ms: int
    boot_up: Stamped | None
    beats: Sequence[Stamped]


@dataclass(frozen=True, slots=True)
class Started:
    """A start with the start object at a value.

    Args:
        state: The NMT state afterwards.
        tpdos: TPDOs that came before anyone spoke to the node.
    """

    state: str
    tpdos: int


def begin_restart(node: Node, how: Restart) -> int:
    """Restart the node; return the mark since which it may be back."""
    if how == "power-on":
        return node.begin_power_cycle()
    return node.begin_reset(_COMMANDS[how])


def restarted_heartbeat(
    node: Node, heartbeat: HeartbeatPort, how: Restart, count: int, *, save: bool
) -> Beating:
    """Write a heartbeat time, store it or not, restart the node and listen; undone afterwards.

    Raises:
        SetupRefused: The node does not take the time.
    """
    settings, index = Settings(node), heartbeat.producer.object
    data = node.spec.entries[index, 0].type.encode(heartbeat.typical_ms)
    try:
        settings.begin()
        if not node.write(index, 0, data).confirmed:
            raise SetupRefused("the node does not take a typical heartbeat time, see OD-11")
        if save:
            node.save({index})
        mark = begin_restart(node, how)
        node.await_boot_up(mark)
        boot_ups = node.link.since(mark, node.is_boot_up)
        beats = heartbeat.collect(count, 2 * count * heartbeat.typical_ms / 1000)
        return Beating(node.number(index), boot_ups[0] if boot_ups else None, beats)
    finally:
        settings.put_back()


def start_values(rule: StartBy, present: int) -> tuple[int, int]:
    """Return the value of the start object by which the node starts by itself, and one by which not."""
    starts = present & ~rule.mask | rule.value
    return starts, starts ^ (rule.mask & -rule.mask)


def observe_starts(
    node: Node, heartbeat: HeartbeatPort, rule: StartBy, restarts: Sequence[Restart]
) -> dict[tuple[Restart, bool], Started]:
    """Store both values of the start object in turn and restart the node; undone afterwards.

    Returns:
        By the restart and whether the value is the one to start by itself.
    """
    key, settings = key_of(rule.object), Settings(node)
    seen: dict[tuple[Restart, bool], Started] = {}
    try:
        settings.begin()
        for value, starts in zip(start_values(rule, node.number(*key)), (True, False), strict=True):
            node.reset()
            node.write(*key, node.spec.entries[key].type.encode(value))
            node.save({key[0]})
            for how in restarts:
                seen[how, starts] = _started(node, heartbeat, how)
    finally:
        settings.put_back()
    return seen


def _started(node: Node, heartbeat: HeartbeatPort, how: Restart) -> Started:
    mark = begin_restart(node, how)
    node.await_boot_up(mark)
    tpdos = node.link.listen(_FIRST_S, lambda frame: _is_tpdo(frame, node.node_id))
    return Started(heartbeat.state(), len(tpdos))


def _is_tpdo(frame: Frame, node_id: int) -> bool:
    return frame.can_id in {cob_id.tpdo(number, node_id) for number in range(1, 5)}
