"""What TPDOs carry and in which states they come, in recordings written by hand."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from recorded_by_hand import verdict_of

COB_ID = ("632#4000180100000000", "5B2#43001801B2010000")
ONE_OBJECT = ("632#2F001A0001000000", "5B2#60001A0000000000")
SOURCE_OF_ANGLE = ("632#23001A0108021031", "5B2#60001A0100000000")
SETUP = (COB_ID, SOURCE_OF_ANGLE, ONE_OBJECT)


def _frames(value: int, setup: Sequence[tuple[str, str]]) -> list[tuple[float, str]]:
    """Return two times a setup, and TPDOs that carry one octet."""
    frames: list[tuple[float, str]] = []
    for begins_s in (0.0, 10.0):
        for place, (request, response) in enumerate(setup):
            frames += [(begins_s + place, request), (begins_s + place + 0.002, response)]
        frames += [(begins_s + 5 + n / 10, f"1B2#{value:02X}") for n in range(5)]
        frames.append((begins_s + 9, "000#8132"))
        frames.append((begins_s + 9.5, "732#00"))
    return frames


@pytest.mark.parametrize(
    ("value", "setup", "verdict"),
    [
        (1, SETUP, "pass"),
        (9, SETUP, "fail"),
        (9, SETUP[1:], "inconclusive"),
        (9, SETUP[:1], "not_applicable"),
        (9, SETUP[:2], "not_applicable"),
    ],
)
def test_a_value_is_held_against_its_range_where_the_mapping_is_told(
    value: int, setup: Sequence[tuple[str, str]], verdict: str, tmp_path: Path
) -> None:
    assert verdict_of(_frames(value, setup), "TPDO-05/1800h", tmp_path) == verdict


def _states(*parts: tuple[str, int]) -> list[tuple[float, str]]:
    """Return what identifies a TPDO, then for each state told how many of it come between heartbeats."""
    frames = [(0.0, COB_ID[0]), (0.002, COB_ID[1])]
    for place, (state, count) in enumerate(parts):
        begins_s = 1 + 2 * place
        for n in range(4):
            frames.append((begins_s + n / 4, f"732#{state}"))
            frames += [(begins_s + n / 4 + k / 100, "1B2#00") for k in range(1, count + 1)]
    return frames


OPERATIONAL, PRE_OPERATIONAL = "05", "7F"


@pytest.mark.parametrize(
    ("parts", "verdict"),
    [
        ([(OPERATIONAL, 2)], "not_applicable"),
        ([(PRE_OPERATIONAL, 0)], "not_applicable"),
        ([(PRE_OPERATIONAL, 0), (OPERATIONAL, 0)], "not_applicable"),
        ([(PRE_OPERATIONAL, 0), (OPERATIONAL, 2)], "pass"),
        ([(PRE_OPERATIONAL, 1)], "fail"),
        ([(PRE_OPERATIONAL, 1), (OPERATIONAL, 2)], "fail"),
    ],
)
def test_a_tpdo_is_shown_in_operational_alone_by_what_shows_another_state_too(
    parts: Sequence[tuple[str, int]], verdict: str, tmp_path: Path
) -> None:
    assert verdict_of(_states(*parts), "TPDO-01/1800h", tmp_path) == verdict
