"""What shows on the bus of each reading of the DST X730's guide that changes a service or a rule."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"
Watch: TypeAlias = "Callable[[Wired], object]"

REFUSED = "abort 06090030h"
X, Y, GONE = "0FF#0010000001000000", "0FF#0010000002000000", "0FF#0000000000000000"
ON_TWO, X_AND_Y = "0FF#0010000003000000", "0FF#0000000002000000"


def restored_node_id(device: Wired) -> object:
    device.set(x20F0=6, x20F1=6)
    device.reset()
    device.load()
    return device.reset()


def saved_settings(device: Wired) -> object:
    device.set(x1017=100, x6014=7)
    device.save()
    device.reset("power cycle")
    return device.read(0x1017), device.read(0x6014)


def heartbeat(device: Wired) -> object:
    device.set(x1017=40)
    return device.write(0x1017, 5), device.read(0x1017), device.periods_ms(1.0, "77F")


def x_error(device: Wired) -> object:
    return device.tilt(60.0)


def error_register(device: Wired) -> object:
    return device.tilt(60.0), device.read(0x1001)


def two_errors(device: Wired) -> object:
    frames = device.tilt(60.0) + device.tilt(60.0, 60.0)
    return frames + device.tilt(0.0, 60.0) + device.tilt(0.0, 0.0)


def y_error(device: Wired) -> object:
    return device.tilt(0.0, 60.0), device.read(0x4001)


def big_endian(device: Wired) -> object:
    device.set(x6000=10, x5001=0)
    device.tilt(10.0, -10.0)
    return device.nmt(0x01, 0.01)[0]


def back_inside(device: Wired) -> object:
    return device.tilt(60.0) + device.tilt(0.0)


def stop(device: Wired) -> object:
    device.tilt(60.0, -60.0)
    return device.read(0x6010), device.read(0x6020)


def half_a_turn(device: Wired) -> object:
    return device.tilt(181.0)


def error_in_stopped(device: Wired) -> object:
    device.nmt(0x02)
    return device.tilt(60.0)


def cob_id_of_emcy(device: Wired) -> object:
    answers = [device.write(0x1014, it) for it in (0x701, 0x90)]
    return answers, device.tilt(60.0)


def serious_errors(device: Wired) -> object:
    device.set(x4000=2)
    device.nmt(0x01)
    device.tilt(60.0)
    states = [device.state()]
    device.fail(0x1000, 4)
    return [*states, device.state()]


def restored_setting_at_the_second_start(device: Wired) -> object:
    restored_setting(device)
    device.reset("power cycle")
    return device.read(0x4000)


def text(device: Wired) -> object:
    return device.ask("40 08 10 00 00 00 00 00")


def short_answers(device: Wired) -> object:
    return [device.ask(f"40 {it} 00 00 00 00") for it in ("17 10 00", "01 10 00", "08 10 00")]


def without_size(device: Wired) -> object:
    return device.ask("22 17 10 00 64 00 00 00"), device.read(0x1017)


def short_event_time(device: Wired) -> object:
    device.nmt(0x01)
    answer = device.write("0x1800:5", 2)
    device.run(0.2)
    return answer, device.periods_ms(0.5, "1FF")


def no_event_time(device: Wired) -> object:
    device.set(x1800_5=0)
    return len(device.nmt(0x01, 0.5))


def tpdo(device: Wired) -> object:
    return len(device.nmt(0x01, 0.01)[0])


def restored_setting(device: Wired) -> object:
    device.set(x4000=2)
    device.save_and_reset()
    device.load()
    device.reset()
    return device.read(0x4000)


def transmission_type(device: Wired) -> object:
    return [device.write("0x1800:2", it) for it in (0, 252, 253, 255)]


def half_a_pair(device: Wired) -> object:
    device.set(x20F0=6, x20F2=2)
    return device.read(0x20F0), device.read(0x20F2)


def node_id_by_reset(device: Wired) -> object:
    device.set(x20F0=6, x20F1=6)
    return device.reset()


def automatic_start(device: Wired) -> object:
    device.set(x5000=1)
    device.save_and_reset()
    return device.state()


def resolution_without_scaling(device: Wired) -> object:
    device.set(x6021=0)
    return device.write(0x6000, 10), device.read(0x6000)


def resolution(device: Wired) -> object:
    device.set(x6012=100, x6014=20, x6022=100, x6024=20, x6000=10)
    objects = (0x6012, 0x6013, 0x6014, 0x6022, 0x6023, 0x6024)
    return [device.read(it) for it in objects]


def without_scaling(device: Wired) -> object:
    device.tilt(10.0, 10.0)
    device.set(x6000=100, x6014=10, x6011=0, x6024=10, x6021=0)
    return device.read(0x6010), device.read(0x6020)


def preset_reads(device: Wired) -> object:
    device.set(x6012=9, x6022=9)
    return device.read(0x6012), device.read(0x6022)


def preset(device: Wired) -> object:
    device.tilt(10.0, 10.0)
    device.set(x6014=20, x6012=0, x6024=20, x6022=0)
    return [device.read(it) for it in (0x6010, 0x6013, 0x6020, 0x6023)]


def event_time(device: Wired) -> object:
    device.set(x1800_5=20)
    device.nmt(0x01, 0.2)
    return device.periods_ms(0.5, "1FF")


def inversion(device: Wired) -> object:
    device.tilt(10.0, 10.0)
    device.set(x6011=3, x6014=20, x6021=3, x6024=20)
    return device.read(0x6010), device.read(0x6020)


def turned_further(device: Wired) -> object:
    device.tilt(200.0)
    return device.read(0x6010)


def filter_after_a_save(device: Wired) -> object:
    device.set(x2001=2)
    device.save()
    device.device.tilt(40.0, 0.0)
    device.run(0.1)
    return int(device.read(0x6010)) > 700


def light_in_stopped(device: Wired) -> object:
    device.nmt(0x02)
    return sum(device.device.lit("green", ms * 1_000_000) for ms in range(6000)) / 6000


CASES: dict[str, tuple[Watch, dict[int, object]]] = {
    "DST-62": (turned_further, {1: -3200, 2: 4000}),
    "DST-104": (filter_after_a_save, {1: True, 2: False}),
    "DST-126": (light_in_stopped, {1: 3000 / 6000, 2: 1000 / 6000}),
    "DST-14": (restored_node_id, {1: ["77F#00"], 2: ["706#00"]}),
    "DST-16": (saved_settings, {1: (0, 0), 2: (100, 7)}),
    "DST-22": (
        heartbeat,
        {1: (REFUSED, 40, [40]), 2: ("ok", 20, [20]), 3: ("ok", 40, [40])},
    ),
    "DST-26": (serious_errors, {1: ["stopped", "stopped"], 2: ["operational", "stopped"]}),
    "DST-27": (x_error, {1: [X], 2: ["0FF#0010000100000000"]}),
    "DST-28": (error_register, {1: ([X], 0), 2: (["0FF#0010010001000000"], 1)}),
    "DST-31": (two_errors, {1: [X, ON_TWO, X_AND_Y, GONE], 2: [X, GONE]}),
    "DST-32": (x_error, {1: [X], 2: [Y]}),
    "DST-33": (y_error, {1: ([Y], 2), 2: ([X], 1)}),
    "DST-36": (stop, {1: (990, -990), 2: (1200, -1200)}),
    "DST-37": (half_a_turn, {1: [], 2: [X]}),
    "DST-40": (error_in_stopped, {1: [], 2: [X]}),
    "DST-42": (cob_id_of_emcy, {1: ([REFUSED] * 2, [X]), 2: (["ok"] * 2, [f"090{X[3:]}"])}),
    "DST-43": (
        short_answers,
        {
            1: ["4B 17 10 00 00 00 00 00", "4F 01 10 00 00 00 00 00", "47 08 10 00 47 49 42 00"],
            2: ["42 17 10 00 00 00 00 00", "42 01 10 00 00 00 00 00", "47 08 10 00 47 49 42 00"],
        },
    ),
    "DST-44": (text, {1: "47 08 10 00 47 49 42 00", 2: "41 08 10 00 03 00 00 00"}),
    "DST-45": (
        without_size,
        {1: ("60 17 10 00 00 00 00 00", 100), 2: ("80 17 10 00 01 00 04 05", 0)},
    ),
    "DST-50": (short_event_time, {1: (REFUSED, [100]), 2: ("ok", [2])}),
    "DST-51": (no_event_time, {1: 0, 2: 1}),
    "DST-52": (tpdo, {1: 4 + 2 * 4, 2: 4 + 2 * 8}),
    "DST-65": (big_endian, {1: "1FF#03E8FC18", 2: "1FF#FC1803E8"}),
    "DST-79": (restored_setting, {1: 1, 2: 2}),
    "DST-87": (transmission_type, {1: [REFUSED] * 4, 2: ["ok"] * 4}),
    "DST-94": (half_a_pair, {1: (6, 2), 2: (127, 3)}),
    "DST-96": (node_id_by_reset, {1: ["706#00"], 2: ["77F#00"]}),
    "DST-97": (node_id_by_reset, {1: ["706#00"], 2: ["77F#00"]}),
    "DST-106": (automatic_start, {1: "operational", 2: "pre-operational"}),
    "DST-108": (resolution_without_scaling, {1: ("abort 08000022h", 50), 2: ("ok", 50)}),
    "DST-109": (resolution, {1: [0] * 6, 2: [100, 0, 20, 100, 0, 20]}),
    "DST-112": (without_scaling, {1: (100, 100), 2: (110, 110), 3: (200, 200)}),
    "DST-116": (preset_reads, {1: (9, 9), 2: (0, 0)}),
    "DST-117": (preset, {1: [20, -200, 20, -200], 2: [0, -220, 0, -220]}),
    "DST-122": (event_time, {1: [20], 2: [100]}),
    "DST-133": (inversion, {1: (-180, -180), 2: (-220, -220)}),
    "DST-137": (back_inside, {1: [X, GONE], 3: [X]}),
    "DST-143": (restored_setting_at_the_second_start, {1: 1, 2: 2}),
}

VARIANTS = {"DST-37": "z-360", "DST-62": "z-360"}

NOT_HERE = {
    "DST-125": "shown by `test_simulator_tpdo_readings.py`",
    "DST-82": "1800h:03 is read-only and 0, in either unit",
    "DST-138": "1014h is not stored under the first reading of DST-16, so a new node-ID finds none",
}


@pytest.mark.parametrize(
    ("ambiguity", "reading"), [(it, number) for it in CASES for number in CASES[it][1]]
)
def test_a_reading_shows_on_the_bus(dst: Build, ambiguity: str, reading: int) -> None:
    watch, seen = CASES[ambiguity]
    device = dst({ambiguity: reading}, variant=VARIANTS.get(ambiguity, "xy-45"))
    assert watch(device) == seen[reading]


@pytest.mark.parametrize(("reading", "cob_id"), [(1, 0x90), (2, 0x17), (3, 0x86)])
def test_a_stored_cob_id_at_another_node_id(dst: Build, reading: int, cob_id: int) -> None:
    device = dst({"DST-16": 2, "DST-138": reading})
    device.set(x1014=0x8000_00FF)
    device.set(x1014=0x90, x20F0=6, x20F1=6)
    device.save_and_reset()
    assert device.read(0x1014) == cob_id


def test_every_reading_is_told_from_the_first() -> None:
    for watch, seen in CASES.values():
        assert seen[1] not in [seen[number] for number in seen if number > 1], watch


def test_no_reading_is_left_out(rule_readings: Callable[[str], set[tuple[str, int]]]) -> None:
    tried = {(it, number) for it in CASES for number in CASES[it][1]}
    missing = rule_readings("danfoss_dst_x730") - tried
    assert {it for it, _ in missing} == set(NOT_HERE)
