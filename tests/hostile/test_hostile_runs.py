"""A device that does anything at all is never said to conform, and breaks no run; `make hostile` tries 1,500."""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Iterator
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import can
import pytest
from hostile_runs import MOST_MEMORY_MB, Ended, Hostile, catalogue_of, choose, from_json
from mischiefs import MISCHIEFS

from conformance import resources

RUNS = int(os.environ.get("HOSTILE_RUNS", "2"))
"""Of each kind of mischief."""

FOURTH = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"
DEVICES = [str(FOURTH), *resources.names("device_specs")]
MOST_CPU_S = 60
MOST_BUS_S = 3600
JUDGED_BY_SDO = ("SDO-", "OD-")


@pytest.fixture
def carry_out(processes: BaseContext, tmp_path: Path) -> Iterator[Any]:
    """Carry out runs in a process of their own, each in a fork of it."""

    def run(runs: list[Hostile]) -> list[Ended]:
        from hostile_runs import carry_out  # noqa: PLC0415 - what the process is to find by its name

        process = processes.Process(target=carry_out, args=(runs, tmp_path))  # type: ignore[attr-defined]  # typeshed has it on the subclasses only
        process.start()
        process.join()
        assert process.exitcode == 0
        return from_json(tmp_path)

    yield run
    shutil.rmtree(tmp_path)


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


@pytest.mark.timeout(7200)
@pytest.mark.parametrize(
    "kinds", [list(MISCHIEFS)[0::2], list(MISCHIEFS)[1::2]], ids=["one", "two"]
)
def test_a_device_that_is_meddled_with_ends_every_run(kinds: list[str], carry_out: Any) -> None:
    devices = [DEVICES[seed % len(DEVICES)] for seed in range(RUNS)]
    catalogues = {device: catalogue_of(device) for device in devices}
    runs = [
        choose(kind, seed, device, catalogues[device])
        for kind in kinds
        for seed, device in enumerate(devices)
    ]

    ends = carry_out(runs)

    for run, ended in zip(runs, ends, strict=True):
        assert_ended_well(run, ended)
    assert sum(ended.meddled > 0 for ended in ends) > len(runs) / 2
