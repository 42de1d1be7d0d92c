"""Slopes, presets and offsets in figures that follow from the manuals by hand."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"


def row(device: Wired, *addresses: int) -> list[object]:
    return [device.read(address) for address in addresses]


@pytest.mark.parametrize(
    ("name", "steps", "slope"),
    [
        # 0.001, 0.01, 0.1 and 1 deg a step (GIM140R, 6.3.4)
        ("gim", 1, 12300),
        ("gim", 10, 1230),
        ("gim", 100, 123),
        ("gim", 1000, 12),
        # 0.01, 0.05, 0.1, 0.5 and 1 deg a step (DST X730, 12)
        ("dst", 10, 1230),
        ("dst", 50, 246),
        ("dst", 100, 123),
        ("dst", 500, 25),
        ("dst", 1000, 12),
    ],
)
def test_the_resolution_sets_the_step_of_a_slope(
    name: str, steps: int, slope: int, gim: Build, dst: Build
) -> None:
    device = {"gim": gim, "dst": dst}[name]()
    device.tilt(12.3, -12.3)
    device.set(x6000=steps)
    assert row(device, 0x6010, 0x6020) == [slope, -slope]


def test_ninety_degrees_are_the_octets_of_the_manual(gim: Build) -> None:
    device = gim()
    device.tilt(90.0)
    assert device.nmt(0x01, 0.05)[0][:4] == "181#"
    assert device.nmt(0x01, 0.1)[0][8:12] == "8403"


@pytest.mark.parametrize(
    ("differential", "preset", "offset"), [(0, 0, -123), (50, 0, -173), (0, 900, 777)]
)
def test_a_preset_counts_the_differential_offset_and_the_slope_shows_it(
    gim: Build, differential: int, preset: int, offset: int
) -> None:
    device = gim()
    device.tilt(12.3)
    device.set(x6014=differential, x6012=preset)
    assert row(device, 0x6010, 0x6013, 0x6014) == [preset, offset, differential]
    device.tilt(13.3)
    assert row(device, 0x6010, 0x6110, 0x6013) == [preset + 10, preset + 10, offset]


def test_a_differential_offset_shifts_the_slope_and_leaves_the_offset(gim: Build) -> None:
    device = gim()
    device.tilt(12.3)
    device.set(x6014=50, x6012=0, x6014_0=60)
    assert row(device, 0x6010, 0x6013) == [10, -173]


def test_without_scaling_a_slope_is_the_measured_angle(gim: Build) -> None:
    device = gim()
    device.tilt(13.3)
    device.set(x6012=900, x6014=7, x6011=0)
    assert row(device, 0x6010, 0x6110, 0x6013) == [133, 133, 767]
    device.set(x6011=2)
    assert device.read(0x6010) == 133 + 767 + 7


def test_an_axis_has_its_own_preset_and_operating_parameter(gim: Build, dst: Build) -> None:
    for device in (gim(), dst({"DST-117": 2})):
        device.tilt(10.0, 20.0)
        before = device.read(0x6010)
        device.set(x6022=0, x6021=3)
        assert row(device, 0x6010, 0x6020)[0] == before
        assert device.read(0x6013) == 0
        assert device.read(0x6023) != 0


def test_inversion_changes_the_sign_of_the_measured_angle_alone(gim: Build, dst: Build) -> None:
    for device, counts in ((gim(), 123), (dst(), 246)):
        device.tilt(12.3)
        device.set(x6011=3)
        assert device.read(0x6010) == -counts
        device.set(x6014=50)
        assert device.read(0x6010) == 50 - counts
        device.set(x6014=0, x6012=900)
        assert row(device, 0x6010, 0x6013) == [900, 900 + counts]


@pytest.mark.parametrize("reading", [1, 2])
@pytest.mark.parametrize("preset", [0, 900, -40])
@pytest.mark.parametrize("differential", [0, 50])
def test_a_preset_sets_an_inverted_slope_directly_too(
    gim: Build, reading: int, preset: int, differential: int
) -> None:
    device = gim({"GIM-45": reading})
    device.tilt(12.3)
    device.set(x6011=3, x6014=differential, x6012=preset)
    assert row(device, 0x6010, 0x6110) == [preset, preset]
    device.tilt(13.3)
    assert device.read(0x6010) == preset - 10


def test_the_guides_preset_of_an_axis(dst: Build) -> None:
    device = dst()
    device.tilt(10.5)
    assert device.read(0x6010) == 210
    device.set(x6012=0)
    assert row(device, 0x6010, 0x6013) == [0, -210]
    device.tilt(12.0)
    assert device.read(0x6010) == 30
    device.tilt(10.5)
    device.set(x6012=100)
    assert row(device, 0x6010, 0x6013) == [100, -110]
    device.set(x6014=20)
    assert row(device, 0x6010, 0x6013) == [120, -110]
    device.set(x6012=100)
    assert row(device, 0x6010, 0x6013) == [120, -110], "the two are independent"


def test_a_preset_acts_again_when_the_same_value_is_written_again(dst: Build, gim: Build) -> None:
    for device in (dst(), gim()):
        device.set(x6012=0)
        device.tilt(-3.0)
        assert device.read(0x6010) != 0
        device.set(x6012=0)
        assert device.read(0x6010) == 0


def test_a_zero_point_that_was_saved_outlives_a_reset(dst: Build, gim: Build) -> None:
    for device, counts in ((dst(), 30), (gim(), 15)):
        device.tilt(10.5)
        device.set(x6012=0)
        device.save_and_reset()
        device.tilt(12.0)
        assert device.read(0x6010) == counts, "the calculation is not done again"
        device.set(x6012=0)
        device.reset()
        assert device.read(0x6010) == counts, "what was not saved is lost"


def test_a_new_resolution_deletes_the_zero_points(dst: Build) -> None:
    device = dst()
    device.tilt(10.5, 5.0)
    device.set(x6012=100, x6014=20, x6022=7, x6024=3)
    device.set(x6000=50)
    assert row(device, 0x6012, 0x6013, 0x6014) == [100, -110, 20], "no change, nothing deleted"
    device.set(x6000=10)
    assert row(device, 0x6012, 0x6013, 0x6014, 0x6022, 0x6023, 0x6024) == [0] * 6
    assert row(device, 0x6010, 0x6020) == [1050, 500]


def test_a_new_resolution_leaves_the_numbers_of_presets_and_offsets(gim: Build) -> None:
    device = gim()
    device.tilt(12.3)
    device.set(x6014=50, x6012=900, x6000=10)
    assert row(device, 0x6012, 0x6013, 0x6014) == [900, 727, 50]
    assert device.read(0x6010) == 1230 + 727 + 50


def test_a_new_resolution_may_leave_the_angles_of_presets_and_offsets(gim: Build) -> None:
    device = gim({"GIM-36": 2})
    device.tilt(12.3, -4.0)
    device.set(x6014=50, x6012=900, x6024=-5, x6000=10)
    assert row(device, 0x6012, 0x6013, 0x6014, 0x6024) == [9000, 7270, 500, -50]
    assert row(device, 0x6112, 0x6113, 0x6114, 0x6124) == [9000, 7270, 500, -50]
    assert row(device, 0x6010, 0x6110) == [9000, 9000]
    device.set(x6000=1)
    assert row(device, 0x6013, 0x6113) == [32767, 72700], "each as far as its type goes"
    assert device.read(0x6110) == 90000


def test_zero_points_are_deleted_with_a_resolution_that_acts_later_too(dst: Build) -> None:
    device = dst({"DST-122": 2})
    device.tilt(10.5)
    device.set(x6012=0)
    device.save_and_reset()
    device.set(x6000=10)
    device.save_and_reset()
    assert row(device, 0x6000, 0x6013, 0x6010) == [10, 0, 1050]


@pytest.mark.parametrize("off", [0x6011, 0x6021])
@pytest.mark.parametrize(("reading", "answer"), [(1, "abort 08000022h"), (2, "ok")])
def test_a_resolution_counts_only_while_both_axes_are_scaled(
    dst: Build, off: int, reading: int, answer: str
) -> None:
    device = dst({"DST-108": reading})
    device.set(x6012=7)
    assert device.write(off, 0) == "ok"
    assert device.write(0x6000, 10) == answer
    assert row(device, 0x6000, 0x6012) == [50, 7]
    assert device.write(0x6000, 50) == "ok", "it has that one"
    assert device.write(off, 3) == "ok"
    assert device.write(0x6000, 10) == "ok"
    assert device.read(0x6000) == 10


@pytest.mark.parametrize("last", ["11", "12", "13", "14", "21", "22", "23", "24"])
def test_sixteen_and_thirty_two_bits_are_one_value(gim: Build, last: str) -> None:
    device = gim()
    narrow, wide = int(f"0x60{last}", 0), int(f"0x61{last}", 0)
    for value, (written, shown) in enumerate(((narrow, wide), (wide, narrow)), start=2):
        assert device.write(written, value) == "ok"
        assert row(device, written, shown) == [value, value]


@pytest.mark.parametrize("last", ["12", "13", "14"])
@pytest.mark.parametrize(("value", "shown"), [(40000, 32767), (-40000, -32768)])
def test_a_value_that_sixteen_bits_cannot_hold_is_shown_as_the_nearest(
    gim: Build, last: str, value: int, shown: int
) -> None:
    device = gim()
    assert device.write(int(f"0x61{last}", 0), value) == "ok"
    assert row(device, int(f"0x61{last}", 0), int(f"0x60{last}", 0)) == [value, shown]


def test_a_slope_beyond_sixteen_bits_is_the_greatest_number(gim: Build) -> None:
    device = gim()
    device.set(x6000=1)
    device.tilt(90.0, -90.0)
    assert row(device, 0x6010, 0x6020) == [32767, -32768]
    assert row(device, 0x6110, 0x6120) == [90000, -90000]


@pytest.mark.parametrize("preset", [0x6012, 0x6112])
def test_a_preset_through_either_twin_sets_both_slopes(gim: Build, preset: int) -> None:
    device = gim()
    device.tilt(12.3)
    assert device.write(preset, 900) == "ok"
    assert row(device, 0x6010, 0x6110, 0x6013, 0x6113) == [900, 900, 777, 777]


def test_a_sensor_of_one_axis_has_no_rule_for_the_other(gim: Build) -> None:
    device = gim(variant="one-dimensional")
    held = device.device.spec.behaviours
    assert "slope-longitudinal-16" in held
    assert [name for name in held if "lateral" in name] == []
    device.tilt(12.3, 5.0)
    device.set(x6012=0)
    assert row(device, 0x6010, 0x6110) == [0, 0]


@pytest.mark.parametrize(
    ("command", "offsets", "slopes"),
    [(1, [-1050, 0], [0, -425]), (2, [0, 425], [1050, 0]), (3, [-1050, 425], [0, 0])],
)
def test_the_zero_command_zeroes_the_axes_it_names(
    ims: Build, command: int, offsets: list[int], slopes: list[int]
) -> None:
    device = ims()
    device.tilt(10.5, -4.25)
    assert device.write(0x3200, command) == "ok"
    assert row(device, 0x3210, 0x3220) == offsets
    assert row(device, 0x6110, 0x6120) == slopes
    device.tilt(11.5, -3.25)
    assert row(device, 0x6110, 0x6120) == [slope + 100 for slope in slopes]


def test_a_zero_point_can_be_written_and_is_kept_by_a_save(ims: Build) -> None:
    device = ims()
    device.tilt(10.0, 0.0)
    device.set(x3210=-250)
    assert device.read(0x6110) == 750
    device.save_and_reset()
    assert row(device, 0x3210, 0x6110) == [-250, 750]


def test_a_sensor_of_one_axis_has_one_axis_to_zero(ims: Build) -> None:
    device = ims(variant="one-axis")
    device.tilt(10.5)
    assert device.write(0x3200, 2).startswith("abort")
    assert device.write(0x3200, 1) == "ok"
    assert row(device, 0x6110, 0x3210) == [0, -1050]
