"""What a simulated bus offers beside frames; the simulator satisfies this by shape, near or far."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from conformance.spec.error_services import BusError


class Surroundings(Protocol):
    """What is around simulated devices."""

    def power_off(self) -> None:
        """Take the supply from every simulated device."""

    def power_on(self) -> None:
        """Give it back."""

    def connect(self, count: int) -> bool:
        """Supply the first so many devices and no other; tell whether there are that many."""

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        """Tilt every simulated device, in degrees."""

    def set_temperature(self, degc: float) -> None:
        """Set the temperature of every simulated device, in degrees Celsius."""

    def set_supply_voltage(self, volt: float) -> None:
        """Supply every simulated device with a voltage, in volts."""

    def at_rest(self) -> None:
        """Bring tilt, temperature and supply voltage back to what they were at first."""

    def lit(self, light: str) -> bool:
        """Tell whether a light of the first simulated device is lit now."""

    def label(self) -> str:
        """Return the serial number on the label of the first simulated device."""

    def disturb(self, error: BusError) -> None:
        """Destroy frames of every simulated device until its error counters have come so far."""

    def end_disturbance(self) -> None:
        """Let frames be again, so that the error counters go back."""

    def add_twin(self, serial_number: int) -> None:
        """Put another device like the first one on the bus, with its node-ID."""

    def remove_twin(self) -> None:
        """Take it away again."""


@runtime_checkable
class SimulatedRig(Surroundings, Protocol):
    """A bus that carries its own clock and its devices' surroundings."""

    @property
    def real_time(self) -> bool:
        """Simulated time follows the clock of the computer."""

    def now(self) -> float:
        """Return the simulated time in seconds."""

    def use_bitrate(self, bitrate: int) -> None:
        """Send and receive at another bit rate from now on, in bit/s."""

    @property
    def frame_count(self) -> int:
        """Frames on the bus so far."""
