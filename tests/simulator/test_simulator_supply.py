"""A simulated device whose supply is too low, by its manual or by a defect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conformance.simulator.interface import SimulatorBus

ROTA = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"
TOLD, GONE, BOOT_UP = "0A0#0031810000000000", "0A0#0000000000000000", "720#00"
HEARTBEAT = "720#7F"


@pytest.mark.parametrize(
    ("fault", "volt", "heard"),
    [
        ("", 10.0, []),
        ("", 9.9, [TOLD, GONE]),
        ("supply-error-early", 10.4, [TOLD, GONE]),
        ("supply-error-early", 10.5, []),
        ("supply-restarts-early", 10.4, [BOOT_UP]),
    ],
)
def test_what_a_supply_voltage_leads_to(
    open_bus: Callable[..., SimulatorBus],
    hear: Callable[[SimulatorBus, float], list[str]],
    fault: str,
    volt: float,
    heard: list[str],
) -> None:
    bus = open_bus(str(ROTA), faults=fault)
    hear(bus, 0.5)
    bus.set_supply_voltage(volt)
    frames = hear(bus, 0.5)
    bus.at_rest()
    frames += hear(bus, 0.5)
    assert [frame for frame in frames if frame != HEARTBEAT] == heard
