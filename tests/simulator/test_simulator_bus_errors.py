"""A simulated device with errors on the bus: what it tells of them, and how it comes back from bus-off."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

from conformance.simulator.interface import SimulatorBus

Open: TypeAlias = Callable[..., SimulatorBus]
Ask: TypeAlias = Callable[..., str]
Hear: TypeAlias = Callable[[SimulatorBus, float], list[str]]

IMS, NODE = "siko_ims360", 0x32
PASSIVE, GONE, BACK = "0B2#2081110000000000", "0B2#0000000000000000", "0B2#14FF000000000000"


@pytest.fixture
def ims(open_bus: Open, hear: Hear) -> Callable[..., SimulatorBus]:
    """Opens a booted IMS360."""

    def build(**options: object) -> SimulatorBus:
        bus = open_bus(IMS, **options)
        hear(bus, 0.5)
        return bus

    return build


def disturbed(bus: SimulatorBus, error: str, hear: Hear) -> list[str]:
    bus.disturb(error)  # type: ignore[arg-type]  # parametrised text
    heard = hear(bus, 0.1)
    bus.end_disturbance()
    return heard + hear(bus, 0.1)


@pytest.mark.parametrize(
    ("error", "options", "heard"),
    [
        ("warning-limit", {}, []),
        ("error-passive", {}, [PASSIVE, GONE]),
        ("error-passive", {"faults": "error-passive-untold"}, []),
        ("bus-off", {}, [BACK]),
        ("bus-off", {"readings": {"IMS-57": 2}}, ["0B2#4081000000000000"]),
        ("bus-off", {"faults": "bus-off-untold"}, []),
    ],
)
def test_errors_on_the_bus_are_told(
    ims: Callable[..., SimulatorBus],
    hear: Hear,
    error: str,
    options: dict[str, object],
    heard: list[str],
) -> None:
    assert disturbed(ims(**options), error, hear) == heard


@pytest.mark.parametrize(
    ("readings", "heard"),
    [
        ({}, ["081#1081110000000000", "081#0000000000000000"]),
        ({"GIM-91": 2}, []),
        ({"GIM-143": 2}, ["081#1081100000000000", "081#0000000000000000"]),
    ],
)
def test_what_is_told_and_what_the_register_shows_may_be_open(
    open_bus: Open, hear: Hear, ask: Ask, readings: dict[str, int], heard: list[str]
) -> None:
    bus = open_bus("baumer_gim140r", readings=readings)
    hear(bus, 0.5)
    bus.disturb("error-passive")
    told = hear(bus, 0.1)
    register = ask(bus, "4001100000000000", 1)
    bus.end_disturbance()

    assert told + hear(bus, 0.1) == heard
    assert register.split()[4] == ("10" if "GIM-143" in readings else "11")


def test_the_register_shows_error_passive(
    ims: Callable[..., SimulatorBus], ask: Ask, hear: Hear
) -> None:
    bus = ims()
    bus.disturb("error-passive")
    hear(bus, 0.1)
    assert ask(bus, "4001100000000000", NODE) == "4F 01 10 00 11 00 00 00"
    bus.end_disturbance()
    hear(bus, 0.1)
    assert ask(bus, "4001100000000000", NODE) == "4F 01 10 00 00 00 00 00"


def test_a_node_in_bus_off_is_silent_and_deaf(
    ims: Callable[..., SimulatorBus], ask: Ask, hear: Hear
) -> None:
    bus = ims()
    assert ask(bus, "2B17100064000000", NODE).startswith("60")
    bus.disturb("bus-off")
    assert hear(bus, 1.0) == []
    assert ask(bus, "4000100000000000", NODE) == "silence"
    bus.end_disturbance()
    assert BACK in hear(bus, 1.0)


@pytest.mark.parametrize(("faults", "answers"), [("", False), ("bus-off-always-left", True)])
def test_a_node_stays_in_bus_off_where_it_is_set_so(
    ims: Callable[..., SimulatorBus], ask: Ask, hear: Hear, faults: str, answers: bool
) -> None:
    bus = ims(faults=faults)
    assert ask(bus, "2F00310200000000", NODE).startswith("60")
    disturbed(bus, "bus-off", hear)
    assert (ask(bus, "4000100000000000", NODE) != "silence") == answers
    bus.power_off()
    bus.power_on()
    hear(bus, 0.5)
    assert ask(bus, "4000100000000000", NODE).startswith("43")


@pytest.mark.parametrize(
    ("error", "faults", "lit"),
    [
        ("warning-limit", "", {True, False}),
        ("error-passive", "", {True, False}),
        ("bus-off", "", {True}),
        ("bus-off", "light-ignores-bus-errors", {False}),
    ],
)
def test_a_light_shows_errors_on_the_bus(
    ims: Callable[..., SimulatorBus], hear: Hear, error: str, faults: str, lit: set[bool]
) -> None:
    bus = ims(faults=faults)
    bus.disturb(error)  # type: ignore[arg-type]  # parametrised text
    seen = set()
    for _ in range(30):
        hear(bus, 0.05)
        seen.add(bus.lit("red"))
    assert seen == lit
