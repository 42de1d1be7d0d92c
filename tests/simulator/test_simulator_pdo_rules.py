"""What a TPDO looks like and when it comes, as the manuals have it; shortest times."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"

SPECS = Path(__file__).parents[2] / "device_specs"


def content(device: Wired) -> str:
    """The next TPDO1 of a node that is then Operational."""
    name = f"{0x180 + device.device.node_id:03X}#"
    return next(frame for frame in device.nmt(0x01, 0.3) if frame.startswith(name))[4:]


@pytest.mark.parametrize(
    ("x_deg", "y_deg", "order", "octets"),
    [
        # +45.00 and +90.00 deg in steps of 0.01 deg (DST X730, 11); -45 deg is EE6Ch
        (45.0, 0.0, 1, "94110000"),
        (45.0, 0.0, 0, "11940000"),
        (0.0, 45.0, 1, "00009411"),
        (0.0, 45.0, 0, "00001194"),
        (-45.0, 45.0, 1, "6CEE9411"),
        (-45.0, 45.0, 0, "EE6C1194"),
    ],
)
def test_a_setting_turns_the_octets_of_each_angle_round(
    dst: Build, x_deg: float, y_deg: float, order: int, octets: str
) -> None:
    device = dst(variant="xy-60")
    device.tilt(x_deg, y_deg)
    device.set(x6000=10, x5001=order)
    assert content(device) == octets
    assert device.read(0x6010) == round(x_deg * 100), "SDO has the low octet first all the same"


@pytest.mark.parametrize(
    ("name", "variant", "readings", "octets"),
    [
        ("dst", "xy-60", {}, "84038403"),
        ("dst", "xy-60", {"DST-52": 2}, "8403840300000000"),
        ("gim", "two-dimensional", {}, "1900C201C201"),
        ("gim", "two-dimensional", {"GIM-59": 2}, "1900C201C2010000"),
        ("gim", "one-dimensional", {}, "1900C201"),
        ("gim", "one-dimensional", {"GIM-59": 2}, "1900C20100000000"),
    ],
)
def test_a_tpdo_has_the_length_of_its_objects_or_eight_octets(
    request: pytest.FixtureRequest,
    name: str,
    variant: str,
    readings: dict[str, int],
    octets: str,
) -> None:
    build: Build = request.getfixturevalue(name)
    device = build(readings, variant=variant)
    device.tilt(45.0, 45.0)
    assert content(device) == octets


def test_a_tpdo_is_sent_on_entering_operational(dst: Build) -> None:
    for readings, event_ms, count in (
        ({}, 1000, 1),
        ({}, 0, 0),
        ({"DST-51": 2}, 1000, 1),
        ({"DST-51": 2}, 0, 1),
    ):
        device = dst(readings)
        device.set(x1800_5=event_ms)
        assert len(device.nmt(0x01, 0.5)) == count
        assert device.nmt(0x80, 0.5) == []
        assert len(device.nmt(0x01, 0.5)) == count


@pytest.mark.parametrize(
    ("reading", "answer", "reads", "period_ms"),
    [(1, "abort 06090030h", 50, 50), (2, "ok", 5, 20), (3, "ok", 50, 50)],
)
def test_an_event_time_below_the_least_cycle(
    gim: Build, reading: int, answer: str, reads: int, period_ms: int
) -> None:
    device = gim({"GIM-76": reading})
    device.set(x1800_5=50)
    device.nmt(0x01)
    assert device.write("0x1800:5", 5) == answer
    assert device.read("0x1800:5") == reads
    device.run(0.1)
    assert device.periods_ms(1.0, "181") == [period_ms]
    device.set(x1800_5=20)
    device.run(0.1)
    assert device.periods_ms(1.0, "181") == [20]


@pytest.mark.parametrize("reading", [1, 2, 3])
def test_an_event_time_of_zero_is_none(gim: Build, reading: int) -> None:
    device = gim({"GIM-76": reading})
    device.set(x1800_5=0)
    assert device.nmt(0x01, 0.5) == []


@pytest.mark.parametrize(
    ("name", "ambiguity", "least_ms", "readings"),
    [
        ("gim", "GIM-100", 25, ["refused", "raised"]),
        ("ims", "IMS-62", 10, ["refused", "raised"]),
        ("dst", "DST-22", 20, ["refused", "raised", "ignored"]),
    ],
)
def test_a_heartbeat_time_below_the_minimum(
    request: pytest.FixtureRequest, name: str, ambiguity: str, least_ms: int, readings: list[str]
) -> None:
    build: Build = request.getfixturevalue(name)
    for number, what in enumerate(readings, start=1):
        device = build({ambiguity: number})
        beat = f"{0x700 + device.device.node_id:03X}"
        device.set(x1017=40)
        for below in (1, least_ms - 1):
            confirmed = device.write(0x1017, below) == "ok"
            assert confirmed == (what != "refused")
            period = least_ms if what == "raised" else 40
            assert device.read(0x1017) == period
            assert device.periods_ms(1.0, beat) == [period]
        device.set(x1017=least_ms)
        assert device.periods_ms(1.0, beat) == [least_ms]
        device.set(x1017=0)
        assert device.run(0.5) == []


def test_a_heartbeat_time_that_is_ignored_does_not_disturb_the_heartbeat(dst: Build) -> None:
    device = dst({"DST-22": 3})
    device.set(x1017=40)
    before = len(device.heard)
    device.run(0.1)
    device.set(x1017=5)
    device.run(0.1)
    times = [at for at, frame in device.heard[before:] if frame.can_id == 0x77F]
    assert {b - a for a, b in pairwise(times)} == {40_000_000}


def test_a_second_tpdo_has_the_next_cob_id_of_the_predefined_set(gim: Build) -> None:
    device = gim({"GIM-12": 2})
    assert device.read("0x1801:1") == 0x281
    device.set(x1801_2=254, x1801_5=20)
    frames = device.nmt(0x01, 0.1)
    assert {frame[:8] for frame in frames} == {"181#1900", "281#1900"}


@pytest.mark.parametrize(("reading", "answer"), [(1, "abort 08000022h"), (2, "ok")])
def test_a_mapping_may_need_the_tpdo_disabled(gim: Build, reading: int, answer: str) -> None:
    device = gim({"GIM-70": reading})
    answers = [device.write("0x1A00:0", 0), device.write("0x1A00:1", 0x2198_0010)]
    assert [it[:5] == answer[:5] for it in answers] == [True, True]
    device.set(x1800_1=0x8000_0181, x1A00_0=0, x1A00_1=0x2198_0010, x2198=0x1234)
    device.set(x1A00_0=1, x1800_1=0x181)
    assert content(device) == "3412"


def test_parameters_may_act_after_save_and_reset(dst: Build) -> None:
    device = dst({"DST-122": 2})
    device.nmt(0x01)
    device.set(x1800_5=20)
    assert device.read("0x1800:5") == 20
    device.run(0.2)
    assert device.periods_ms(1.0, "1FF") == [100]
    device.save()
    assert device.periods_ms(1.0, "1FF") == [100]
    device.reset()
    device.nmt(0x01)
    assert device.periods_ms(1.0, "1FF") == [20]
    device.set(x1800_2=1)
    assert device.periods_ms(0.2, "1FF") == [20], "still asynchronous"
    device.save_and_reset()
    assert device.nmt(0x01, 0.2) == []
    assert [frame[:4] for frame in device.run(0.1, "080#")] == ["1FF#"]


def test_the_least_cycle_holds_where_the_range_of_the_event_time_does_not_say_it(
    wire: Build, tmp_path: Path
) -> None:
    text = (SPECS / "baumer_gim140r.yaml").read_text(encoding="utf-8")
    wider = text.replace("ranges: [[0, 0], [20, 65535]]", "ranges: [[0, 65535]]")
    assert wider != text
    copy = tmp_path / "copy.yaml"
    copy.write_text(wider, encoding="utf-8")
    device = wire(str(copy))
    assert device.write("0x1800:5", 19).startswith("abort")
    assert device.write("0x1800:5", 20) == "ok"
