"""What can be done to simulated devices of another process beside sending frames, each by a call that goes there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

from conformance.spec.error_services import BusError


class RigCalls(ABC):
    """Power, tilt, temperature, supply voltage, lights and the bus of simulated devices elsewhere."""

    @abstractmethod
    def _call(self, name: str, *arguments: object) -> Any:
        """Have the other process do something, and return its answer."""

    def power_off(self) -> None:
        """Take the supply from every simulated device."""
        self._call("power_off")

    def power_on(self) -> None:
        """Give it back."""
        self._call("power_on")

    def connect(self, count: int) -> bool:
        """Supply the first so many devices and no other; tell whether there are that many."""
        return bool(self._call("connect", count))

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        """Tilt every simulated device, in degrees."""
        self._call("set_tilt", x_deg, y_deg)

    def set_temperature(self, degc: float) -> None:
        """Set the temperature of every simulated device, in degrees Celsius."""
        self._call("set_temperature", degc)

    def set_supply_voltage(self, volt: float) -> None:
        """Supply every simulated device with a voltage, in volts."""
        self._call("set_supply_voltage", volt)

    def at_rest(self) -> None:
        """Bring tilt, temperature and supply voltage back to what they were at first."""
        self._call("at_rest")

    def lit(self, light: str) -> bool:
        """Tell whether a light of the first simulated device is lit now."""
        return bool(self._call("lit", light))

    def label(self) -> str:
        """Return the serial number on the label of the first simulated device."""
        return str(self._call("label"))

    def disturb(self, error: BusError) -> None:
        """Destroy frames of every simulated device until its error counters have come so far."""
        self._call("disturb", error)

    def end_disturbance(self) -> None:
        """Let frames be again, so that the error counters go back."""
        self._call("end_disturbance")

    def add_twin(self, serial_number: int) -> None:
        """Put another device like the first one on the bus, with its node-ID."""
        self._call("add_twin", serial_number)

    def remove_twin(self) -> None:
        """Take it away again."""
        self._call("remove_twin")
