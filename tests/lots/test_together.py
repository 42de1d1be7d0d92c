"""Units of a lot that are judged at once on one simulated bus."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from simulated_process import COMMAND

LOT = """format: 1
part: Inclinometer
order: order 17
device: siko_ims360
level: all
size: {size}
node_ids: 11-13
"""
SELECT = "select: OD-09 or HB-01 or SYNC-01 or LSS-06 or NMT-01 or DEV-01\n"


def inspected(command: Callable[..., Any], folder: Path, size: int, more: str = "") -> Any:
    path = folder / "lot.yaml"
    path.write_text(LOT.format(size=size) + SELECT + more, encoding="utf-8")
    return command("inspect", path, "--report-dir", folder / "record")


def record(folder: Path, unit: int) -> dict[str, Any]:
    text = (folder / f"record/units/{unit}-1/results.json").read_text("utf-8")
    content: dict[str, Any] = json.loads(text)
    return content


def test_each_unit_is_judged_by_itself(command: Callable[..., Any], tmp_path: Path) -> None:
    faults = "simulation: {faults: {2: [heartbeat-slow-10-percent], 5: [wrong-identity]}}\n"
    done = inspected(command, tmp_path, 5, faults)
    assert done.code == 1, done.out + done.err
    state = json.loads((tmp_path / "record/lot.json").read_text("ascii"))
    assert {it["unit"]: it["verdict"] for it in state["units"]} == {
        1: "conforming",
        2: "nonconforming",
        3: "conforming",
        4: "conforming",
        5: "nonconforming",
    }
    deviations = {it["unit"]: it["tries"][0]["deviations"] for it in state["units"]}
    assert {it.split("/")[0] for it in deviations[2]} == {"HB-01"}
    assert {it.split("/")[0] for it in deviations[5]} == {"OD-09"}
    assert state["running"] == []
    assert [it["tries"][0]["node_id"] for it in state["units"]] == [11, 12, 13, 11, 12]
    for failed in (it for it in record(tmp_path, 2)["items"] if it["verdict"] == "fail"):
        assert failed["tried"].startswith("beside other units it failed: ")


def test_what_concerns_others_is_judged_alone_or_not_at_all(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    done = inspected(command, tmp_path, 3)
    assert done.code == 0, done.out + done.err
    kept = record(tmp_path, 2)
    assert kept["run"]["other_units"] == [11, 13]
    verdicts = {(it["requirement"], it["verdict"]): it for it in kept["items"]}
    assert verdicts["SYNC-01", "pass"]["tried"] == ""
    assert verdicts["DEV-01", "pass"]
    assert "other units" in verdicts["LSS-06", "skipped"]["reason"]
    assert kept["summary"]["complete"]
    order = [it["id"] for it in kept["items"]]
    assert order == [it["id"] for it in record(tmp_path, 1)["items"]]


def test_a_process_that_ends_by_itself_is_the_benchs_fault(tmp_path: Path) -> None:
    path = tmp_path / "lot.yaml"
    path.write_text(LOT.format(size=3), encoding="utf-8")
    command: list[str | Path] = [*COMMAND, "inspect", path, "--report-dir", tmp_path / "record"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as done:
        while not list(tmp_path.glob("record/units/*/results.json")):
            time.sleep(0.01)
        children = Path(f"/proc/{done.pid}/task/{done.pid}/children").read_text("ascii").split()
        os.kill(max(map(int, children)), signal.SIGKILL)
        _, errors = done.communicate(timeout=120)
    assert done.returncode == 2
    assert b"that judged unit" in errors
    assert b"Traceback" not in errors
    state = json.loads((tmp_path / "record/lot.json").read_text("ascii"))
    assert [it["unit"] for it in state["running"]] == [1, 2, 3]
