"""LSS in recordings written by hand: a wrong answer of the selected node, and of nobody in particular."""

from __future__ import annotations

from pathlib import Path

import pytest
from recorded_by_hand import verdict_of

NUMBERS = (7, 2, 3, 4)
GLOBAL = "7E5#0401000000000000"
WRONG = ("7E5#5E00000000000000", "7E4#5E33000000000000")


def _frames(*, own: bool, selected: bool) -> list[tuple[float, str]]:
    frames = []
    for sub, number in enumerate(NUMBERS, start=1):
        frames += [f"632#401810{sub:02X}00000000", f"5B2#431810{sub:02X}{number:02X}000000"]
    selection = [
        f"7E5#{0x3F + sub:02X}{number if own else number + 1:02X}000000000000"
        for sub, number in enumerate(NUMBERS, start=1)
    ]
    chosen = [*selection, "7E4#4400000000000000"] if selected else [GLOBAL]
    return [(n / 100, it) for n, it in enumerate([*frames, *chosen, *WRONG, *WRONG])]


@pytest.mark.parametrize(
    ("own", "selected", "verdict"),
    [(True, True, "fail"), (False, True, "inconclusive"), (True, False, "inconclusive")],
)
def test_an_answer_counts_of_the_node_that_was_selected(
    verdict: str, tmp_path: Path, *, own: bool, selected: bool
) -> None:
    frames = _frames(own=own, selected=selected)

    assert verdict_of(frames, "LSS-07/5Eh", tmp_path) == verdict
