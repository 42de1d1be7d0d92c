"""What a test bench can do to the simulated nodes beside sending frames: power, tilt, temperature."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

from conformance.simulator.device import SimulatedDevice
from conformance.simulator.fault_files import load_faults
from conformance.simulator.segment import Segment
from conformance.spec.error_services import BusError


class SimulatorRig(ABC):
    """Power and stimulus of a simulated bus."""

    @abstractmethod
    def present(self) -> AbstractContextManager[Segment]:
        """Hold the bus, caught up with its clock."""

    def power_off(self) -> None:
        """Switch all nodes off."""
        with self.present() as bus:
            for node in bus.nodes:
                bus.power_off(node)

    def power_on(self) -> None:
        """Switch all nodes on."""
        with self.present() as bus:
            for node in bus.nodes:
                bus.power_on(node)

    def connect(self, count: int) -> bool:
        """Supply the first so many nodes and no other; tell whether there are that many."""
        with self.present() as bus:
            for place, node in enumerate(bus.nodes):
                (bus.power_on if place < count else bus.power_off)(node)
            return count <= len(bus.nodes)

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        """Tilt all nodes."""

        def tilt(node: SimulatedDevice) -> None:
            node.tilt(x_deg, y_deg)

        self._stimulate(tilt)

    def set_temperature(self, degc: float) -> None:
        """Bring all nodes to a temperature."""

        def heat(node: SimulatedDevice) -> None:
            node.world.temperature_degc = degc
            node.world_changed()

        self._stimulate(heat)

    def set_supply_voltage(self, volt: float) -> None:
        """Supply all nodes with a voltage."""

        def supply(node: SimulatedDevice) -> None:
            node.world.supply_v = volt
            node.world_changed()

        self._stimulate(supply)

    def at_rest(self) -> None:
        """Bring all nodes' surroundings back to what they were at first."""

        def rest(node: SimulatedDevice) -> None:
            node.rest()

        self._stimulate(rest)

    def lit(self, light: str) -> bool:
        """Tell whether a light of the first node is lit now."""
        with self.present() as bus:
            return bus.nodes[0].lit(light, bus.now_ns)

    def label(self) -> str:
        """Return the serial number on the label of the first node."""
        with self.present() as bus:
            return str(bus.nodes[0].memory.serial_number)

    def disturb(self, error: BusError) -> None:
        """Destroy frames of all nodes until their error counters have come so far."""
        self._stimulate(lambda node: node.disturb(error))

    def end_disturbance(self) -> None:
        """Let the frames of all nodes be."""
        self._stimulate(lambda node: node.end_disturbance())

    def add_twin(self, serial_number: int) -> None:
        """Put another node like the first one on the bus, with its node-ID."""
        with self.present() as bus:
            bus.add_node(bus.nodes[0].twin(serial_number))

    def remove_twin(self) -> None:
        """Take the last node off the bus again."""
        with self.present() as bus:
            bus.remove_node(bus.nodes[-1])

    def raise_error(self, code: int, bit: int | None = None) -> None:
        """Let an error occur in all nodes: its error code, its bit of the manufacturer code."""
        self._stimulate(lambda node: node.raise_error(code, bit))

    def clear_error(self, code: int, bit: int | None = None) -> None:
        """Let an error go in all nodes."""
        self._stimulate(lambda node: node.clear_error(code, bit))

    def use_faults(self, names: list[str]) -> None:
        """Give all nodes these defects instead of those they have, as another firmware would.

        Args:
            names: As `--fault` takes them; none for nodes as documented.
        """
        faults = load_faults(names)
        with self.present() as segment:
            for node in segment.nodes:
                segment.power_off(node)
                node.use_faults(faults)
                segment.power_on(node)

    def held(self) -> list[dict[str, Any]]:
        """Return what each node holds: node-ID, bit rate, non-volatile memory, changed values."""
        with self.present() as segment:
            return [node.held() for node in segment.nodes]

    def bus_load(self) -> float:
        """Return the share of the last second that frames took, 0.0 to 1.0."""
        with self.present() as bus:
            return bus.load()

    @property
    def frame_count(self) -> int:
        """Frames on the bus so far, of everybody."""
        with self.present() as bus:
            return bus.frame_count

    def _stimulate(self, act: Callable[[SimulatedDevice], None]) -> None:
        with self.present() as bus:
            for node in bus.nodes:
                bus.stimulate(node, act)
