"""A fixed share of each device's defects: each is seen, by an item that names it; `make mutants` has all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SHARE = 40
SEED = 20


@pytest.mark.parametrize(
    ("device", "variant"),
    [
        ("siko_ims360", "two-axis"),
        ("baumer_gim140r", "two-dimensional"),
        ("danfoss_dst_x730", "xy-10"),
    ],
)
def test_no_defect_of_the_share_goes_unseen(
    device: str, variant: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    finished = command(
        *("mutants", device, "--variant", variant, "--sample", str(SHARE), "--seed", str(SEED)),
        *("--processes", "1", "--report-dir", tmp_path / "m"),
    )
    matrix = json.loads((tmp_path / "m" / "mutants.json").read_text("utf-8"))
    unseen = [it["id"] for it in matrix["defects"] if it["fate"] in ("survived", "open")]

    assert unseen == []
    assert finished.code == 0, finished.out + finished.err
    assert matrix["summary"]["killed"] > SHARE / 2
