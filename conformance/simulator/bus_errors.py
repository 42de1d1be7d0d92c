"""What a simulated device makes of errors on the bus: EMCY, and leaving bus-off (ISO 11898-1)."""

from __future__ import annotations

from conformance.simulator.emcy import EmcyProducer
from conformance.simulator.node import Node
from conformance.spec.error_services import BusError
from conformance.spec.error_services import BusErrors as BusErrorsSpec
from conformance.spec.fields import key_of


class BusErrors:
    """Follows the state of the CAN controller.

    Args:
        node: The node.
        spec: What the manual says of bus errors; None where it says nothing.
        emcy: Tells them.
    """

    def __init__(self, node: Node, spec: BusErrorsSpec | None, emcy: EmcyProducer) -> None:
        self._node = node
        self._spec = spec
        self._emcy = emcy

    @property
    def recovers(self) -> bool:
        """Whether the node leaves bus-off by itself."""
        if self._node.faults.bus_off_recovery is not None:
            return self._node.faults.bus_off_recovery
        rule = self._spec.recovery if self._spec is not None else None
        return rule is None or self._node.dictionary.number(*key_of(rule.object)) == rule.value

    def passive(self) -> None:
        """The controller has become error passive."""
        if self._spec is not None and "error-passive" not in self._node.faults.bus_errors_untold:
            self._emcy.raise_error(self._spec.error_passive, register=self._spec.register_bits)

    def over(self, error: BusError) -> None:
        """The controller is error active again."""
        if self._spec is None:
            return
        self._emcy.clear_error(self._spec.error_passive)
        untold = self._node.faults.bus_errors_untold
        code = self._spec.after_bus_off
        if error == "bus-off" and code is not None and "after-bus-off" not in untold:
            self._emcy.tell(code)
