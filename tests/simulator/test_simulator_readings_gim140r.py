"""What shows on the bus of each reading of the GIM140R's manual that changes a service or a rule."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"
Watch: TypeAlias = "Callable[[Wired], object]"

CONFIGURE = "7E5#0401000000000000"


def automatic_start(device: Wired) -> object:
    return device.state()


def start_up_object(device: Wired) -> object:
    device.set(x1F80=0)
    device.save_and_reset()
    return device.state()


def second_tpdo(device: Wired) -> object:
    device.nmt(0x01)
    return [frame[:4] for frame in device.run(0.01, "080#")]


def reset_communication(device: Wired) -> object:
    device.set(x2196=5)
    device.reset("reset communication")
    return device.read(0x2196)


def load(device: Wired) -> object:
    device.set(x1017=50)
    device.load()
    return device.read(0x1017)


def sync_and_lss(device: Wired) -> object:
    device.set(x1800_2=1)
    device.nmt(0x01)
    frames = device.run(0.01, "080#")
    device.nmt(0x02)
    frames += device.run(0.01, CONFIGURE, "7E5#5E00000000000000")
    return [frame[:4] for frame in frames]


def second_start(device: Wired) -> object:
    device.set(x1017=50)
    device.save()
    device.load()
    seen = []
    for _ in range(2):
        device.reset()
        seen.append(device.read(0x1017))
    return seen


def segmented(device: Wired) -> object:
    return device.ask("21 17 10 00 02 00 00 00")


def load_node_id(device: Wired) -> object:
    device.set(x3001=5)
    device.save_and_reset()
    device.load()
    return device.reset()


def saved_node_id(device: Wired) -> object:
    device.set(x2101=5)
    return device.save_and_reset()


def unsaved_node_id(device: Wired) -> object:
    device.set(x2101=5)
    device.run(0.05)
    now = device.device.node_id
    return now, device.reset()


def alias(device: Wired) -> object:
    device.set(x3001=5, x3000=2)
    return device.read(0x2101), device.read(0x2100)


def resolution(device: Wired) -> object:
    device.tilt(12.3)
    device.set(x6000=10)
    seen = device.read(0x6010)
    device.save_and_reset()
    return seen, device.read(0x6010)


def resolution_change(device: Wired) -> object:
    device.set(x6014=50, x6024=7, x6000=10)
    return [device.read(it) for it in (0x6014, 0x6114, 0x6024, 0x6124)]


def twins(device: Wired) -> object:
    device.set(x6012=5, x6113=7, x6014=9, x6111=3)
    device.set(x6022=5, x6123=7)
    return [device.read(it) for it in (0x6112, 0x6013, 0x6122, 0x6023, 0x6114, 0x6011)]


def inversion(device: Wired) -> object:
    device.tilt(12.3, 12.3)
    device.set(x6011=3, x6021=3, x6014=50, x6024=50)
    return [device.read(it) for it in (0x6010, 0x6110, 0x6020, 0x6120)]


def unscaled_preset(device: Wired) -> object:
    device.set(x6011=0, x6021=0)
    return [device.write(it, 0) for it in (0x6012, 0x6112, 0x6022, 0x6122)]


def preset_reads(device: Wired) -> object:
    device.set(x6012=9, x6022=9)
    return [device.read(it) for it in (0x6012, 0x6112, 0x6022, 0x6122)]


def transmission_type(device: Wired) -> object:
    return [device.write("0x1800:2", it) for it in (0, 241, 253)]


def cob_id_of_the_tpdo(device: Wired) -> object:
    device.nmt(0x01)
    return device.write("0x1800:1", 0x201), [frame[:4] for frame in device.run(0.1)]


def tpdo(device: Wired) -> object:
    return len(device.nmt(0x01, 0.01)[0])


def mapped_objects(device: Wired) -> object:
    device.set(x1800_1=0x8000_0181, x1A00_0=0)
    for place in (1, 2, 3):
        assert device.write(f"0x1A00:{place}", 0x2199_0008) == "ok"
    if (0x1A00, 4) in device.device.spec.entries:
        device.set(x1A00_4=0x2199_0008)
    return device.write("0x1A00:0", 4)


def mapping_while_valid(device: Wired) -> object:
    return device.write("0x1A00:0", 0)


def least_cycle(device: Wired) -> object:
    device.nmt(0x01)
    answer = device.write("0x1800:5", 10)
    device.run(0.2)
    return answer, device.read("0x1800:5"), device.periods_ms(1.0, "181")


def cob_ids_at_another_node_id(device: Wired) -> object:
    device.set(x1014=0x8000_0081, x1800_1=0x8000_0181)
    device.set(x1014=0x84, x1800_1=0x184, x3001=9)
    device.save_and_reset()
    return device.read(0x1014), device.read("0x1800:1")


def cob_id_of_emcy(device: Wired) -> object:
    return device.write(0x1014, 0x87), device.fail(0x1000)


def error_in_stopped(device: Wired) -> object:
    device.nmt(0x02)
    frames = device.fail(0x1000)
    return frames, device.state()


def octets(device: Wired) -> object:
    return device.fail(0x1000)


def gone(device: Wired) -> object:
    device.fail(0x1000)
    return device.recover(0x1000), device.read("0x1003:1")


def heartbeat(device: Wired) -> object:
    return device.write(0x1017, 5), device.read(0x1017), device.periods_ms(1.0, "701")


def lss_outside_stopped(device: Wired) -> object:
    return device.run(0.01, CONFIGURE, "7E5#5E00000000000000")


def lss_node_id(device: Wired) -> object:
    configure = [CONFIGURE, "7E5#1105000000000000"]
    device.nmt(0x02)
    device.run(0.01, *configure)
    reset = device.reset()
    device.nmt(0x02)
    device.run(0.01, *configure, "7E5#1700000000000000")
    return reset, device.reset()


def activation(device: Wired) -> object:
    device.nmt(0x02)
    device.run(0.01, CONFIGURE, "7E5#1300020000000000", "7E5#1500000000000000")
    return device.device.bitrate


def search(device: Wired) -> object:
    device.nmt(0x02)
    octets = ("465F", "474005", "48", "49", "4A01", "4B01")
    return device.run(0.01, *(f"7E5#{it:0<16}" for it in octets))


def node_id_inquiry(device: Wired) -> object:
    device.nmt(0x02)
    return device.run(0.01, CONFIGURE, "7E5#5E00000000000000")


def vendor_inquiry(device: Wired) -> object:
    device.nmt(0x02)
    return device.run(0.01, CONFIGURE, "7E5#5A00000000000000", "7E5#5D00000000000000")


def selection(device: Wired) -> object:
    device.nmt(0x02)
    return device.run(0.01, *(f"7E5#{it:0<16}" for it in ("405F", "414005", "42", "4301")))


def text(device: Wired) -> object:
    return device.ask("40 0A 10 00 00 00 00 00")


def inhibited(device: Wired) -> object:
    device.set(x1015=1000)
    return device.fail(0x1000) + device.fail(0x8110) + device.run(0.2)


def enabled(device: Wired) -> object:
    before = device.fail(0x1000)
    device.recover(0x1000)
    device.set(x1014=0x80000081)
    device.set(x1014=0x40000081)
    return before, device.fail(0x1000)


REFUSED = "abort 06090030h"
CASES: dict[str, tuple[Watch, dict[int, object]]] = {
    "GIM-12": (second_tpdo, {1: [], 2: ["281#"]}),
    "GIM-13": (sync_and_lss, {1: ["181#", "7E4#"], 2: []}),
    "GIM-14": (reset_communication, {1: 0, 2: 5}),
    "GIM-16": (automatic_start, {1: "pre-operational", 2: "operational"}),
    "GIM-17": (start_up_object, {1: "operational", 2: "pre-operational"}),
    "GIM-20": (load, {1: 50, 2: 0}),
    "GIM-21": (load_node_id, {1: ["701#00"], 2: ["705#00"]}),
    "GIM-25": (saved_node_id, {1: ["705#00"], 2: ["701#00"]}),
    "GIM-26": (unsaved_node_id, {1: (1, ["701#00"]), 2: (1, ["705#00"]), 3: (5, ["701#00"])}),
    "GIM-31": (alias, {1: (5, 2), 2: (1, 3)}),
    "GIM-35": (resolution, {1: (1230, 1230), 2: (123, 1230)}),
    "GIM-36": (resolution_change, {1: [50, 50, 7, 7], 2: [500, 500, 70, 70]}),
    "GIM-43": (twins, {1: [5, 7, 5, 7, 9, 3], 2: [0, -100, 0, 48, 9, 3]}),
    "GIM-45": (inversion, {1: [50 - 123] * 4, 2: [-50 - 123] * 4}),
    "GIM-48": (unscaled_preset, {1: ["ok"] * 4, 2: ["abort 08000022h"] * 4}),
    "GIM-49": (preset_reads, {1: [9] * 4, 2: [0] * 4}),
    "GIM-56": (transmission_type, {1: [REFUSED] * 3, 2: ["ok"] * 3}),
    "GIM-58": (cob_id_of_the_tpdo, {1: (REFUSED, ["181#"]), 2: ("ok", ["201#"])}),
    "GIM-59": (tpdo, {1: 4 + 2 * 6, 2: 4 + 2 * 8}),
    "GIM-69": (mapped_objects, {1: "abort 06040042h", 2: "ok"}),
    "GIM-70": (mapping_while_valid, {1: "abort 06010000h", 2: "ok"}),
    "GIM-76": (least_cycle, {1: (REFUSED, 100, [100]), 2: ("ok", 10, [20]), 3: ("ok", 100, [100])}),
    "GIM-83": (cob_ids_at_another_node_id, {1: (0x8C, 0x18C), 2: (0x89, 0x18C)}),
    "GIM-84": (cob_ids_at_another_node_id, {1: (0x8C, 0x18C), 2: (0x8C, 0x184)}),
    "GIM-85": (
        cob_id_of_emcy,
        {
            1: (REFUSED, ["081#0010010000000000"]),
            2: ("ok", ["087#0010010000000000"]),
        },
    ),
    "GIM-86": (octets, {1: ["081#0010010000000000"], 2: ["081#001001A5A5A5A5A5"]}),
    "GIM-90": (error_in_stopped, {1: ([], "stopped"), 2: ([], "pre-operational")}),
    "GIM-94": (gone, {1: (["081#0000000000000000"], 0x1000), 2: ([], 0)}),
    "GIM-95": (
        error_in_stopped,
        {1: ([], "stopped"), 2: (["081#0010010000000000"], "stopped")},
    ),
    "GIM-100": (heartbeat, {1: (REFUSED, 0, []), 2: ("ok", 25, [25])}),
    "GIM-102": (lss_outside_stopped, {1: [], 2: ["7E4#5E01000000000000"]}),
    "GIM-104": (activation, {1: 500_000, 2: 250_000}),
    "GIM-105": (search, {1: ["7E4#4F00000000000000"], 2: []}),
    "GIM-106": (node_id_inquiry, {1: ["7E4#5E01000000000000"], 2: []}),
    "GIM-107": (
        vendor_inquiry,
        {
            1: ["7E4#5A5F000000000000", "7E4#5D01000000000000"],
            2: ["7E4#5D01000000000000"],
        },
    ),
    "GIM-109": (selection, {1: ["7E4#4400000000000000"], 2: ["7E4#4401000000000000"]}),
    "GIM-117": (text, {1: "41 0A 10 00 04 00 00 00", 2: "43 0A 10 00 31 2E 33 30"}),
    "GIM-119": (
        enabled,
        {
            1: (["081#0010010000000000"], ["081#0010010000000000"]),
            3: ([], ["081#0010010000000000"]),
        },
    ),
    "GIM-120": (
        inhibited,
        {
            1: ["081#0010010000000000", "081#1081110000000000"],
            2: ["081#0010010000000000"],
        },
    ),
    "GIM-136": (second_start, {1: [0, 0], 2: [0, 50]}),
    "GIM-140": (lss_node_id, {1: (["705#00"], ["705#00"]), 2: (["701#00"], ["705#00"])}),
    "GIM-146": (segmented, {1: "80 17 10 00 00 00 01 06", 2: "60 17 10 00 00 00 00 00"}),
}

NOT_ON_THE_BUS = {
    "GIM-91": "see test_simulator_bus_errors.py",
    "GIM-143": "see test_simulator_bus_errors.py",
    "GIM-54": "the simulated device filters nothing; see test_simulator_starts.py",
    "GIM-87": "no error code of the manual belongs to bit 5",
    "GIM-92": "an error that is raised from outside brings its code",
}


@pytest.mark.parametrize(
    ("ambiguity", "reading"), [(it, number) for it in CASES for number in CASES[it][1]]
)
def test_a_reading_shows_on_the_bus(gim: Build, ambiguity: str, reading: int) -> None:
    watch, seen = CASES[ambiguity]
    assert watch(gim({ambiguity: reading})) == seen[reading]


def test_every_reading_is_told_from_the_first() -> None:
    for watch, seen in CASES.values():
        assert seen[1] not in [seen[number] for number in seen if number > 1], watch


def test_no_reading_is_left_out(rule_readings: Callable[[str], set[tuple[str, int]]]) -> None:
    tried = {(it, number) for it in CASES for number in CASES[it][1]}
    missing = rule_readings("baumer_gim140r") - tried
    assert {it for it, _ in missing} == set(NOT_ON_THE_BUS)
