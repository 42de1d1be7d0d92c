"""The steps by which README.md in device_specs adds a device: each command does what the step says."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conformance.resources import data
from conformance.spec.schema import json_schema

README = (data("device_specs") / "README.md").read_text(encoding="utf-8")
RANGES = "ranges: [[0, 0], [10, 65535]]"


def blocks(kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)```", README, re.DOTALL | re.MULTILINE)


def run(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    program, *arguments = command.split()
    assert program == "canopen-conformance"
    return subprocess.run(
        [sys.executable, "-c", "from conformance.cli import main; main()", *arguments],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=100,
    )


def succeed(block: str, folder: Path) -> str:
    out = ""
    for command in block.splitlines():
        done = run(command, folder)
        assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
        out += done.stdout
    return out


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the example, a wrong copy of it, its EDS and its statements."""
    (example,) = blocks("yaml")
    (statements,) = (text for text in blocks("text") if "\nstatements:\n" in text)
    assert example.count(RANGES) == 1
    assert "`[20, 65535]`" in README
    (tmp_path / "my_sensor.yaml").write_text(example, encoding="utf-8")
    (tmp_path / "my_sensor.statements.yaml").write_text(statements, encoding="utf-8")
    wrong = example.replace(RANGES, RANGES.replace("10", "20"))
    (tmp_path / "wrong.yaml").write_text(wrong, encoding="utf-8")
    succeed("canopen-conformance spec to-eds my_sensor.yaml --output my_sensor.eds", tmp_path)
    return tmp_path


def test_the_steps_lead_to_a_device(folder: Path) -> None:
    begin, look, judge, wrong, catalogue, bench = blocks("console")
    spec = folder / "my_sensor.yaml"
    example = spec.read_text(encoding="utf-8")

    spec.unlink()
    succeed(begin, folder)
    assert "# my_sensor.eds, imported." in spec.read_text(encoding="utf-8")
    spec.write_text(example, encoding="utf-8")

    assert "good (2 statements)" in succeed(look, folder)
    assert succeed(judge, folder).count("CONFORMS") == 2
    assert "| S-001 |" in succeed(catalogue, folder)
    shutil.copy(data("fixtures/benches") / "simulator.yaml", folder / "my_bench.yaml")
    assert "CONFORMS" in succeed(bench, folder)

    done = run(wrong.strip(), folder)
    (shown,) = (text for text in blocks("text") if text.startswith("my_sensor/OD-11"))
    assert done.returncode == 1
    assert shown in done.stdout


def test_the_readme_names_every_rule_between_objects() -> None:
    definitions = json_schema()["$defs"]
    rules = {
        properties["rule"]["const"]
        for definition in definitions.values()
        if "rule" in (properties := definition.get("properties", {}))
    }
    assert len(rules) >= 6
    assert [rule for rule in rules if f"`{rule}`" not in README] == []
