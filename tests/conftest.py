"""The command as a user runs it, and what its record says."""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any, TypeAlias

import forked_command
import pytest

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


@pytest.fixture(scope="session")
def processes() -> Iterator[BaseContext]:
    """Return what starts commands: forked, where that can be, from a process that did their start-up."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("NO_COLOR", "1")
        environment.setenv("COLUMNS", "200")
        folder = str(Path(forked_command.__file__).parent)
        environment.setenv("PYTHONPATH", folder, prepend=os.pathsep)
        forks = "forkserver" in multiprocessing.get_all_start_methods()
        context = multiprocessing.get_context("forkserver" if forks else "spawn")
        context.set_forkserver_preload(["conformance.cli", "command_start_up"])
        yield context


@pytest.fixture
def command(tmp_path: Path, processes: BaseContext) -> Command:
    """Run `canopen-conformance` with some arguments, in a folder of its own."""

    def run(*arguments: str | Path, expect_traceback: bool = False) -> Finished:
        out, err = tmp_path / "out.txt", tmp_path / "err.txt"
        texts = [str(argument) for argument in arguments]
        process = processes.Process(  # type: ignore[attr-defined]  # typeshed has it on the subclasses only
            target=forked_command.run, args=(texts, tmp_path, out, err)
        )
        process.start()
        process.join(240)
        if process.exitcode is None:
            process.kill()
            process.join()
        printed, errors = out.read_text("utf-8"), err.read_text("utf-8")
        assert expect_traceback or "Traceback" not in printed + errors
        return Finished(process.exitcode or 0, printed, errors, tmp_path / "record")

    return run


@pytest.fixture
def judge(command: Command, tmp_path: Path) -> Command:
    """Run the suite on the simulated IMS360 with some arguments."""

    def run(*arguments: str | Path, device: str | Path = "siko_ims360") -> Finished:
        return command("run", device, "--report-dir", tmp_path / "record", *arguments)

    return run


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what waits most of its time, so that the rest is done meanwhile."""
    items.sort(key=lambda item: "tests/socketcan/" not in item.nodeid)
