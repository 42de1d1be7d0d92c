"""What brings the device to a temperature or a supply voltage: a person, or other people's Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol, get_args

from conformance.bench.definition import BenchDefinition, Exposed
from conformance.bench.surroundings.entry_points import called, made
from conformance.bench.surroundings.operator import Operator
from conformance.bench.who import MachineBy

GROUP: Final = "canopen_conformance."
METHODS: Final[Mapping[Exposed, str]] = {
    "temperature": "set_temperature",
    "supply": "set_supply_voltage",
}
"""What an entry point's object has for a quantity, beside `rest`."""


class Exposure(Protocol):
    """Exposes the device under test."""

    def set(self, value: float) -> None:
        """Bring the device to a temperature in degrees Celsius, or a supply voltage in volts."""

    def rest(self) -> None:
        """Bring it back to what is usual."""


class Exposing:
    """Exposes the device, unless it is exposed so already.

    Args:
        by: What exposes it.
        tolerance: By how much the quantity may be off, in kelvins or volts.
    """

    def __init__(self, by: Exposure, tolerance: float) -> None:
        self._by = by
        self.tolerance = tolerance
        self._value: float | None = None
        self._away = False

    def set(self, value: float) -> None:
        """Bring the device to a temperature in degrees Celsius, or a supply voltage in volts.

        Raises:
            BenchError: It cannot be brought there.
            SetupRefused: The person who does it does not answer.
        """
        if self._value != value:
            self._value, self._away = None, True
            self._by.set(value)
            self._value = value

    def rest(self) -> None:
        """Bring the device back to what is usual, where it is not."""
        if self._away:
            self._value = None
            self._by.rest()
            self._away = False


def exposings_of(
    definition: BenchDefinition, operator: Callable[[], Operator]
) -> Mapping[Exposed, Exposing]:
    """Return what exposes a bench's device to a quantity; none where nothing does or the simulator.

    Raises:
        BenchError: It is not there.
    """
    found: dict[Exposed, Exposing] = {}
    quantities: tuple[Exposed, ...] = get_args(Exposed)
    for quantity in quantities:
        by, off = definition.stimulus.get(quantity), definition.off(quantity)
        if isinstance(by, MachineBy):
            found[quantity] = Exposing(_ByEntryPoint(quantity, by.entry_point), off)
        elif by == "operator":
            found[quantity] = Exposing(_ByOperator(quantity, operator, off), off)
    return found


class _ByOperator:
    def __init__(
        self, quantity: Exposed, operator: Callable[[], Operator], tolerance: float
    ) -> None:
        self._quantity: Exposed = quantity
        self._operator = operator
        self._tolerance = tolerance

    def set(self, value: float) -> None:
        self._operator().expose(self._quantity, value, self._tolerance)

    def rest(self) -> None:
        self._operator().expose(self._quantity, None, self._tolerance)


class _ByEntryPoint:
    def __init__(self, quantity: Exposed, name: str) -> None:
        self._group, self._name = GROUP + quantity, name
        self._machine: Any = made(self._group, name, (METHODS[quantity], "rest"))
        self._set: Callable[[float], None] = getattr(self._machine, METHODS[quantity])

    def set(self, value: float) -> None:
        called(self._group, self._name, self._set, value)

    def rest(self) -> None:
        called(self._group, self._name, self._machine.rest)
