"""A device beside its model: what the manual says is no difference, a lapse is one."""

from __future__ import annotations

import pytest

from conformance.explore.laboratory import Laboratory
from conformance.explore.shortest import Finding, Steps, shortest
from conformance.explore.steps import Download, Nmt, Sync, Upload, Wait
from conformance.options import RunOptions

DEVICE = "danfoss_dst_x730"
STOP, START, RESET_NODE, RESET_COMMUNICATION = Nmt(2), Nmt(1), Nmt(129), Nmt(130)
HEARTBEAT = Download((0x1017, 0), b"\x64\x00")
EVENT_TIME = Download((0x1800, 5), b"\x64\x00")
NO_TPDO = Download((0x1800, 1), (0x8000_01FF).to_bytes(4, "little"))
STORE = Download((0x1010, 1), b"save")
NONE_MAPPED = Download((0x1A00, 0), b"\x00")

LAPSES: dict[str, Steps] = {
    "lapse-heartbeat-after-stop": (HEARTBEAT, STOP, Upload((0x1000, 0)), START, Wait(150)),
    "lapse-event-time-after-sync": (
        NO_TPDO,
        EVENT_TIME,
        Download((0x1800, 3), b"\x0a\x00"),
        Sync(),
        Upload((0x1800, 5)),
    ),
    "lapse-tpdo-after-stop": (EVENT_TIME, START, Sync(), STOP, START),
    "lapse-mapping-after-reset": (
        NO_TPDO,
        NONE_MAPPED,
        NONE_MAPPED,
        RESET_COMMUNICATION,
        EVENT_TIME,
        START,
    ),
    "lapse-sdo-after-sync": (START, Sync(), STOP, START, Upload((0x1000, 0))),
    "lapse-tpdo-after-store": (Upload((0x1000, 0)), EVENT_TIME, STORE, RESET_NODE, START),
}
"""Sequences that end with what the lapse does wrong."""


def laboratory(*faults: str) -> Laboratory:
    return Laboratory(RunOptions(device=DEVICE, faults=faults))


@pytest.mark.parametrize("lapse", LAPSES)
def test_a_lapse_shows_after_its_steps_and_not_without_one_of_them(lapse: str) -> None:
    steps = LAPSES[lapse]
    assert laboratory().replay(steps, {}) is None
    defective = laboratory(lapse)
    assert defective.replay(steps, {}) is not None
    without = [steps[:place] + steps[place + 1 :] for place in range(1, len(steps) - 1)]
    assert sum(defective.replay(it, {}) is None for it in without) >= 3


def test_a_difference_names_what_was_expected_and_what_came() -> None:
    found = laboratory("lapse-heartbeat-after-stop").replay(
        LAPSES["lapse-heartbeat-after-stop"], {}
    )
    assert found is not None
    assert found.quantity == "heartbeat"
    assert found.expected.startswith("77Fh 05 (operational)")
    assert found.actual == "none"


def test_a_long_sequence_becomes_the_shortest_that_shows_the_difference() -> None:
    lab = laboratory("lapse-tpdo-after-stop")
    steps = (Upload((0x1000, 0)), Wait(100), *LAPSES["lapse-tpdo-after-stop"], Wait(300), Sync())
    before = lab.replay(steps, {})
    assert before is not None
    short = shortest(Finding(steps, before), lambda it: lab.replay(it, {}))
    assert short is not None
    assert [type(step) for step in short.steps][-4:] == [Nmt, Sync, Nmt, Nmt]
    assert len(short.steps) <= 5


def test_a_missing_boot_up_message_is_a_difference() -> None:
    found = laboratory("no-boot-up").replay((Nmt(129),), {})
    assert found is not None
    assert (found.expected, found.actual) == ("a boot-up message", "none")


def test_what_does_not_show_again_is_not_made_short() -> None:
    steps: Steps = (Nmt(129),)
    found = laboratory("no-boot-up").replay(steps, {})
    assert found is not None
    lab = laboratory()
    assert shortest(Finding(steps, found), lambda it: lab.replay(it, {})) is None
