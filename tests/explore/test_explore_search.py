"""The search: each defect that needs its steps in one order is found, and told by the fewest steps."""

from __future__ import annotations

import random
from itertools import islice

import pytest

from conformance.explore.choices import Choices, choices
from conformance.explore.laboratory import Laboratory
from conformance.explore.search import LONGEST, search
from conformance.explore.shortest import shortest
from conformance.explore.steps import Download, Nmt, Step, Upload, words
from conformance.explore.themes import course
from conformance.options import RunOptions
from conformance.spec.model import Key

DEVICE = "danfoss_dst_x730"

FOUND = {
    "lapse-heartbeat-after-stop": (
        3,
        1_000,
        [
            "NMT command 2, stop",
            "upload 1017h, Producer heartbeat time",
            "NMT command 1, start",
            "download FA 00 to 1017h, Producer heartbeat time",
        ],
    ),
    "lapse-tpdo-after-stop": (
        1,
        1_000,
        ["NMT command 1, start", "SYNC", "NMT command 2, stop", "NMT command 1, start"],
    ),
    "lapse-event-time-after-sync": (
        1,
        1_000,
        [
            "download 14 00 to 1800h:05, Event timer",
            "download 1E 00 to 1800h:03, Inhibit time",
            "SYNC",
            "upload 1800h:05, Event timer",
        ],
    ),
    "lapse-mapping-after-reset": (
        3,
        4_000,
        [
            "download 00 to 1A00h:00, Number of entries",
            "download 00 to 1A00h:00, Number of entries",
            "NMT command 130, reset communication",
            "NMT command 1, start",
        ],
    ),
    "lapse-sdo-after-sync": (
        2,
        1_000,
        ["SYNC", "NMT command 2, stop", "NMT command 1, start", "upload 1800h:01, COB-ID"],
    ),
}
"""Lapse: seed, most steps, the shortest sequence that shows it."""


def of(laboratory: Laboratory) -> Choices:
    return choices(laboratory.spec, laboratory.definition, as_made=laboratory.as_made)


@pytest.mark.parametrize("lapse", FOUND)
def test_a_lapse_is_found_and_told_by_the_fewest_steps(lapse: str) -> None:
    seed, most, steps = FOUND[lapse]
    laboratory = Laboratory(RunOptions(device=DEVICE, seed=seed, faults=(lapse,)))

    searched = search(laboratory, of(laboratory), {}, most, seed)

    assert searched.finding is not None, f"none in {searched.steps} steps"
    short = shortest(searched.finding, lambda it: laboratory.replay(it, {}))
    assert short is not None
    assert [words(step, laboratory.spec) for step in short.steps] == steps
    laboratory.close()


def taken(sequences: int) -> list[list[Step]]:
    allowed, chance = of(Laboratory(RunOptions(device=DEVICE))), random.Random(1)  # noqa: S311 - repeatable
    return [list(islice(course(allowed, chance), LONGEST)) for _ in range(sequences)]


def test_a_sequence_comes_back_to_what_it_has_written() -> None:
    again = total = 0
    for steps in taken(50):
        written: list[Key] = []
        for step in steps:
            if isinstance(step, Upload):
                total += 1
                again += step.key in written[-3:]
            elif isinstance(step, Download):
                written.append(step.key)
    assert again > total / 2


def test_a_sequence_has_few_kinds_of_steps_and_all_have_many() -> None:
    sequences = taken(60)
    commands = [{it.command for it in steps if isinstance(it, Nmt)} for steps in sequences]
    assert set().union(*commands) == {1, 2, 3, 128, 129, 130, 255}
    assert sum(len(some) <= 4 for some in commands) > len(sequences) / 2
    written = [{it.key for it in steps if isinstance(it, Download)} for steps in sequences]
    assert len(set().union(*written)) > 4 * sum(map(len, written)) / len(sequences)
