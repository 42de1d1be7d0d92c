"""A run says how to see each deviation again; the same seed makes the same run."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from junitparser import JUnitXml

FAULT = "objects/0x1017/default=50"
ITEM = "OD-10/1017h"
WALL = {"started", "finished", "wall_s"}


def test_a_deviation_says_how_to_see_it_again(judge: Callable[..., Any]) -> None:
    first = judge(
        *("--select", "HB-01/1017h/100ms", "--fault", "heartbeat-slow-10-percent"),
        *("--variant", "one-axis", "--node-id", "5", "--seed", "3"),
    )

    (item,) = (it for it in first.record["items"] if it["verdict"] == "fail")
    again = item["repro"]
    assert again in first.out
    (suite,) = JUnitXml.fromfile(str(first.folder / "junit.xml"))
    assert again in "".join(it.text for case in suite for it in case.result if it.text)

    program, run, device, *arguments = shlex.split(again)
    assert (program, run, device) == ("canopen-conformance", "run", "siko_ims360")
    second = judge(*arguments)

    assert second.code == first.code == 1
    (same,) = (it for it in second.record["items"] if it["id"] == item["id"])
    assert (same["expected"], same["actual"]) == (item["expected"], item["actual"])


@pytest.mark.parametrize(("faults", "code"), [((), 0), (("--fault", FAULT), 1)])
def test_one_item_alone_is_shown_as_frames(
    faults: tuple[str, ...], code: int, judge: Callable[..., Any]
) -> None:
    finished = judge("--repro", ITEM, *faults)

    assert finished.code == code
    assert len(finished.record["items"]) == 1
    shown = finished.out[finished.out.index("# siko_ims360/OD-10/1017h") :].splitlines()
    assert any(line.startswith("cansend can0 632#4017") for line in shown)
    assert shown[-1] == ("# fail" if code else "# pass")


def test_an_item_that_there_is_not_is_a_mistake(judge: Callable[..., Any]) -> None:
    finished = judge("--repro", "OD-10")

    assert finished.code == 3
    assert "--repro: expected the id of an item, got 'OD-10'" in finished.err


def test_the_id_of_any_item_can_be_selected(judge: Callable[..., Any]) -> None:
    item = "danfoss_dst_x730/EMCY-24/1000h/tilt-x/4000h=1/operational"

    finished = judge("--select", item, "--variant", "xy-10", device="danfoss_dst_x730")

    assert [it["id"] for it in finished.record["items"]] == [item]


@pytest.mark.parametrize(
    ("device", "select", "more"),
    [
        ("siko_ims360", "HB-0 or EMCY-0", ("--fault", "heartbeat-jitter-20-ms", "--seed", "5")),
        ("small", "", ()),
    ],
)
def test_the_same_seed_makes_the_same_run(
    device: str, select: str, more: tuple[str, ...], command: Callable[..., Any], tmp_path: Path
) -> None:
    if device == "small":
        device = str(Path(__file__).parents[1] / "simulator" / "invented.yaml")
    seen = []
    for name in ("one", "two"):
        folder = tmp_path / name
        command("run", device, "--report-dir", folder, "--select", select, *more)
        record = json.loads((folder / "results.json").read_text("utf-8"))
        record["run"] = {key: it for key, it in record["run"].items() if key not in WALL}
        seen.append(((folder / "trace.log").read_bytes(), record))

    assert seen[0][0] == seen[1][0]
    assert seen[0][1] == seen[1][1]
