"""A second try of each item that failed, where no adapter would have told of a bad cable."""

from __future__ import annotations

from typing import Final

import pytest
from _pytest.runner import runtestprotocol  # what runs an item, not exported

from conformance.checks import VERDICT
from conformance.report.results import Item
from conformance.run import Run

UNLIKE: Final = (
    "failed and did not when it was tried again: look at cable and plugs, or the device does so "
    "now and then"
)


class SecondTries:
    """Judges no item as failed that did not fail twice.

    Args:
        run: What is run, and its record.
    """

    def __init__(self, run: Run) -> None:
        self._run = run

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> bool:
        """Run an item, and once more if it failed."""
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        reports = runtestprotocol(item, log=False, nextitem=nextitem)
        first = self._run.take_back_failed() if not item.session.shouldstop else None
        if first is not None:
            del item.stash[VERDICT]
            reports = runtestprotocol(item, log=False, nextitem=nextitem)
            self._compare(first)
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def _compare(self, first: Item) -> None:
        """Keep both results of an item that failed at first."""
        results = self._run.results
        second = results.items[-1]
        if second.verdict == "fail":
            return
        again = f"; then {second.verdict}" + (f": {second.reason}" if second.reason else "")
        results.replace_last(first.undecided(f"{UNLIKE}; first {first.seen}{again}"))
