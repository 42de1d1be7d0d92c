"""What tilts the device: the simulator, a person, or other people's Python; and how exactly."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from conformance.bench.definition import BenchDefinition
from conformance.bench.surroundings.entry_points import called, made
from conformance.bench.surroundings.operator import Operator
from conformance.bench.who import MachineBy

GROUP: Final = "canopen_conformance.tilt"
LEVEL: Final = (0.0, 0.0)


class Tilt(Protocol):
    """Tilts the device under test."""

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        """Tilt the device about its axes, in degrees."""


class Tilting:
    """Tilts the device, unless it is tilted so already.

    Args:
        tilt: What tilts it.
        tolerance_deg: By how much each axis may be off, in degrees.
    """

    def __init__(self, tilt: Tilt, tolerance_deg: float) -> None:
        self._tilt = tilt
        self.tolerance_deg = tolerance_deg
        self._place: tuple[float, float] | None = None

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        """Tilt the device about its axes, in degrees.

        Raises:
            BenchError: It cannot be tilted.
            SetupRefused: The person who tilts it does not answer.
        """
        if self._place != (x_deg, y_deg):
            self._place = None
            self._tilt.set_tilt(x_deg, y_deg)
            self._place = (x_deg, y_deg)

    def level(self) -> None:
        """Level the device."""
        self.set_tilt(*LEVEL)

    def forget(self) -> None:
        """Take it that somebody else has tilted the device."""
        self._place = None


def tilting_of(definition: BenchDefinition, operator: Callable[[], Operator]) -> Tilting | None:
    """Return what tilts a bench's device, None where nothing does or the simulator.

    Raises:
        BenchError: It is not there.
    """
    by, off_deg = definition.stimulus.get("tilt"), definition.off("tilt")
    if isinstance(by, MachineBy):
        return Tilting(_ByEntryPoint(by.entry_point), off_deg)
    if by == "operator":
        return Tilting(_ByOperator(operator, off_deg), off_deg)
    return None


class _ByOperator:
    def __init__(self, operator: Callable[[], Operator], tolerance_deg: float) -> None:
        self._operator = operator
        self._tolerance_deg = tolerance_deg

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        self._operator().tilt(x_deg, y_deg, self._tolerance_deg)


class _ByEntryPoint:
    def __init__(self, name: str) -> None:
        self._name = name
        self._tilt: Tilt = made(GROUP, name, ("set_tilt",))

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        called(GROUP, self._name, self._tilt.set_tilt, x_deg, y_deg)
