"""The command as a user runs it, and what its record says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import pytest

COMMAND = Path(sys.executable).parent / "canopen-conformance"
SPECS = Path(__file__).parents[1] / "device_specs"


@dataclass(frozen=True)
class Finished:
    """A finished command.

    Args:
        code: Its exit code.
        out: What it printed.
        err: What it printed as errors.
        folder: Where its record is.
    """

    code: int
    out: str
    err: str
    folder: Path

    @property
    def record(self) -> dict[str, Any]:
        content: dict[str, Any] = json.loads((self.folder / "results.json").read_text("utf-8"))
        return content

    def items(self, verdict: str) -> list[str]:
        """Return the ids with a verdict, without the device's name."""
        found = (item for item in self.record["items"] if item["verdict"] == verdict)
        return [item["id"].partition("/")[2] for item in found]

    def requirements(self, verdict: str) -> set[str]:
        return {item.partition("/")[0] for item in self.items(verdict)}


Command: TypeAlias = Callable[..., Finished]


@pytest.fixture
def command(tmp_path: Path) -> Command:
    """Run `canopen-conformance` with some arguments, in a folder of its own."""

    def run(*arguments: str | Path, expect_traceback: bool = False) -> Finished:
        environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200"}
        done = subprocess.run(
            [COMMAND, *map(str, arguments)],
            capture_output=True,
            encoding="utf-8",
            cwd=tmp_path,
            env=environment,
            timeout=240,
            check=False,
        )
        assert expect_traceback or "Traceback" not in done.stdout + done.stderr
        return Finished(done.returncode, done.stdout, done.stderr, tmp_path / "record")

    return run


@pytest.fixture
def judge(command: Command, tmp_path: Path) -> Command:
    """Run the suite on the simulated IMS360 with some arguments."""

    def run(*arguments: str | Path, device: str | Path = "siko_ims360") -> Finished:
        return command("run", device, "--report-dir", tmp_path / "record", *arguments)

    return run
