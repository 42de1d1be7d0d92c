"""Runs the checks in this process for the command line, and tells the user how it goes."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from types import FrameType

import pytest

from conformance.errors import SpecError
from conformance.plugin import RUN
from conformance.report.console import console
from conformance.report.summary import Progress, print_summary
from conformance.run import Run

CHECKS = Path(__file__).parent / "checks"


class _Attach:
    """Hands the run to the plug-in before it would make its own."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self.collected = 0
        self.errors: list[str] = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_configure(self, config: pytest.Config) -> None:
        config.stash[RUN] = self._run

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.errors.append(report.longreprtext)

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.collected = len(session.items)


def run(run: Run, select: str) -> int:
    """Run the checks that match, print the summary and return the exit code.

    Args:
        run: What is judged.
        select: pytest's `-k` expression over item ids; empty for all.

    Raises:
        SpecError: The expression is wrong or matches nothing.
    """
    attach = _Attach(run)
    progress = Progress(run)
    run.progress = progress.item
    # Only what a run needs is loaded: the user's other plug-ins and settings change no verdict.
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    os.environ.pop("PYTEST_ADDOPTS", None)
    plugins = ["conformance.plugin", "pytest_timeout", "no:terminal", "no:cacheprovider"]
    arguments = [
        *(f"-p{name}" for name in plugins),
        "-c",
        str(CHECKS / "pytest.ini"),
        "--device",
        run.options.device,
        *(["-k", select] if select else []),
        str(CHECKS),
    ]
    previous = signal.signal(signal.SIGTERM, _interrupt)
    try:
        with progress:
            pytest.main(arguments, plugins=[attach])
    finally:
        signal.signal(signal.SIGTERM, previous)
    if not run.opened:
        if select and not attach.errors:
            raise SpecError(
                f"--select: expected an expression that matches a check, got {select!r}"
            )
        raise RuntimeError("\n".join(attach.errors) or "the checks did not start")
    print_summary(run.results, str(run.directory), console)
    return run.results.exit_code


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt
