"""A fixed share of a device's defects: each is seen; `make mutants` has all, and those of the other devices."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

SHARE = 60
SEED = 20


def test_no_defect_of_the_share_goes_unseen(command: Callable[..., Any], tmp_path: Path) -> None:
    finished = command(
        *(
            "mutants",
            "danfoss_dst_x730",
            "--variant",
            "xy-10",
            "--sample",
            str(SHARE),
            "--seed",
            str(SEED),
        ),
        *("--processes", "1", "--report-dir", tmp_path / "m"),
    )
    matrix = json.loads((tmp_path / "m" / "mutants.json").read_text("utf-8"))
    unseen = [it["id"] for it in matrix["defects"] if it["fate"] in ("survived", "open")]

    assert unseen == []
    assert finished.code == 0, finished.out + finished.err
    assert matrix["summary"]["killed"] > SHARE / 2
