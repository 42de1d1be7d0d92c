"""Errors: what the devices find by themselves, the EMCY that tells it, and the state that follows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"

LIMITS = {
    "xy-10": 11.0,
    "xy-15": 16.5,
    "xy-20": 22.0,
    "xy-30": 33.0,
    "xy-45": 49.5,
    "xy-60": 66.0,
    "xy-90": 87.0,
}
"""Error limits and greatest angles shown, in deg (DST X730, 9)."""

GONE = "0FF#0000000000000000"


def x_error(code: int = 0x01) -> str:
    return f"0FF#00100000{code:02X}000000"


@pytest.mark.parametrize("variant", LIMITS)
@pytest.mark.parametrize("sign", [1, -1])
def test_an_axis_beyond_its_limit_is_an_error(dst: Build, variant: str, sign: int) -> None:
    device = dst(variant=variant)
    limit = sign * LIMITS[variant]
    assert device.tilt(limit) == [], "the limit itself is no error"
    assert device.read(0x4001) == 0
    assert device.tilt(limit + sign * 0.1) == [x_error()]
    assert device.read(0x4001) == 0x01
    assert device.tilt(0.0, limit) == [GONE]
    assert device.tilt(0.0, limit + sign * 0.1) == [x_error(0x02)]
    assert device.read(0x4001) == 0x02
    assert device.tilt(0.0, 0.0) == [GONE]


def test_an_angle_shown_stops_at_its_limit(dst: Build) -> None:
    device = dst(variant="xy-10")
    device.tilt(12.0, -12.0)
    assert (device.read(0x6010), device.read(0x6020)) == (220, -220)
    device.set(x6012=0)
    assert device.read(0x6010) == 0, "the limit is one of the measured angle"
    device.tilt(0.0)
    assert device.read(0x6010) == -220


def test_a_preset_does_not_move_the_limits(dst: Build) -> None:
    device = dst(variant="xy-10")
    device.tilt(10.0)
    device.set(x6012=30000)
    assert device.tilt(10.9) == []
    assert device.tilt(11.1) == [x_error()]


def test_a_sensor_of_a_whole_turn_has_no_limits(dst: Build) -> None:
    device = dst(variant="z-360")
    for angle in (179.0, -179.0):
        assert device.tilt(angle, angle) == []
        assert device.read(0x6010) == angle * 20
        assert device.read(0x4001) == 0


@pytest.mark.parametrize(("bit", "code"), [(4, 0x10), (5, 0x20), (6, 0x40)])
def test_other_errors_have_their_bits(dst: Build, bit: int, code: int) -> None:
    device = dst()
    assert device.fail(0x1000, bit) == [x_error(code)]
    assert device.tilt(60.0) == [x_error(code | 1)]
    assert device.read(0x4001) == code | 1
    assert device.recover(0x1000, bit) == ["0FF#0000000001000000"], "one of two is still there"
    assert device.tilt(0.0) == [GONE]


def test_the_error_register_stays_zero_where_the_manual_says_so(dst: Build) -> None:
    device = dst()
    device.tilt(60.0)
    assert device.read(0x1001) == 0
    assert device.read(0x4001) == 1


@pytest.mark.parametrize(("readings", "shared"), [({"DST-33": 2}, 0x01), ({"DST-32": 2}, 0x02)])
def test_axes_may_share_a_bit(dst: Build, readings: dict[str, int], shared: int) -> None:
    device = dst(readings)
    assert device.tilt(60.0, 0.0) == [x_error(shared)]
    assert device.tilt(60.0, 60.0) == []
    assert device.tilt(0.0, 60.0) == []
    assert device.tilt(0.0, 0.0) == [GONE]


@pytest.mark.parametrize(
    ("code", "frame", "register"),
    [
        (0x1000, "081#0010010000000000", 0x01),
        (0x8110, "081#1081110000000000", 0x11),
        (0x8210, "081#1082110000000000", 0x11),
    ],
)
def test_an_error_has_the_octets_of_the_manual(
    gim: Build, code: int, frame: str, register: int
) -> None:
    device = gim()
    assert device.fail(code) == [frame]
    assert device.read(0x1001) == register
    assert device.read("0x1003:1") == code
    assert device.recover(code) == ["081#0000000000000000"]
    assert device.read(0x1001) == 0
    assert device.read("0x1003:1") == code, "the history keeps it"


def test_an_error_ends_operational(gim: Build) -> None:
    device = gim()
    assert "181#" in device.nmt(0x01, 0.15)[-1]
    frames = device.fail(0x1000, seconds=0.5)
    assert frames == ["081#0010010000000000"], "no TPDO any more"
    assert device.state() == "pre-operational"
    device.recover(0x1000)
    assert device.state() == "pre-operational", "it waits for a start"


@pytest.mark.parametrize("reading", [1, 2])
def test_an_error_in_stopped(gim: Build, reading: int) -> None:
    device = gim({"GIM-90": reading})
    device.nmt(0x02)
    device.fail(0x8110)
    assert device.state() == ("stopped" if reading == 1 else "pre-operational")


@pytest.mark.parametrize(
    ("behaviour", "state"), [(0, "pre-operational"), (1, "operational"), (2, "stopped")]
)
def test_a_setting_says_to_which_state_an_error_leads(
    dst: Build, behaviour: int, state: str
) -> None:
    device = dst()
    device.set(x4000=behaviour)
    device.nmt(0x01)
    assert x_error() in device.tilt(60.0), "it is told before the state changes"
    assert device.state() == state


def test_an_error_may_stop_a_node_that_was_not_started(dst: Build) -> None:
    device = dst()
    device.set(x4000=2)
    assert device.fail(0x1000, 4) == [x_error(0x10)]
    assert device.state() == "stopped"


def test_an_error_that_stays_is_told_once(dst: Build) -> None:
    device = dst()
    assert device.tilt(60.0) == [x_error()]
    assert device.tilt(61.0) == []
    assert device.tilt(-60.0) == []


def test_every_change_of_the_errors_or_the_first_and_the_last_are_told(dst: Build) -> None:
    for reading, told in ((1, [x_error(0x01), x_error(0x03)]), (2, [x_error(0x01)])):
        device = dst({"DST-31": reading})
        frames = device.tilt(60.0) + device.tilt(60.0, 60.0)
        assert frames == told
        assert device.read(0x4001) == 0x03
        left = device.tilt(0.0, 60.0)
        assert left == (["0FF#0000000002000000"] if reading == 1 else [])
        assert device.tilt(0.0, 0.0) == [GONE]


def test_an_error_found_at_the_start_is_told_behind_the_boot_up_message(dst: Build) -> None:
    device = dst()
    device.device.world.tilt_x_deg = 60.0
    assert device.reset() == ["77F#00", x_error()]


@pytest.mark.parametrize("reading", [1, 2])
def test_errors_within_the_inhibit_time(gim: Build, reading: int) -> None:
    device = gim({"GIM-120": reading})
    device.set(x1015=1000)
    start = device.now_ns
    first, second, third = (
        "081#0010010000000000",
        "081#1081110000000000",
        "081#1082110000000000",
    )
    assert device.fail(0x1000) == [first]
    assert device.fail(0x8110) + device.fail(0x8210) == []
    assert device.run(0.099) == []
    late = device.run(0.25)
    assert late == ([second, third] if reading == 1 else [])
    if reading == 1:
        *_, (at, _), (then, _) = device.heard
        assert (at - start, then - start) == (100_000_000, 200_000_000)
    device.set(x1015=0)
    assert device.recover(0x1000) + device.recover(0x8110) == [
        "081#0000110000000000",
        "081#0000110000000000",
    ]


def test_an_emcy_that_is_not_valid_is_not_sent(gim: Build) -> None:
    device = gim()
    device.set(x1014=0x8000_0081)
    assert device.fail(0x1000) == []
    assert device.read(0x1001) == 1


def test_a_defective_sensor_sets_its_status_bit(ims: Build) -> None:
    device = ims({"IMS-119": 2})
    assert device.read("0x3000:1") == 0
    for code in (0xFF01, 0xFF02):
        assert device.fail(code) == [f"0B2#{code & 0xFF:02X}FF810000000000"]
        assert device.read("0x3000:1") == 2
        device.recover(code)
        assert device.read("0x3000:1") == 0
    device.fail(0x3100)
    assert device.read("0x3000:1") == 0, "the supply is not the sensor"


@pytest.mark.parametrize(("variant", "status"), [("one-axis", 4), ("two-axis", 5)])
def test_a_status_byte_tells_axes_and_factory_settings(
    ims: Build, variant: str, status: int
) -> None:
    device = ims(variant=variant)
    assert device.read("0x3000:1") == status
    device.set(x1017=100)
    assert device.read("0x3000:1") == status - 4, "a setting deviates"
    device.save_and_reset()
    assert device.read("0x3000:1") == status - 4
    device.set(x1017=0)
    assert device.read("0x3000:1") == status
    device.fail(0xFF02)
    assert device.read("0x3000:1") == status | 2
    assert device.write("0x3120:1", 1 - (status & 1)) == "ok"
    assert device.read("0x3000:1") == 3 - (status & 1)
