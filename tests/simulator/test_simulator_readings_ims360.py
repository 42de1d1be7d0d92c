"""What shows on the bus of each reading of the IMS360's manual that changes a service or a rule."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"
Watch: TypeAlias = "Callable[[Wired], object]"

REFUSED = "abort 06090030h"


def at_node_5(device: Wired) -> Wired:
    device.set(x2002=5)
    device.save_and_reset()
    return device


def restored_by_group_1(device: Wired) -> object:
    at_node_5(device).load(1)
    return device.reset()


def restored_by_group_2(device: Wired) -> object:
    at_node_5(device).load(2)
    return device.reset()


def frame_of_an_error(device: Wired) -> object:
    return device.fail(0x3100)


def history(device: Wired) -> object:
    device.fail(0x3100)
    device.recover(0x3100)
    return device.read("0x1003:0"), int(str(device.read("0x1003:1"))) & 0xFFFF


def lateral_axis(device: Wired) -> object:
    return device.tilt(0.0, 95.0)


def out_of_range(device: Wired) -> object:
    return device.tilt(95.0)


def clearing(device: Wired) -> object:
    device.fail(0x3100)
    return device.write("0x1003:0", 1), device.read("0x1003:0")


def cob_ids(device: Wired) -> object:
    seen = [device.write(0x1014, it) for it in (0xB3, 0x701)]
    device.set(x1800_1=0x8000_01B2)
    return [*seen, device.write("0x1800:1", 0x701), device.write(0x1005, 0x701)]


def mapping_in_use(device: Wired) -> object:
    device.set(x1800_5=20)
    device.nmt(0x01, 0.05)
    answer, before = device.write("0x1A00:0", 0), device.run(0.1)
    device.set(x1800_1=0x8000_01B2)
    device.set(x1800_1=0x1B2)
    return answer, bool(before), bool(device.run(0.1))


def restored_by_group_4(device: Wired) -> object:
    at_node_5(device).load(4)
    return device.reset()


def status_bit(device: Wired) -> object:
    seen = []
    for code in (0x3100, 0xFF00, 0xFF01, 0xFF02):
        device.fail(code)
        seen.append(int(str(device.read("0x3000:1"))) & 2)
        device.recover(code)
    return seen


def saved_node_id(device: Wired) -> object:
    device.set(x2002=5)
    return device.save_and_reset()


def node_id(device: Wired) -> object:
    device.set(x2002=5)
    device.run(0.05)
    now = device.device.node_id
    device.reset()
    return now, device.device.node_id


def bit_rate(device: Wired) -> object:
    device.set(x2001=500_000)
    device.run(0.05)
    now = device.device.bitrate
    device.reset()
    return now, device.device.bitrate


def restore(device: Wired) -> object:
    device.set(x1017=100)
    device.save()
    device.load()
    seen = [device.read(0x1017)]
    for _ in range(2):
        device.reset()
        seen.append(device.read(0x1017))
    return seen


def remote_types(device: Wired) -> object:
    return [device.write("0x1800:2", it) for it in (252, 253)]


def other_types(device: Wired) -> object:
    return [device.write("0x1803:2", it) for it in (0, 241, 251)]


def inhibit_time(device: Wired) -> object:
    device.set(x1800_1=0x8000_01B2, x1800_3=200)
    device.set(x1800_1=0x1B2, x1800_2=254, x1800_5=10)
    device.nmt(0x01, 0.5)
    return min(device.periods_ms(2.0, "1B2"))


def while_valid(device: Wired) -> object:
    return device.write("0x1800:1", 0x201), device.write("0x1800:3", 5)


def heartbeat(device: Wired) -> object:
    return device.write(0x1017, 5), device.read(0x1017), device.periods_ms(1.0, "732")


def search(device: Wired) -> object:
    identity = [0x195, 0x1869F, 0, 0, 1, 1]
    frames = (
        f"7E5#{0x46 + n:02X}{it.to_bytes(4, 'little').hex()}000000" for n, it in enumerate(identity)
    )
    return device.run(0.01, *frames)


def status(device: Wired) -> object:
    before = device.read("0x3000:1")
    device.fail(0xFF01)
    return before, device.read("0x3000:1")


def new_filter(device: Wired) -> object:
    device.set(x3110_1=1, x3111=20000)
    return device.write("0x3110:1", 2), device.read(0x3111)


def measuring_range(device: Wired) -> object:
    device.set(x3120_1=0)
    now = device.read("0x3000:1")
    device.save_and_reset()
    return now, device.read("0x3000:1")


def red_light_in_lss(device: Wired) -> object:
    device.run(0.1, "7E5#0401000000000000")
    return {device.device.lit("red", ms * 1_000_000) for ms in range(0, 200, 10)}


def back_from_bus_off(device: Wired) -> object:
    device.device.disturb("bus-off")
    device.device.end_disturbance()
    return device.run(0.1)


def zeroed(device: Wired) -> object:
    device.tilt(10.5, -4.25)
    device.set(x3200=3)
    return [device.read(it) for it in (0x3210, 0x3220, 0x6110, 0x6120)]


def lss_node_id(device: Wired) -> object:
    device.run(0.01, "7E5#0401000000000000", "7E5#1105000000000000")
    configured = device.run(0.3, "000#8232")
    device.run(0.01, "7E5#0401000000000000", "7E5#1105000000000000", "7E5#1700000000000000")
    return configured, device.run(0.3, f"000#82{device.device.node_id:02X}")


CASES: dict[str, tuple[Watch, dict[int, object]]] = {
    "IMS-07": (red_light_in_lss, {1: {True, False}, 2: {False}}),
    "IMS-14": (restored_by_group_2, {1: ["705#00"], 2: ["732#00"]}),
    "IMS-15": (restored_by_group_1, {1: ["732#00"], 2: ["705#00"]}),
    "IMS-25": (remote_types, {1: ["ok"] * 2, 2: [REFUSED] * 2}),
    "IMS-30": (other_types, {1: [REFUSED] * 3, 2: ["ok"] * 3}),
    "IMS-31": (inhibit_time, {1: 20, 2: 200}),
    "IMS-35": (while_valid, {1: (REFUSED, REFUSED), 2: ("ok", "ok")}),
    "IMS-41": (
        mapping_in_use,
        {1: ("abort 06010000h", True, True), 2: ("ok", True, False)},
    ),
    "IMS-54": (frame_of_an_error, {1: ["0B2#0031810000000000"], 2: ["0B2#003181A5A5A5A5A5"]}),
    "IMS-56": (history, {1: (1, 0x3100), 2: (2, 0)}),
    "IMS-59": (lateral_axis, {1: [], 2: ["0B2#2050810000000000"]}),
    "IMS-62": (heartbeat, {1: (REFUSED, 0, []), 2: ("ok", 10, [10])}),
    "IMS-67": (search, {1: [], 2: ["7E4#4F00000000000000"]}),
    "IMS-85": (clearing, {1: (REFUSED, 1), 2: ("ok", 1)}),
    "IMS-87": (cob_ids, {1: [REFUSED] * 4, 2: ["ok"] * 4}),
    "IMS-95": (saved_node_id, {1: ["705#00"], 2: ["732#00"]}),
    "IMS-98": (restore, {1: [100, 0, 100], 2: [100, 100, 100], 3: [0, 100, 100]}),
    "IMS-109": (
        bit_rate,
        {1: (125_000, 125_000), 2: (125_000, 500_000), 3: (500_000, 125_000)},
    ),
    "IMS-110": (node_id, {1: (50, 50), 2: (50, 5), 3: (5, 50)}),
    "IMS-119": (status, {1: (5, 7), 2: (0, 2)}),
    "IMS-126": (
        new_filter,
        {1: ("abort 06090031h", 20000), 2: ("ok", 8000), 3: ("ok", 20000)},
    ),
    "IMS-57": (back_from_bus_off, {1: ["0B2#14FF000000000000"], 2: ["0B2#4081000000000000"]}),
    "IMS-131": (measuring_range, {1: (0, 0), 2: (1, 0)}),
    "IMS-135": (zeroed, {1: [-1050, 425, 0, 0], 2: [1050, -425, 0, 0]}),
    "IMS-138": (zeroed, {1: [-1050, 425, 0, 0], 2: [-1050, 425, 1050, -425]}),
    "IMS-157": (lss_node_id, {1: (["705#00"], ["705#00"]), 2: (["732#00"], ["705#00"])}),
    "IMS-142": (out_of_range, {1: ["0B2#1050810000000000"], 2: []}),
    "IMS-150": (status_bit, {1: [0, 0, 2, 2], 2: [2, 2, 2, 2], 3: [0, 0, 0, 0]}),
    "IMS-153": (restored_by_group_4, {1: ["732#00"], 2: ["705#00"]}),
}

VARIANTS = {"IMS-59": "one-axis"}


@pytest.mark.parametrize(
    ("ambiguity", "reading"), [(it, number) for it in CASES for number in CASES[it][1]]
)
def test_a_reading_shows_on_the_bus(ims: Build, ambiguity: str, reading: int) -> None:
    watch, seen = CASES[ambiguity]
    device = ims({ambiguity: reading}, variant=VARIANTS.get(ambiguity, "two-axis"))
    assert watch(device) == seen[reading]


def test_every_reading_is_told_from_the_first() -> None:
    for watch, seen in CASES.values():
        assert seen[1] not in [seen[number] for number in seen if number > 1], watch


SHOWN_BY_TPDOS = {"IMS-27", "IMS-29", "IMS-33", "IMS-152"}
"""In `test_simulator_tpdo_readings.py`."""


def test_no_reading_is_left_out(rule_readings: Callable[[str], set[tuple[str, int]]]) -> None:
    tried = {(it, number) for it in CASES for number in CASES[it][1]}
    missing = rule_readings("siko_ims360") - tried
    assert {it for it, _ in missing} == SHOWN_BY_TPDOS
