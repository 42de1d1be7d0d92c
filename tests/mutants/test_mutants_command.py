"""`mutants` as a user runs it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

FOURTH = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    """A spec of a user, in a folder of its own."""
    return Path(shutil.copy(FOURTH, tmp_path / "fourth.yaml"))


def test_defects_are_killed_and_told(
    command: Callable[..., Any], spec: Path, tmp_path: Path
) -> None:
    finished = command(
        *("mutants", spec, "--only", "1018h", "--processes", "1"),
        *("--report-dir", tmp_path / "m"),
    )
    matrix = json.loads((tmp_path / "m" / "mutants.json").read_text("utf-8"))
    page = (tmp_path / "m" / "mutants.html").read_text("utf-8")

    assert finished.code == 0, finished.out + finished.err
    assert matrix["summary"]["killed"] == matrix["summary"]["defects"] > 3
    assert matrix["summary"]["first_right"] == matrix["summary"]["killed"]
    assert "1018h:01/missing" in page
    assert f"{matrix['summary']['defects']} defects" in finished.out


def test_the_number_of_processes_changes_nothing(
    command: Callable[..., Any], spec: Path, tmp_path: Path
) -> None:
    found = []
    for processes in ("1", "2"):
        folder = tmp_path / processes
        command(
            *("mutants", spec, "--only", "1018h", "--processes", processes),
            *("--report-dir", folder),
        )
        matrix = json.loads((folder / "mutants.json").read_text("utf-8"))
        del matrix["wall_s"]
        for defect in matrix["defects"]:
            del defect["seconds"]
        found.append(matrix)

    assert found[0]["summary"]["killed"] > 3
    assert found[0] == found[1]


def test_a_defect_that_survives_is_told(
    command: Callable[..., Any], spec: Path, tmp_path: Path
) -> None:
    listed = spec.with_name("fourth.equivalents.yaml")
    listed.write_text(
        "format: 1\nequivalents: [{defects: ['1017h/missing', '9999h/*'], why: Told}]\n", "utf-8"
    )

    finished = command(
        *("mutants", spec, "--only", "1017h/missing", "--processes", "1"),
        *("--report-dir", tmp_path / "m"),
    )

    assert finished.code == 1
    assert "not equivalent" in finished.out
    assert "useless: 9999h/*" in finished.out


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("format: 2\nequivalents: []\n", "fourth.equivalents.yaml:1: format: expected 1"),
        ("format: 1\nequivalents: [{why: x}]\n", "defects: expected this key"),
        ("", "expected"),
    ],
)
def test_a_wrong_list_gets_a_sentence(
    command: Callable[..., Any], spec: Path, text: str, sentence: str
) -> None:
    spec.with_name("fourth.equivalents.yaml").write_text(text, "utf-8")

    finished = command("mutants", spec)

    assert finished.code == 3
    assert sentence in finished.err


def test_an_unknown_defect_gets_a_sentence(command: Callable[..., Any], spec: Path) -> None:
    finished = command("mutants", spec, "--only", "no such defect")

    assert finished.code == 3
    assert "--only" in finished.err
