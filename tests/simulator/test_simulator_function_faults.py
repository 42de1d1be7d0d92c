"""What the faults of slopes, twins and other rules between objects do to a documented device."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.simulator.fault_files import load_faults
from conformance.spec.yaml_reader import read_yaml

EFFECTS: dict[str, dict[str, Any]] = read_yaml(
    Path(__file__).with_name("function_fault_effects.yaml")
).data


@pytest.mark.parametrize("fault", EFFECTS)
def test_a_fault_shows_in_a_value(wire: Callable[..., Any], fault: str) -> None:
    effect = EFFECTS[fault]
    for faults, expected in ((None, effect["without"]), (load_faults([fault]), effect["with"])):
        device = wire(effect["device"], effect["variant"], faults=faults)
        for address, value in effect["do"]:
            device.write(address, value)
        assert device.read(effect["read"]) == expected
    assert effect["without"] != effect["with"]


def test_a_command_to_restart_can_be_ignored(wire: Callable[..., Any]) -> None:
    restarted = wire("siko_ims360").run(1.0, "632#2F10200101000000")
    ignored = wire("siko_ims360", faults=load_faults(["reset-command-ignored"])).run(
        1.0, "632#2F10200101000000"
    )
    assert restarted == ["5B2#6010200100000000", "732#00"]
    assert ignored == ["5B2#6010200100000000"]


def test_an_optional_object_can_be_listed_and_not_be_read(wire: Callable[..., Any]) -> None:
    request = "632#4003100900000000"
    held = wire("siko_ims360").run(1.0, request)
    half = wire("siko_ims360", faults=load_faults(["optional-objects-half-done"])).run(1.0, request)
    assert held == ["5B2#4303100900000000"]
    assert half == ["5B2#8003100922000008"]


@pytest.mark.parametrize(
    ("options", "data"),
    [
        ({}, "00D2FFAB0000"),
        ({"readings": {"DST-65": 2}}, "FFAB00D20000"),
        ({"faults": load_faults(["byte-order-ignored"])}, "D200ABFF0000"),
    ],
)
def test_a_byte_order_turns_objects_or_a_whole_pdo_round(
    wire: Callable[..., Any], options: dict[str, Any], data: str
) -> None:
    device = wire("danfoss_dst_x730", "xy-30", **options)
    device.set(x5001=0)
    heard = device.nmt(1, 0.15)
    assert heard
    assert {frame.partition("#")[2][: len(data) - 4] for frame in heard} == {data[:-4]}


def test_a_slope_without_scaling_may_keep_its_own_steps(wire: Callable[..., Any]) -> None:
    device = wire("danfoss_dst_x730", "xy-30", readings={"DST-112": 3})
    device.set(x6000=10, x6014=7)
    assert device.read(0x6010) == 1057
    device.set(x6011=0)
    assert device.read(0x6010) == 210


@pytest.mark.parametrize(("resolution", "shown"), [(100, 3595), (10, 32767), (1000, 360 - 1)])
def test_a_range_printed_in_steps_is_an_angle(
    wire: Callable[..., Any], resolution: int, shown: int
) -> None:
    device = wire("baumer_gim140r", "one-dimensional", readings={"GIM-65": 2})
    device.device.world.tilt_x_deg = -0.5 if resolution < 1000 else -1.0
    device.set(x6000=resolution)
    assert device.read(0x6010) == shown


@pytest.mark.parametrize(
    ("device", "value", "tilt_deg", "shown", "counted"),
    [
        ("siko_ims360", 0x6110, -90.0, 27000, -9000),
        ("siko_ims360", 0x6110, 359.0, 35900, 35900),
        ("siko_ims360", 0x6110, 360.0, 0, 36000),
        ("danfoss_dst_x730", 0x6010, 270.0, -1800, 5400),
        ("danfoss_dst_x730", 0x6010, -180.0, -3600, -3600),
    ],
)
def test_a_whole_turn_begins_anew(
    wire: Callable[..., Any], device: str, value: int, tilt_deg: float, shown: int, counted: int
) -> None:
    for faults, expected in ((None, shown), (load_faults(["counts-turns"]), counted)):
        wired = wire(device, faults=faults)
        wired.tilt(tilt_deg)
        assert wired.read(value) == expected


def test_a_zero_is_set_over_the_whole_turn(wire: Callable[..., Any]) -> None:
    device = wire("siko_ims360")
    device.tilt(-90.0)
    device.write(0x3200, 1)
    assert device.read(0x6110) == 0
    assert device.read(0x3210) == -27000


def test_a_sensor_may_not_reach_the_end_of_its_range(wire: Callable[..., Any]) -> None:
    device = wire("siko_ims360", "two-axis", faults=load_faults(["stops-before-the-end"]))
    device.tilt(-85.0, 79.0)
    assert (device.read(0x6110), device.read(0x6120)) == (-8000, 7900)
