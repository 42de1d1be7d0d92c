"""What a run keeps of the node as it was found, and how it leaves it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from conformance.bench.given_back.as_found import AsFound
from conformance.bench.given_back.journal import NAME, Found, Held, Journal
from conformance.bench.session import Bench
from conformance.errors import BenchError, ConformanceError, NodeTimeout
from conformance.report.results import Results


class Leaving:
    """The node is to be left as it was found.

    Args:
        journal: What tells how the node is reached again.
        folder: Of the record.
    """

    def __init__(self, journal: Journal, folder: Path) -> None:
        self._journal = journal
        self._folder = folder
        self._found: AsFound | None = None

    def look(self, bench: Bench, *, restarts: bool) -> Held:
        """Look at the node before a run, and return what it holds; nothing of one that fails so early.

        Args:
            bench: The open bench; its node was found.
            restarts: What will be run may restart the node, so this may as well.

        Raises:
            BenchError: The disk does not take what was found.
        """
        try:
            self._found = AsFound.look(bench, self._keep, restarts=restarts)
        except NodeTimeout:
            return {}
        return self._found.found.held

    def give_back(self, results: Results) -> None:
        """Give the node back, and note in the record what is not as it was found."""
        found = self._found
        if found is None:
            return
        record = results.run["as_found"] = {
            "objects": len(found),
            "nmt_state": found.nmt_state,
        }
        try:
            differences = found.give_back()
        except ConformanceError as error:
            results.abort(f"whether the node is as it was found cannot be seen: {error}")
            return
        record["differences"] = [asdict(difference) for difference in differences]
        if differences:
            names = ", ".join(dict.fromkeys(difference.object for difference in differences))
            results.left_changed = (
                f"the node is not left as it was found: {names}; "
                f"try: canopen-conformance recover {self._folder}"
            )
            return
        try:
            self._keep(found.found, given_back=True)
        except BenchError as error:
            results.abort(str(error))

    def _keep(self, found: Found, *, given_back: bool = False) -> None:
        """Put what the node held where it outlives this process."""
        self._journal.keep(self._folder / NAME, found, given_back=given_back)
