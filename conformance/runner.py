"""Runs the checks in this process for the command line, and tells the user how it goes."""

from __future__ import annotations

import gc
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from conformance.errors import BenchError, ConformanceError, SpecError
from conformance.interrupts import interruptible
from conformance.report.console import console
from conformance.report.plan import print_plan
from conformance.report.record import read_record
from conformance.report.report_page import write_page
from conformance.report.repro import script
from conformance.report.seal import write_seal
from conformance.report.summary import Progress, print_summary
from conformance.run import Run
from conformance.session import RUN

CHECKS = Path(__file__).parent / "checks"
UNUSED = (
    "terminal",
    "cacheprovider",
    "logging",
    "setuponly",
    "setupplan",
    "unittest",
    "warnings",
    "unraisableexception",
    "threadexception",
)
"""Plug-ins of pytest that a run has no use for and would spend its time on."""


class _Attach:
    """Hands the run to the plug-in before it would make its own."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self.errors: list[str] = []

    @pytest.hookimpl(tryfirst=True)
    def pytest_configure(self, config: pytest.Config) -> None:
        config.stash[RUN] = self._run

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.errors.append(report.longreprtext)


def run(run: Run) -> int:
    """Run the checks, print the summary and return the exit code.

    Raises:
        SpecError: No check matches the selection.
    """
    if run.options.dry_run:
        return _list(run)
    progress = Progress(run)
    run.progress, run.scan_progress = progress.item, progress.scan
    with progress:
        errors = play(run)
    if run.results.aborted and not run.opened:
        raise BenchError(run.results.aborted)
    if not run.opened:
        if run.options.repro and not errors:
            raise SpecError(f"--repro: expected the id of an item, got {run.options.repro!r}")
        if run.options.select and not errors:
            raise SpecError(
                f"--select: expected a part of an item's id, got {run.options.select!r}"
            )
        raise RuntimeError("\n".join(errors) or "the checks did not start")
    write_reports(run)
    print_summary(run.results, str(run.directory), console)
    if run.options.repro and run.directory is not None:
        for item in run.results.items:
            console.say()
            console.say(script(run.directory, item.id))
    return run.results.exit_code


def write_reports(run: Run) -> None:
    """Write the report of a run that was opened beside its record, from that alone, and seal them.

    A run whose report cannot be written has ended early.
    """
    assert run.directory is not None  # it was opened
    try:
        write_page(read_record(run.directory))
        write_seal(run.directory)
    except ConformanceError as error:
        run.abort(str(error))


def _list(run: Run) -> int:
    """List what would be run; no bus is opened.

    Raises:
        SpecError: No check matches the selection.
    """
    errors = play(run)
    if errors:
        raise RuntimeError("\n".join(errors))
    if not run.plan:
        raise SpecError("expected a selection that some item matches, got none")
    print_plan(run.plan, run.definition.most_writes, console)
    return 0


def play(run: Run, *plugins: object) -> list[str]:
    """Have pytest run the checks.

    Args:
        run: What is run, and its record.
        plugins: Of pytest, beside those of every run.

    Returns:
        What kept checks from being collected.
    """
    for library in ("can", "canopen"):
        logging.getLogger(library).setLevel(logging.CRITICAL)  # what matters comes as an exception
    attach = _Attach(run)
    arguments = [
        *(f"-p{name}" for name in ("conformance.plugin", "pytest_timeout")),
        *(f"-pno:{name}" for name in UNUSED),
        "-c",
        str(CHECKS / "pytest.ini"),
        "--capture=no",
        "--assert=plain",
        "--device",
        run.options.device,
        *(["--collect-only"] if run.options.dry_run else []),
        str(CHECKS),
    ]
    with _undisturbed():
        pytest.main(arguments, plugins=[attach, *plugins])
    return attach.errors


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let only what a run needs be loaded, and take Ctrl-C as a run does.

    The user's other plug-ins and settings change no verdict. For garbage the run looks itself, between
    items: a look takes ten milliseconds and more, in which no frame is taken over.
    """
    environment = dict(os.environ)
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    os.environ.pop("PYTEST_ADDOPTS", None)
    gc.disable()
    try:
        with interruptible():
            yield
    finally:
        gc.enable()
        os.environ.clear()
        os.environ.update(environment)
