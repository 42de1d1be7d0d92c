"""A node that does not leave bus-off by itself: brought there, and back by its supply."""

from __future__ import annotations

from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.settings import Settings
from conformance.errors import SetupRefused
from conformance.spec.model import Key


@dataclass(frozen=True, slots=True)
class Stayed:
    """When the node answered.

    Args:
        before: After bus-off, before its supply was switched.
        after: After that.
    """

    before: bool
    after: bool


def observe_without_recovery(
    node: Node, stimulus: Stimulus, key: Key, value: int, *, wait_s: float
) -> Stayed:
    """Store another setting, bring the node to bus-off and switch its supply; the setting is put back.

    Args:
        node: The node under test.
        stimulus: What disturbs the bus.
        key: The setting of the recovery.
        value: Its value without recovery.
        wait_s: How long the node has to come back all the same.
    """
    data = node.spec.entries[key].type.encode(value)
    settings = Settings(node)
    try:
        settings.begin()
        settings.write({key: data})
        settings.save()
        node.reset()
        if node.upload(*key) != data:
            raise SetupRefused(f"{node.spec.entries[key].address} does not take {value}, see OD-11")
        with stimulus.bus_error("bus-off"):
            pass
        node.link.listen(wait_s, lambda _: False)
        before = node.answers()
        node.power_cycle()
        return Stayed(before, node.answers())
    finally:
        settings.put_back()
