"""The receive buffer of a simulated device that is too slow for a full bus, and its overrun."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from conformance.simulator.emcy import EmcyProducer
from conformance.simulator.node import Node
from conformance.spec.document import Services
from conformance.wire.nmt import NmtCommand

OVERRUN: Final = 0x8110
GENERIC: Final = 0x1000

HANDLING_BITS: Final = 250
"""How long a frame keeps the device busy: longer than one takes on a full bus, less than an SDO transfer."""

PLACES: Final = 16
"""Frames that may wait for being handled; what comes on top of them is lost."""

_SECOND: Final = 1_000_000_000


class ReceiveBuffer:
    """Takes frames as long as there is room; a device as documented always has some.

    Args:
        node: The node.
        services: What the manual says.
        bitrate: Of the device from the factory, in bit/s.
        emcy: Tells the overrun.
        reset: Resets the node.
    """

    def __init__(
        self,
        node: Node,
        services: Services,
        bitrate: int,
        emcy: EmcyProducer,
        reset: Callable[[NmtCommand], None],
    ) -> None:
        self._node = node
        self._emcy = emcy
        self._reset = reset
        self._handling_ns = HANDLING_BITS * _SECOND // bitrate
        self._busy_until_ns = 0
        self._deaf = False
        producer, bus_errors = services.emcy_producer, services.bus_errors
        self._code = OVERRUN if producer is None or OVERRUN in producer.codes else GENERIC
        self._bits = bus_errors.register_bits if bus_errors is not None else ()
        self._timer = node.agenda.timer(self._catch_up)

    def takes(self) -> bool:
        """Tell whether there is room for a frame that comes now."""
        if self._node.faults.overrun is None:
            return True
        now_ns = self._node.agenda.now_ns
        self._busy_until_ns = max(self._busy_until_ns, now_ns)
        if self._busy_until_ns - now_ns >= PLACES * self._handling_ns:
            self._overrun()
            return False
        self._busy_until_ns += self._handling_ns
        return not self._deaf

    def _overrun(self) -> None:
        match self._node.faults.overrun:
            case "told":
                self._emcy.raise_error(self._code, register=self._bits)
                self._timer.start(self._busy_until_ns)
            case "restarts":
                self._reset(NmtCommand.RESET_NODE)
            case _:
                self._deaf = True

    def _catch_up(self, due_ns: int) -> None:
        """End the overrun once every frame is handled."""
        if due_ns < self._busy_until_ns:
            self._timer.start(self._busy_until_ns)
        else:
            self._emcy.clear_error(self._code)
