"""When a TPDO is sent where a manual can be read in several ways."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from conformance.simulator.interface import SimulatorBus

Open = Callable[..., SimulatorBus]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]
Times = Callable[[SimulatorBus, float, str], list[int]]

SPECS = Path(__file__).parents[2] / "device_specs"
IMS = str(SPECS / "siko_ims360.yaml")
DST = str(SPECS / "danfoss_dst_x730.yaml")
OFF, ON = "632#23001801B2010080", "632#23001801B2010000"
START, STOP = "000#0132", "000#8032"


def set_event_time(index: int, milliseconds: int) -> str:
    return (
        f"632#2B{index & 0xFF:02X}{index >> 8:02X}05{milliseconds.to_bytes(2, 'little').hex()}0000"
    )


def gaps_ms(times: list[int]) -> list[int]:
    return [round((b - a) / 1e6) for a, b in pairwise(times)]


@pytest.mark.parametrize(("reading", "expected"), [(1, [50, 60]), (2, [20])])
def test_inhibit_time(
    open_bus: Open, tell: Tell, hear: Hear, times: Times, reading: int, expected: list[int]
) -> None:
    bus = open_bus(IMS, readings=f"IMS-33={reading}")
    hear(bus, 0.3)
    tell(bus, OFF, "632#2B001803F4010000", ON, set_event_time(0x1800, 20), START)

    gaps = gaps_ms(times(bus, 0.5, "1B2"))

    assert len(gaps) > 5
    assert set(gaps[1:-1]) <= set(expected)


@pytest.mark.parametrize(("reading", "expected"), [(1, 40), (2, 100)])
def test_new_event_time_while_it_runs(
    open_bus: Open, tell: Tell, hear: Hear, times: Times, reading: int, expected: int
) -> None:
    bus = open_bus(IMS, readings=f"IMS-152={reading}")
    hear(bus, 0.3)
    tell(bus, set_event_time(0x1800, 100), START)
    hear(bus, 0.15)
    tell(bus, set_event_time(0x1800, 40))

    assert set(gaps_ms(times(bus, 0.45, "1B2"))) == {expected}
    tell(bus, STOP, START)
    assert set(gaps_ms(times(bus, 0.45, "1B2"))[1:]) == {40}


@pytest.mark.parametrize(("reading", "answered"), [(1, [1, 0]), (2, [0, 1])])
def test_bit_30_and_remote_requests(
    open_bus: Open, tell: Tell, hear: Hear, reading: int, answered: list[int]
) -> None:
    bus = open_bus(IMS, readings=f"IMS-29={reading}")
    hear(bus, 0.3)
    tell(bus, "632#2F001802FD000000", START)

    seen = []
    for word in ("B2010000", "B2010040"):
        tell(bus, OFF, f"632#23001801{word}")
        hear(bus, 0.05)
        tell(bus, "1B2#R")
        seen.append(sum(frame.startswith("1B2#") for frame in hear(bus, 0.05)))

    assert seen == answered


@pytest.mark.parametrize(("reading", "count"), [(1, 0), (2, 1)])
def test_first_tpdo_without_an_event_time(
    open_bus: Open, tell: Tell, hear: Hear, reading: int, count: int
) -> None:
    bus = open_bus(IMS, readings=f"IMS-27={reading}")
    hear(bus, 0.3)
    tell(bus, START)

    assert sum(frame.startswith("1B2#") for frame in hear(bus, 0.5)) == count


@pytest.mark.parametrize(("reading", "some"), [(1, False), (2, True)])
def test_event_timer_with_a_synchronous_type(
    open_bus: Open, tell: Tell, hear: Hear, reading: int, some: bool
) -> None:
    bus = open_bus(DST, readings=f"DST-125={reading}")
    hear(bus, 0.5)
    tell(bus, "67F#2F00180201000000", "000#017F")

    assert any(frame.startswith("1FF#") for frame in hear(bus, 0.5)) is some
