"""What holds for every hostile run, whatever the device does."""

from __future__ import annotations

import io
import json
from pathlib import Path
from xml.etree import ElementTree as ET

import can
from hostile_runs import MOST_MEMORY_MB, Ended, Hostile

MOST_CPU_S = 60
MOST_BUS_S = 3600
JUDGED_BY_SDO = ("SDO-", "OD-")


def assert_ended_well(run: Hostile, ended: Ended) -> None:
    """Assert what holds for every run, whatever the device does."""
    folder = Path(ended.folder)
    printed = "".join((folder / name).read_text("utf-8") for name in ("out.txt", "err.txt"))
    what = f"{run}:\n{printed}"
    record = json.loads((folder / "results.json").read_text("utf-8"))
    summary = record["summary"]
    bus_s = record["run"].get("simulated_s", 0.0)

    assert ended.code in (0, 1, 2), what
    assert ended.code == summary["exit_code"], what
    assert ended.code or not ended.illegal, what
    assert "Traceback" not in printed, what
    assert "defect of the suite" not in printed, what
    assert all(it.isprintable() or it == "\n" for it in printed), what
    assert ended.cpu_s < MOST_CPU_S, what
    assert ended.peak_mb < MOST_MEMORY_MB / 2, what
    assert bus_s < MOST_BUS_S, what
    assert summary["complete"] or summary["aborted"], what
    assert summary["items"] == len(record["items"]), what
    suites = ET.fromstring((folder / "junit.xml").read_text("utf-8"))  # noqa: S314 - our own
    assert len(list(suites.iter("testcase"))) >= summary["items"], what
    lines = (folder / "trace.log").read_text("ascii")
    assert sum(1 for _ in can.CanutilsLogReader(io.StringIO(lines))) == lines.count("\n"), what
    if ended.everything:
        passed = [it["requirement"] for it in record["items"] if it["verdict"] == "pass"]
        assert not [it for it in passed if it.startswith(JUDGED_BY_SDO)], what
