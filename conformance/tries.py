"""Further tries of items: where late timestamps left one open, and where a bad cable may have failed it.

Which try decides depends on no verdict: one that late timestamps left open says nothing of the device, and
the first that says something counts, a pass or a fail. A device at a limit is left open each time.

Nothing is reset between tries. An item undoes what it did; what the node went through before it, only all
items before it would bring back. A reset would bring yet another state, lose settings that were not stored,
and hide what goes wrong after a while. So what fails the first time alone, where no adapter would have told
of a bad cable, is inconclusive: no deviation, and no pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import pytest
from _pytest.runner import runtestprotocol  # what runs an item, not exported

from conformance.checks import LATE_MS, VERDICT
from conformance.numbers import figure
from conformance.report.results import Item
from conformance.run import Run

MOST: Final = 3
"""So many tries of an item that late timestamps leave open."""

UNLIKE: Final = (
    "failed and did not when it was tried again: look at cable and plugs, or the device does so "
    "now and then"
)


@dataclass(frozen=True, slots=True)
class Late:
    """A try that late timestamps left open.

    Args:
        item: What it came to.
        late_ms: By how much timestamps may have been late.
    """

    item: Item
    late_ms: float


class Tries:
    """Runs each item until it is decided, as far as further tries help.

    Args:
        run: What is run, and its record.
    """

    def __init__(self, run: Run) -> None:
        self._run = run

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> bool:
        """Run an item, and once more if it failed where the cable may have done that."""
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        items = self._run.results.items
        before = len(items)
        reports = self._in_time(item, nextitem)
        if len(items) > before:
            if items[-1].verdict == "fail" and self._cable_may_fail and self._goes_on(item):
                first = self._run.take_back()
                reports = self._in_time(item, nextitem)
                self._run.results.replace_last(_compared(first, items[-1]))
            self._run.tell()
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    @property
    def _cable_may_fail(self) -> bool:
        return not self._run.definition.tells_of_errors

    def _goes_on(self, item: pytest.Item) -> bool:
        return not item.session.shouldstop and not self._run.results.aborted

    def _in_time(self, item: pytest.Item, nextitem: pytest.Item | None) -> list[pytest.TestReport]:
        """Run an item, and again while late timestamps alone leave it open."""
        results = self._run.results
        late: list[Late] = []
        reports = self._once(item, nextitem)
        while item.stash[LATE_MS] and self._run.in_real_time and self._goes_on(item):
            late.append(Late(results.items[-1], item.stash[LATE_MS]))
            if len(late) == MOST:
                break
            self._run.take_back()
            reports = self._once(item, nextitem)
        if late:
            results.replace_last(_decided(late, results.items[-1]))
        return reports

    def _once(self, item: pytest.Item, nextitem: pytest.Item | None) -> list[pytest.TestReport]:
        item.stash[LATE_MS] = 0.0
        if VERDICT in item.stash:
            del item.stash[VERDICT]
        return runtestprotocol(item, log=False, nextitem=nextitem)


def _decided(late: Sequence[Late], last: Item) -> Item:
    """Return what an item came to after tries that late timestamps left open; the last may be one."""
    if last.verdict == "skipped":  # one more try would wear the memory out
        last = late[-1].item
    if last is late[-1].item and len(late) > 1:
        last = replace(last, reason=f"{last.reason}, at each of {len(late)} tries")
    words = (
        f"{figure(it.late_ms, 2)} ms at try {n} ({it.item.trace})" for n, it in enumerate(late, 1)
    )
    return replace(last, tried=f"timestamps were late by up to {', '.join(words)}")


def _compared(first: Item, second: Item) -> Item:
    """Return what an item came to that failed at first: it fails if it did so again."""
    if second.verdict == "fail":
        again = f"failed the time before as well ({first.trace})"
        return replace(second, tried="; ".join(filter(None, (again, second.tried))))
    again = f"; then {second.verdict}" + (f": {second.reason}" if second.reason else "")
    return first.undecided(f"{UNLIKE}; first {first.seen}{again}")
