"""Emergency messages in recordings written by hand: one that is documented, and ones that are not."""

from __future__ import annotations

from pathlib import Path

import pytest
from recorded_by_hand import verdict_of

COB_ID = ((0.0, "632#4014100000000000"), (0.002, "5B2#43141000B2000000"))
OUT_OF_RANGE = "0B2#1050010000000000"
NO_MORE = "0B2#0000000000000000"

WRONG = [
    ("0B2#0042010000000000", "EMCY-03/4200h"),
    ("0B2#10500100000000", "EMCY-04/1014h"),
    ("0B2#1050030000000000", "EMCY-06/1014h"),
]


def _frames(emcy: str, *, told: bool) -> list[tuple[float, str]]:
    return [*(COB_ID if told else ()), (0.5, emcy), (0.7, emcy)]


@pytest.mark.parametrize("item", ["EMCY-03/5010h", "EMCY-04/1014h", "EMCY-06/1014h"])
def test_a_documented_emcy_passes(item: str, tmp_path: Path) -> None:
    frames = [*_frames(OUT_OF_RANGE, told=True), (1.0, NO_MORE)]

    assert verdict_of(frames, item, tmp_path) == "pass"


@pytest.mark.parametrize(("emcy", "item"), WRONG)
def test_an_undocumented_one_fails(emcy: str, item: str, tmp_path: Path) -> None:
    assert verdict_of(_frames(emcy, told=True), item, tmp_path) == "fail"


@pytest.mark.parametrize(("emcy", "item"), WRONG)
def test_nothing_fails_on_an_identifier_that_may_be_another_ones(
    emcy: str, item: str, tmp_path: Path
) -> None:
    assert verdict_of(_frames(emcy, told=False), item, tmp_path) == "inconclusive"


def test_another_nodes_emcy_is_not_looked_at(tmp_path: Path) -> None:
    frames = _frames("0B3#0042030000000000", told=True)

    assert verdict_of(frames, "EMCY-03/4200h", tmp_path) == "none"
