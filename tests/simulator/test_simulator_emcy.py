from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conformance.simulator.interface import SimulatorBus

Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]
Open = Callable[..., SimulatorBus]

SPECS = Path(__file__).parents[2] / "device_specs"


def booted(open_bus: Open, name: str, **options: object) -> SimulatorBus:
    bus = open_bus(str(SPECS / f"{name}.yaml"), node_id=0x0A, **options)
    bus.recv(1.0)
    bus.set_tilt(0.0, 0.0)
    return bus


def test_a_second_error_need_not_be_told(with_faults: Open, hear: Hear) -> None:
    bus = with_faults("emcy-second-error-untold")
    heard = []
    for tilt in ((95.0, 0.0), (95.0, 95.0), (0.0, 95.0), (0.0, 0.0)):
        bus.set_tilt(*tilt)
        heard.append(hear(bus, 0.1))
    assert heard == [["08A#1050810000000000"], [], [], ["08A#0000000000000000"]]


@pytest.mark.parametrize(("faults", "octet"), [((), "04"), (("without-manufacturer-code",), "00")])
def test_an_emcy_carries_the_manufacturers_code(
    with_faults: Open, hear: Hear, faults: tuple[str, ...], octet: str
) -> None:
    bus = with_faults(*(f"emcy-{fault}" for fault in faults))
    bus.raise_error(0x3100, 2)
    assert hear(bus, 0.1) == [f"08A#00318100{octet}000000"]


@pytest.mark.parametrize(
    ("fault", "first", "second"),
    [(None, "20810000", "00310000"), ("history-oldest-first", "00310000", "20810000")],
)
def test_the_history_has_an_order(
    with_faults: Open, ask: Ask, hear: Hear, fault: str | None, first: str, second: str
) -> None:
    bus = with_faults(*([fault] if fault else []))
    bus.raise_error(0x3100)
    bus.raise_error(0x8120)
    hear(bus, 0.1)
    assert ask(bus, "40 03 10 01 00 00 00 00").replace(" ", "") == f"43031001{first}"
    assert ask(bus, "40 03 10 02 00 00 00 00").replace(" ", "") == f"43031002{second}"


@pytest.mark.parametrize(("faults", "kept"), [((), "08"), (("history-of-four",), "04")])
def test_the_history_has_a_depth(
    open_bus: Open, ask: Ask, hear: Hear, faults: tuple[str, ...], kept: str
) -> None:
    bus = booted(open_bus, "siko_ims360", faults=faults, variant="two-axis")
    for code in range(0x3100, 0x310C):
        bus.raise_error(code)
    hear(bus, 0.1)
    assert ask(bus, "40 03 10 00 00 00 00 00") == f"4F 03 10 00 {kept} 00 00 00"


def test_0000h_may_enter_the_history(open_bus: Open, ask: Ask, hear: Hear) -> None:
    bus = booted(open_bus, "siko_ims360", readings="IMS-56=2", variant="two-axis")
    bus.raise_error(0x3100)
    bus.clear_error(0x3100)
    hear(bus, 0.1)
    assert ask(bus, "40 03 10 01 00 00 00 00") == "43 03 10 01 00 00 00 00"
    assert ask(bus, "40 03 10 02 00 00 00 00") == "43 03 10 02 00 31 00 00"


def test_both_axes_may_share_a_bit(open_bus: Open, hear: Hear) -> None:
    bus = booted(open_bus, "danfoss_dst_x730", readings="DST-33=2", variant="xy-10")
    heard = []
    for tilt in ((12.0, 0.0), (12.0, 12.0), (0.0, 12.0), (0.0, 0.0)):
        bus.set_tilt(*tilt)
        heard.append(hear(bus, 0.1))
    assert heard == [["08A#0010000001000000"], [], [], ["08A#0000000000000000"]]


@pytest.mark.parametrize(("reading", "state"), [(1, "04"), (2, "7F")])
def test_an_angle_may_be_no_serious_failure(
    open_bus: Open, tell: Tell, hear: Hear, reading: int, state: str
) -> None:
    bus = booted(open_bus, "danfoss_dst_x730", readings=f"DST-26={reading}", variant="xy-10")
    tell(bus, "60A#2F00400002000000", "60A#2B17100064000000")
    hear(bus, 0.05)
    bus.set_tilt(12.0, 0.0)
    assert hear(bus, 0.2)[-1] == f"70A#{state}"


@pytest.mark.parametrize(("reading", "answer"), [(1, "8014100030000906"), (2, "6014100000000000")])
def test_a_can_id_of_another_service_may_be_taken(
    open_bus: Open, tell: Tell, hear: Hear, reading: int, answer: str
) -> None:
    bus = booted(open_bus, "danfoss_dst_x730", readings=f"DST-42={reading}", variant="xy-10")
    tell(bus, "60A#2314100001000080", "60A#2314100001000000")
    assert hear(bus, 0.1) == ["58A#6014100000000000", f"58A#{answer}"]


def test_the_history_may_take_any_value(open_bus: Open, ask: Ask) -> None:
    bus = booted(open_bus, "siko_ims360", readings="IMS-85=2", variant="two-axis")
    bus.raise_error(0x3100)
    assert ask(bus, "2F 03 10 00 05 00 00 00") == "60 03 10 00 00 00 00 00"
    assert ask(bus, "40 03 10 00 00 00 00 00") == "4F 03 10 00 01 00 00 00"


def test_an_emcy_within_the_inhibit_time_comes_after_it(bus: SimulatorBus, ask: Ask) -> None:
    ask(bus, "2B 15 10 00 E8 03 00 00")
    start = bus.now()
    bus.raise_error(0x3100)
    bus.clear_error(0x3100)
    seen = [bus.recv(1.0), bus.recv(1.0)]
    assert [message.arbitration_id for message in seen if message] == [0x8A, 0x8A]
    assert seen[1] is not None
    assert 0.1 <= seen[1].timestamp - start < 0.11


@pytest.mark.parametrize(("reading", "heard"), [(1, ["08A#0000000000000000"]), (3, [])])
def test_an_error_may_last_until_a_reset(
    open_bus: Open, tell: Tell, hear: Hear, reading: int, heard: list[str]
) -> None:
    bus = booted(open_bus, "danfoss_dst_x730", readings=f"DST-137={reading}", variant="xy-10")
    bus.set_tilt(12.0, 0.0)
    hear(bus, 0.1)
    bus.set_tilt(0.0, 0.0)
    assert hear(bus, 0.1) == heard
    tell(bus, "000#810A")
    hear(bus, 0.5)
    bus.set_tilt(12.0, 0.0)
    assert hear(bus, 0.1) == ["08A#0010000001000000"]


@pytest.mark.parametrize(
    ("faults", "code"), [((), "00 31 00 00"), (("history-codes-lost",), "00 00 00 00")]
)
def test_the_history_outlasts_a_start(
    open_bus: Open, ask: Ask, hear: Hear, faults: tuple[str, ...], code: str
) -> None:
    bus = booted(open_bus, "siko_ims360", faults=faults, variant="two-axis")
    bus.raise_error(0x3100)
    bus.power_off()
    bus.power_on()
    hear(bus, 0.5)
    assert ask(bus, "40 03 10 00 00 00 00 00") == "4F 03 10 00 01 00 00 00"
    assert ask(bus, "40 03 10 01 00 00 00 00") == f"43 03 10 01 {code}"
