"""What a bench can change around the device: tilt, temperature, supply voltage, a second node."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType

from conformance.bench.bus.link import Link
from conformance.bench.definition import Exposed
from conformance.bench.sensor.settling import Settling
from conformance.bench.surroundings.exposing import Exposing
from conformance.bench.surroundings.rig import Surroundings
from conformance.bench.surroundings.tilting import Tilting
from conformance.errors import SetupRefused
from conformance.spec.error_services import BusError

SETTLE_S = 0.1
"""From a change to the first value that is judged, beside the device's own filter."""


class Stimulus:
    """Changes the quantities that the device measures.

    Args:
        link: The link to the bus; a simulated one carries its devices' surroundings.
        settling: What waits for the device's filters.
        tilting: What tilts the device; None where the simulator does.
        exposings: What exposes it to which other quantity; the simulator where nothing else does.
    """

    def __init__(
        self,
        link: Link,
        settling: Settling,
        tilting: Tilting | None = None,
        exposings: Mapping[Exposed, Exposing] = MappingProxyType({}),
    ) -> None:
        self._link = link
        self._settling = settling
        self._tilting = tilting
        self._exposings = exposings
        self._changed = False

    @property
    def tolerance_deg(self) -> float:
        """By how much a tilt about either axis may be off, in degrees."""
        return 0.0 if self._tilting is None else self._tilting.tolerance_deg

    @property
    def tolerance_k(self) -> float:
        """By how much a temperature may be off, in kelvins."""
        return self._off("temperature")

    @property
    def tolerance_v(self) -> float:
        """By how much a supply voltage may be off, in volts."""
        return self._off("supply")

    def _off(self, quantity: Exposed) -> float:
        by = self._exposings.get(quantity)
        return 0.0 if by is None else by.tolerance

    def tilt(self, x_deg: float, y_deg: float = 0.0) -> None:
        """Tilt the device and let it settle, its filters included."""
        self._tilt(x_deg, y_deg)
        self._settle()
        self._settling.wait()

    def turn(self, x_deg: float, y_deg: float) -> float:
        """Tilt the device and return at once, with the time at which it was tilted."""
        self._tilt(x_deg, y_deg)
        return self._link.now()

    def _tilt(self, x_deg: float, y_deg: float) -> None:
        self._changed = True
        if self._tilting is None:
            self._rig.set_tilt(x_deg, y_deg)
            return
        self._link.interventions += 1
        self._tilting.set_tilt(x_deg, y_deg)

    def temperature(self, degc: float) -> None:
        """Bring the device to a temperature and let it settle."""
        if not self._exposed("temperature", degc):
            self._rig.set_temperature(degc)
        self._settle()

    def supply(self, volt: float) -> None:
        """Supply the device with a voltage and let it settle."""
        if not self._exposed("supply", volt):
            self._rig.set_supply_voltage(volt)
        self._settle()

    def _exposed(self, quantity: Exposed, value: float) -> bool:
        """Expose the device; tell whether something other than the simulator does."""
        by = self._exposings.get(quantity)
        if by is None:
            return False
        self._changed = True
        self._link.interventions += 1
        by.set(value)
        return True

    @contextmanager
    def second_node(self, serial_number: int) -> Iterator[None]:
        """Have another node of the same kind and node-ID on the bus."""
        rig = self._rig
        rig.add_twin(serial_number)
        try:
            yield
        finally:
            rig.remove_twin()

    @contextmanager
    def bus_error(self, error: BusError) -> Iterator[None]:
        """Have the device's frames destroyed until its error counters have come so far."""
        rig = self._rig
        rig.disturb(error)
        try:
            self._link.listen(SETTLE_S, lambda _: False)
            yield
        finally:
            rig.end_disturbance()
            self._link.listen(SETTLE_S, lambda _: False)

    def rest(self) -> None:
        """Bring everything back to where it was."""
        if self._changed:
            for by in self._exposings.values():
                by.rest()
            if self._link.rig is not None:
                self._rig.at_rest()
                if self._tilting is not None:
                    self._tilting.forget()
            elif self._tilting is not None:
                self._tilting.level()
            self._settle()
            self._settling.wait()
            self._changed = False

    @property
    def _rig(self) -> Surroundings:
        if self._link.rig is None:
            raise SetupRefused("the bench cannot change what is around the device")
        self._link.interventions += 1
        return self._link.rig

    def _settle(self) -> None:
        self._changed = True
        self._link.listen(SETTLE_S, lambda _: False)
