"""The command `explore`: what it finds, says and keeps."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from conformance.cli import app
from conformance.explore.explanation import explained
from conformance.explore.exploration import explore
from conformance.explore.laboratory import Laboratory
from conformance.explore.shortest import Finding, Steps
from conformance.explore.steps import Download, Nmt, Upload
from conformance.options import RunOptions

STEPS = 80


@pytest.mark.parametrize("device", ["siko_ims360", "baumer_gim140r", "danfoss_dst_x730"])
def test_a_device_as_documented_does_nothing_else_than_the_model(
    tmp_path: Path, device: str
) -> None:
    explored = explore(RunOptions(device=device, seed=1), STEPS, tmp_path / "trace.log")
    assert explored.finding is None
    assert explored.steps >= STEPS / 2
    assert not explored.readings


def test_a_reading_that_the_manual_leaves_open_is_found_out() -> None:
    options = RunOptions(device="danfoss_dst_x730", readings=("DST-24=2",))
    steps: Steps = (Download((0x4000, 0), b"\x07"),)
    laboratory = Laboratory(options)
    difference = laboratory.replay(steps, {})
    assert difference is not None
    finding = Finding(steps, difference)
    assert explained(laboratory, {}, [], finding) == {"DST-24": 2}
    assert laboratory.replay(steps, {"DST-24": 2}) is None


def test_no_reading_explains_a_defect() -> None:
    laboratory = Laboratory(RunOptions(device="danfoss_dst_x730", faults=("nmt-stop-ignored",)))
    steps: Steps = (Nmt(2), Upload((0x1000, 0)))
    difference = laboratory.replay(steps, {})
    assert difference is not None
    assert explained(laboratory, {}, [], Finding(steps, difference)) is None


def test_a_defect_is_told_as_the_shortest_steps_with_frames_and_trace(tmp_path: Path) -> None:
    result = CliRunner().invoke(
        app,
        [
            *("explore", "baumer_gim140r", "--steps", "400", "--seed", "3"),
            *("--fault", "nmt-stop-ignored", "--report-dir", str(tmp_path)),
        ],
    )
    text = (tmp_path / "explore.txt").read_text(encoding="utf-8")
    assert result.exit_code == 1, text
    assert "  expected  " in text
    assert "cansend can0 000#0201" in text
    assert "000#0201" in (tmp_path / "trace.log").read_text(encoding="ascii")
    assert text in result.output


def test_the_same_seed_takes_the_same_steps(tmp_path: Path) -> None:
    options = RunOptions(device="baumer_gim140r", seed=5)
    told = [explore(options, STEPS, tmp_path / "trace.log") for _ in range(2)]
    assert (told[0].steps, told[0].sequences) == (told[1].steps, told[1].sequences)
