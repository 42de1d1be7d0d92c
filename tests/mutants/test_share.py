"""A fixed share of each device's defects: each is seen; `make mutants` has all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SEED = 20


@pytest.mark.parametrize(
    ("device", "variant", "share"),
    [
        ("siko_ims360", "two-axis", 40),
        ("baumer_gim140r", "two-dimensional", 40),
        ("danfoss_dst_x730", "xy-10", 60),
    ],
)
def test_no_defect_of_the_share_goes_unseen(
    command: Callable[..., Any], tmp_path: Path, device: str, variant: str, share: int
) -> None:
    arguments = {
        "--variant": variant,
        "--sample": str(share),
        "--seed": str(SEED),
        "--processes": "1",
        "--report-dir": tmp_path / "m",
    }
    finished = command("mutants", device, *(it for pair in arguments.items() for it in pair))
    matrix = json.loads((tmp_path / "m" / "mutants.json").read_text("utf-8"))
    unseen = [it["id"] for it in matrix["defects"] if it["fate"] in ("survived", "open")]

    assert unseen == []
    assert finished.code == 0, finished.out + finished.err
    assert matrix["summary"]["killed"] > share / 2
