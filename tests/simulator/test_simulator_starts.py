"""Starts: what a reset sets back, what a save needs, and when a new setting acts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

from conformance.simulator.fault_files import load_faults

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"

STARTS = ["reset node", "reset communication", "power cycle"]


@pytest.mark.parametrize("how", STARTS)
@pytest.mark.parametrize("reading", [1, 2])
def test_a_device_set_to_start_by_itself_does(dst: Build, how: str, reading: int) -> None:
    device = dst({"DST-106": reading})
    device.set(x5000=1)
    assert device.state() == "pre-operational", "not before a start"
    device.save()
    frames = device.reset(how)
    assert frames[0] == "77F#00"
    starts = reading == 1 or how == "power cycle"
    assert (frames[1][:4] == "1FF#") if starts else (len(frames) == 1)
    assert device.state() == ("operational" if starts else "pre-operational")


@pytest.mark.parametrize("how", STARTS)
@pytest.mark.parametrize(
    ("value", "state"),
    [(0x00, "operational"), (0x08, "operational"), (0x04, "pre-operational")],
)
def test_the_start_up_object_lets_a_device_start(
    gim: Build, how: str, value: int, state: str
) -> None:
    device = gim()
    assert device.state() == "pre-operational", "as delivered it waits"
    device.set(x1F80=value)
    device.save_and_reset(how)
    assert device.state() == state


def test_a_start_object_without_effect_is_a_fault(wire: Build) -> None:
    device = wire("danfoss_dst_x730", faults=load_faults(["start-object-ignored"]))
    device.set(x5000=1)
    device.save_and_reset("power cycle")
    assert device.state() == "pre-operational"
    assert device.read(0x5000) == 1


def test_the_start_up_object_may_have_no_effect(gim: Build) -> None:
    device = gim({"GIM-17": 2})
    device.set(x1F80=0)
    device.save_and_reset("power cycle")
    assert device.state() == "pre-operational"
    assert device.read(0x1F80) == 0


@pytest.mark.parametrize(
    ("name", "settings", "left"),
    [
        # no difference between the two resets (GIM140R, 5.1)
        ("gim", {"x1017": 50, "x2196": 5, "x6014": 7}, [0, 0, 0]),
        # CiA 301 where the manual says nothing
        ("dst", {"x1017": 50, "x4000": 2, "x6014": 7}, [0, 2, 7]),
    ],
)
def test_what_a_reset_of_the_communication_sets_back(
    request: pytest.FixtureRequest, name: str, settings: dict[str, int], left: list[int]
) -> None:
    build: Build = request.getfixturevalue(name)
    device = build()
    device.set(**settings)
    device.reset("reset communication")
    assert [device.read(f"0{address}") for address in settings] == left


@pytest.mark.parametrize("how", STARTS)
@pytest.mark.parametrize(("wait_s", "kept"), [(0.0, 0), (0.598, 0), (0.601, 50)])
def test_a_save_needs_its_time(gim: Build, how: str, wait_s: float, kept: int) -> None:
    device = gim()
    device.set(x1017=50)
    device.save(wait_s=wait_s)
    device.reset(how)
    assert device.read(0x1017) == kept


@pytest.mark.parametrize(("wait_s", "left"), [(0.0, 50), (0.597, 50), (0.601, 0)])
def test_a_load_needs_its_time(gim: Build, wait_s: float, left: int) -> None:
    device = gim()
    device.set(x1017=50)
    device.save_and_reset()
    device.load(wait_s=wait_s)
    assert device.read(0x1017) == 50, "in force until the reset"
    device.reset()
    assert device.read(0x1017) == left


def test_a_save_stores_what_was_in_force_when_it_was_asked_for(gim: Build) -> None:
    device = gim()
    device.set(x1017=50)
    device.save(wait_s=0.1)
    device.set(x1017=60)
    device.run(0.6)
    device.reset()
    assert device.read(0x1017) == 50


def test_a_save_without_a_waiting_time_is_done_when_it_is_answered(dst: Build) -> None:
    device = dst()
    device.set(x4000=2)
    device.save(wait_s=0.0)
    device.reset("power cycle")
    assert device.read(0x4000) == 2


@pytest.mark.parametrize(("name", "address"), [("gim", 0x6014), ("dst", 0x4000)])
def test_restored_defaults_stay_without_a_save(
    request: pytest.FixtureRequest, name: str, address: int
) -> None:
    build: Build = request.getfixturevalue(name)
    device = build()
    default = device.read(address)
    assert device.write(address, 2) == "ok"
    device.save_and_reset()
    device.load()
    assert device.read(address) == 2
    device.reset()
    assert device.read(address) == default
    device.reset("power cycle")
    assert device.read(address) == default


def test_a_save_behind_a_load_keeps_what_is_in_force(gim: Build) -> None:
    device = gim()
    device.set(x1017=50)
    device.load()
    device.save()
    device.reset()
    assert device.read(0x1017) == 50


def in_force(device: Wired, address: int) -> int:
    assert device.device._firmware is not None
    return device.device._firmware.node.dictionary.number(address)


def test_a_filter_acts_once_it_is_stored(dst: Build) -> None:
    device = dst()
    device.set(x2001=2)
    assert (device.read(0x2001), in_force(device, 0x2001)) == (2, 0)
    device.save()
    assert in_force(device, 0x2001) == 2
    device.set(x2001=1)
    assert in_force(device, 0x2001) == 2
    device.reset()
    assert (device.read(0x2001), in_force(device, 0x2001)) == (2, 2)


@pytest.mark.parametrize(
    ("name", "readings", "address", "value"),
    [("dst", {"DST-104": 2}, 0x2001, 2), ("gim", {"GIM-54": 2}, 0x2603, 50)],
)
def test_a_filter_may_act_after_save_and_reset(
    request: pytest.FixtureRequest, name: str, readings: dict[str, int], address: int, value: int
) -> None:
    build: Build = request.getfixturevalue(name)
    device = build(readings)
    before = in_force(device, address)
    assert device.write(address, value) == "ok"
    device.save()
    assert (device.read(address), in_force(device, address)) == (value, before)
    device.reset()
    assert (device.read(address), in_force(device, address)) == (value, value)


@pytest.mark.parametrize("readings", [{}, {"DST-104": 2}])
def test_a_stored_value_may_never_act(dst: Build, readings: dict[str, int]) -> None:
    device = dst(readings, faults=load_faults(["stored-values-never-act"]))
    device.set(x2001=2)
    device.save()
    assert (device.read(0x2001), in_force(device, 0x2001)) == (2, 0)
    device.reset()
    assert (device.read(0x2001), in_force(device, 0x2001)) == (2, 0)


def test_a_filter_without_such_a_rule_acts_at_once(gim: Build) -> None:
    device = gim()
    device.set(x2603=50)
    assert in_force(device, 0x2603) == 50


@pytest.mark.parametrize(
    ("reading", "answer", "filter_type", "cut_off"),
    [(1, "abort 06090031h", 1, 25000), (2, "ok", 2, 8000), (3, "ok", 2, 25000)],
)
def test_a_cut_off_that_a_new_filter_does_not_allow(
    ims: Build, reading: int, answer: str, filter_type: int, cut_off: int
) -> None:
    device = ims({"IMS-126": reading})
    assert device.write(0x3111, 8001).startswith("abort"), "the critically damped one: to 8 Hz"
    device.set(x3110_1=1, x3111=25000)
    assert device.write(0x3111, 25001).startswith("abort"), "Butterworth: to 25 Hz"
    assert device.write(0x3111, 99).startswith("abort")
    assert device.write("0x3110:1", 2) == answer
    assert (device.read("0x3110:1"), device.read(0x3111)) == (filter_type, cut_off)


@pytest.mark.parametrize("reading", [1, 2, 3])
def test_a_cut_off_that_both_filters_allow_is_kept(ims: Build, reading: int) -> None:
    device = ims({"IMS-126": reading})
    device.set(x3110_1=1, x3111=8000)
    device.set(x3110_1=2)
    assert device.read(0x3111) == 8000


def test_a_limit_is_that_of_the_filter_written_even_if_it_acts_later(ims: Build) -> None:
    device = ims({"IMS-131": 2})
    device.set(x3110_1=1, x3111=25000)
    assert device.write("0x3110:1", 2).startswith("abort")


def test_the_restart_command_is_answered_before_the_restart(ims: Build) -> None:
    device = ims()
    device.set(x1017=100)
    device.set(x2010_1=1)
    assert [frame for frame in device.run(0.3) if frame == "732#00"] == ["732#00"]
    assert device.read(0x1017) == 0
