"""The lights of a simulated device: which are lit when, and what the faults of lights show instead."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby
from typing import Any, TypeAlias

import pytest

from conformance.simulator.interface import SimulatorBus

Open: TypeAlias = Callable[..., SimulatorBus]
Tell: TypeAlias = Callable[..., None]

GLANCE_MS = 10
IMS, DST = "siko_ims360", "danfoss_dst_x730:xy-30"
STOP = "000#0200"
START = "000#0100"
CONFIGURE = "7E5#0401000000000000"


def watch(bus: SimulatorBus, light: str, times_ms: int) -> list[int]:
    """Return how long a light is lit and dark in turn, the lit times positive, in ms."""
    seen = []
    for _ in range(times_ms // GLANCE_MS):
        seen.append(bus.lit(light))
        bus.recv(GLANCE_MS / 1000)
    runs = [(lit, len(list(run)) * GLANCE_MS) for lit, run in groupby(seen)]
    return [ms if lit else -ms for lit, ms in runs]


def beyond(bus: SimulatorBus) -> None:
    bus.set_tilt(40, 0)


@pytest.fixture
def shown(open_bus: Open, tell: Tell) -> Callable[..., list[int]]:
    """Opens a device, does something, and watches a light from a start of its pattern on."""

    def show(
        channel: str, does: str | Callable[[SimulatorBus], None], light: str, **options: Any
    ) -> list[int]:
        bus = open_bus(channel, **options)
        bus.recv(0.5)
        if isinstance(does, str):
            for step in does.split():
                tell(bus, step)
                bus.recv(0.01)
        else:
            does(bus)
        runs = watch(bus, light, 4000)
        return runs[1:-1] if len(runs) > 2 else runs

    return show


@pytest.mark.parametrize(
    ("channel", "does", "light", "runs"),
    [
        (IMS, "", "green", {200, -200}),
        (IMS, "", "red", {-4000}),
        (IMS, START, "green", {4000}),
        (IMS, STOP, "green", {200, -1000}),
        (IMS, CONFIGURE, "green", {50, -50}),
        (IMS, CONFIGURE, "red", {50, -50}),
        (DST, STOP, "green", {500, -500}),
        (DST, beyond, "green", {4000}),
        (DST, beyond, "red", {4000}),
        (DST, SimulatorBus.power_off, "green", {-4000}),
        (DST, "", "blue", {-4000}),
    ],
)
def test_a_light_shows_what_its_manual_says(
    shown: Callable[..., list[int]], channel: str, does: Any, light: str, runs: set[int]
) -> None:
    assert set(shown(channel, does, light)) == runs


@pytest.mark.parametrize(
    ("fault", "channel", "does", "light", "runs"),
    [
        ("light-on-in-stopped", IMS, STOP, "green", {4000}),
        ("light-red-without-error", IMS, "", "red", {4000}),
        ("light-without-supply", DST, SimulatorBus.power_off, "green", {4000}),
        ("lights-ignore-limits", DST, beyond, "red", {-4000}),
        ("lights-steady-in-lss", IMS, CONFIGURE, "red", {4000}),
    ],
)
def test_a_fault_of_the_lights_shows(
    shown: Callable[..., list[int]], fault: str, channel: str, does: Any, light: str, runs: set[int]
) -> None:
    assert set(shown(channel, does, light, faults=fault)) == runs


def test_another_reading_has_another_single_flash(shown: Callable[..., list[int]]) -> None:
    assert set(shown(DST, STOP, "green", readings={"DST-126": 2})) == {200, -1000}


def test_a_device_without_lights_shows_none(open_bus: Open) -> None:
    assert not open_bus("baumer_gim140r").lit("green")
