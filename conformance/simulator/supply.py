"""The supply of a simulated device: what it makes of too low a voltage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from conformance.simulator.emcy import EmcyProducer
from conformance.simulator.live import World
from conformance.simulator.node import Node
from conformance.spec.document import Services
from conformance.wire.nmt import NmtCommand

SUPPLY: Final = 0x3100
EARLY_V: Final = 0.5
"""How far above the least documented voltage a defective device finds its supply too low."""


class SupplyMonitor:
    """Tells a supply voltage below the documented range, where the manual has a code for it.

    Args:
        node: The node.
        services: What the manual says.
        world: What the device is supplied with.
        emcy: Tells the error.
        reset: Resets the node.
    """

    def __init__(
        self,
        node: Node,
        services: Services,
        world: World,
        emcy: EmcyProducer,
        reset: Callable[[NmtCommand], None],
    ) -> None:
        self._world = world
        self._emcy = emcy
        self._reset = reset
        self._early = node.faults.supply_too_low_early
        producer, supply = services.emcy_producer, services.supply
        self._told = producer is not None and SUPPLY in producer.codes
        self._least_v = 0.0 if supply is None else supply.min_v + (EARLY_V if self._early else 0.0)

    def update(self) -> None:
        """Find out whether the supply is too low."""
        if self._world.supply_v >= self._least_v:
            self._emcy.clear_error(SUPPLY)
        elif self._early == "restarts":
            self._reset(NmtCommand.RESET_NODE)
        elif self._told:
            self._emcy.raise_error(SUPPLY)
