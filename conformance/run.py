"""One run: what is judged, on which bench, and its record while it grows."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Collection
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import get_args

from conformance import resources, scanning
from conformance.bench.bus.markers import Markers, require_free, require_not_held
from conformance.bench.definition import load_bench
from conformance.bench.given_back.journal import Journal
from conformance.bench.overriding import overridden
from conformance.bench.services.identity import read_identity, told_serial
from conformance.bench.session import Bench
from conformance.comparing.baseline import load_baseline
from conformance.effects import WEARING, Effect, Need
from conformance.errors import BenchError, ConformanceError
from conformance.judged import OnBus, facts_of, item_id, item_of
from conformance.leaving import Leaving
from conformance.options import RunOptions, refusal, selection, simulation
from conformance.provenance import device, manual, provenance
from conformance.report import repro
from conformance.report.eds_word import EdsWord
from conformance.report.folder import make_folder
from conformance.report.junit import explain, write_junit
from conformance.report.plan import Planned
from conformance.report.results import Item, Results
from conformance.report.scanned import Scanned
from conformance.report.seal import NAME as SEAL
from conformance.report.seal import digest
from conformance.requirements import Case, Requirement
from conformance.scanning import ScanProgress
from conformance.spec.eds.reader import read_eds
from conformance.spec.load import load_spec
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict, VerdictWord

SAVE_EVERY_S = 1.0
GARBAGE_AT = 200_000
"""Objects made and kept before an item begins with a look for garbage among them."""
LOST = (
    "the node did not answer afterwards, and nothing tells whether that is its fault: "
    "check cable and supply, then run this item again"
)
RESTARTING: frozenset[Effect] = frozenset(get_args(Effect)) - {"reads", "writes", "other-nodes"}
"""Effects that come with a restart of the node, or outlast one."""


class Run:
    """A run from its options to its record.

    Args:
        options: What the user asked for.
        progress: Called with each item's result.

    Raises:
        SpecError: The input is wrong; nothing was opened or sent.
    """

    def __init__(self, options: RunOptions, progress: Callable[[Item], None] | None = None) -> None:
        self.options = options
        self.progress = progress
        self.scan_progress: ScanProgress | None = None
        self._files = {
            "bench": resources.find("fixtures/benches", options.bench, "--bench"),
            "device": resources.find("device_specs", options.device, "DEVICE"),
        }
        self.definition = overridden(
            load_bench(self._files["bench"]), options.channel, options.bitrate
        )
        self._spec_file = file = load_spec(self._files["device"])
        node_id = self.definition.node_id if options.node_id is None else options.node_id
        self.spec: DeviceSpec = file.resolve(options.variant, node_id)
        self.strict = options.strict
        self._selection = selection(options.select)
        self._eds = None if options.eds is None else EdsWord(read_eds(Path(options.eds)), self.spec)
        today = date.today()  # noqa: DTZ011 - a baseline expires by the calendar on the wall
        known = options.baseline
        self._baseline = None if known is None else load_baseline(known, today)
        self.simulation = simulation(options, self.definition, self.spec)
        if self.definition.markers is not None:
            require_free(self.definition.markers, self.spec)
        self.results = Results(
            provenance(options, self.definition, self.spec, self._eds),
            device(self.spec, options.serial),
            strict=options.strict,
        )
        self.directory: Path | None = None
        self.plan: list[Planned] = []
        self.total = 0
        self._bench: Bench | None = None
        self._leaves: Leaving | None = None
        self._markers: Markers | None = None
        self._marker = 0
        self._started = 0.0
        self._started_s = 0.0
        self._saved = 0.0
        self._line = 0
        self._begins = 1
        self._item_started_s = 0.0

    def refuses(self, effects: tuple[Effect, ...], needs: tuple[Need, ...]) -> str:
        """Return why the bench cannot run a check with these effects and needs, empty if it can."""
        bitrate = self.definition.bitrate or self.spec.bitrate
        factory = self._spec_file.document.factory
        as_made = (self.spec.node_id, bitrate) == (factory.node_id, factory.bitrate)
        if "restores" in effects and not as_made:
            return (
                "restoring the factory settings would move the node to another node-ID or bit rate"
            )
        return refusal(self.definition, effects, needs)

    def wears_out(self, effects: Collection[Effect]) -> str:
        """Return why a check with these effects may not begin any more, empty if it may."""
        if self._bench is None or WEARING.isdisjoint(effects):
            return ""
        return self._bench.worn

    @property
    def asks(self) -> bool:
        """A person at the terminal is asked questions."""
        return self.definition.operator == "terminal"

    def selects(self, requirement: Requirement, case: Case) -> bool:
        """Tell whether the user's selection includes an item."""
        identifier, wanted = item_id(self.spec, requirement, case), self.options.repro
        if wanted:
            return identifier in (wanted, f"{self.spec.name}/{wanted}")
        return self._selection(identifier)

    # While it runs

    def open(self, total: int, effects: Collection[Effect]) -> Bench:
        """Open the bench, find the node and begin the record.

        Args:
            total: How many items there will be.
            effects: What they may do to the node.

        Raises:
            BenchError: There is no bus, no node, or no place for the record.
        """
        self.total = total
        self.directory = self._make_directory()
        self._started = time.monotonic()
        self._save()
        self._bench = Bench.open(
            self.definition, self.spec, self.simulation, self.directory / "trace.log"
        )
        self._respect_others(self._bench)
        self._started_s = self._item_started_s = self._bench.link.now()
        self.results.run["started"] = datetime.now(UTC).isoformat(timespec="seconds")
        self._bench.find_node()
        restarts = not RESTARTING.isdisjoint(effects)
        self._leaves = self._leaving(self.directory)
        held = self._leaves.look(self._bench, restarts=restarts)
        identity = self.results.device["identity"] = read_identity(self._bench.node())
        self.results.device["serial_told"] = told_serial(self.spec, identity)
        if self.definition.markers is not None:
            require_not_held(self.definition.markers, self.spec, held)
            self._markers = Markers(self._bench.link, self.definition.markers)
            self.results.run["markers"] = self.definition.markers
        return self._bench

    def _respect_others(self, bench: Bench) -> None:
        """Tell a bench of other units on its bus: there are none."""

    def _leaving(self, folder: Path) -> Leaving:
        journal = Journal(
            device=str(self._files["device"].resolve()),
            variant=self.spec.variant,
            bench=str(self._files["bench"].resolve()),
            channel=self.definition.channel,
            node_id=self.spec.node_id,
            bitrate=self.definition.bitrate or self.spec.bitrate,
            serial=self.options.serial,
        )
        return Leaving(journal, folder)

    @property
    def opened(self) -> bool:
        """The run got as far as opening its bench."""
        return self.directory is not None

    def _make_directory(self) -> Path:
        """Make the folder for the record, without what an earlier one left for other programs."""
        name = (self.spec.name, self.spec.variant, _file_name(self.options.serial))
        folder = make_folder(self.options.report_dir, *name)
        try:
            for stale in ("junit.xml", "report.html", SEAL):
                (folder / stale).unlink(missing_ok=True)
        except OSError as error:
            raise BenchError(f"cannot make {folder}: {error.strerror}") from error
        return folder

    def begin_item(self, *, runs: bool) -> None:
        """Note where an item begins on the bus, and mark it there if it runs.

        Raises:
            BenchError: The adapter refused the mark.
        """
        if gc.get_count()[0] > GARBAGE_AT:
            gc.collect(1)
        self._marker = len(self.results.items) + 1 if runs and self._markers is not None else 0
        if self._markers is not None and self._marker:
            self._markers.begin(self._marker)
        if self._bench is not None:
            self._line, self._item_started_s = self._bench.link.line, self._bench.link.now()
            self._begins = self._line + 1
            self._bench.link.trouble.begin()

    @property
    def trouble(self) -> str:
        """What the adapter told of its bus since the item began, empty if nothing."""
        return "" if self._bench is None else str(self._bench.link.trouble)

    def reconsider(self) -> None:
        """Blame nothing on a node that had gone when its item was over, where it may be the bench's fault."""
        items = self.results.items
        if self._bench is None or not self._bench.lost_node or not items:
            return
        last = items[-1]
        if last.verdict == "fail":
            self.results.replace_last(last.undecided(f"{LOST}; what came instead: {last.seen}"))

    @property
    def in_real_time(self) -> bool:
        """Time on the bus is time: who is late once need not be so again."""
        return self._bench is not None and self._bench.link.real_time

    def take_back(self) -> Item:
        """Take the last item off the record again, with all that it goes by; return it."""
        assert self._bench is not None  # it was judged there
        self._bench.observations.forget()
        return self.results.take_last()

    def end_item(self) -> None:
        """Mark where the item ends that was recorded last."""
        number, self._marker = self._marker, 0
        if self._markers is not None and number:
            try:
                self._markers.end(number, self.results.items[-1].verdict)
            except BenchError as error:
                self.abort(str(error))

    def begin_check(self) -> None:
        """Note where the check itself begins on the bus, its set-up done."""
        if self._bench is not None:
            self._begins = self._bench.link.line + 1

    def item(
        self,
        requirement: Requirement,
        case: Case,
        word: VerdictWord,
        verdict: Verdict,
        reason: str = "",
    ) -> Item:
        """Return the result of one item; what happened on the bus since it began is its trace."""
        last, now = (self._bench.link.line, self._bench.link.now()) if self._bench else (0, 0.0)
        bus = OnBus(self._line + 1, last, self._begins, now - self._item_started_s, self._marker)
        item = item_of(self.spec, requirement, case, word, verdict, reason, bus)
        if word != "fail":
            return item
        again = repro.command(self.options.arguments(self.spec.variant), item.id)
        return replace(
            item,
            repro=again,
            eds={} if self._eds is None else self._eds.on(item),
            known="" if self._baseline is None else self._baseline.known(item.id),
        )

    def record(self, item: Item) -> None:
        """Add a result to the record, which may be taken back."""
        self.results.items.append(item)

    def tell(self) -> None:
        """Tell of the last result, which stays; save the record now and then."""
        if self.progress is not None:
            self.progress(self.results.items[-1])
        self._save_now_and_then()

    def _save_now_and_then(self) -> None:
        now = time.monotonic()
        if now - self._saved >= SAVE_EVERY_S:
            self._saved = now
            self._save()

    def scan(self) -> None:
        """Walk over the object dictionary, if that was asked for and the run did not end early."""
        if not self.options.scan or self._bench is None or self.results.aborted:
            return
        if reason := self.refuses(("reads",), ()):
            self.abort(f"no scan: {reason}")
            return
        try:
            ended = scanning.scan(self._bench, self._keep_scanned, self.scan_progress)
        except ConformanceError as error:
            ended = str(error)
        if ended:
            self.abort(f"scan: {ended}")

    def _keep_scanned(self, scanned: Scanned) -> None:
        self.results.scanned = scanned
        self._save_now_and_then()

    def explain(self, item: Item) -> str:
        """Return a result as text for a terminal."""
        return explain(item) if item.verdict == "fail" else f"{item.id}: {item.reason}"

    def abort(self, reason: str) -> None:
        """Note that the run ends early."""
        self.results.abort(reason)

    def close(self) -> None:
        """Close the bench and write the record, whatever the run has come to."""
        if self._leaves is not None:
            self._leaves.give_back(self.results)
        bench, self._bench = self._bench, None
        self.results.complete = not self.results.aborted and len(self.results.items) >= self.total
        if bench is not None:
            bench.look()
            self.results.run |= facts_of(bench, self._started_s)
            self.results.illegal = str(bench.illegal)
            try:
                bench.close()
                if self.directory is not None:
                    self.results.run["trace_sha256"] = digest(self.directory / "trace.log")
            except BenchError as error:
                self.abort(str(error))
        self._note_baseline()
        self.results.run["finished"] = datetime.now(UTC).isoformat(timespec="seconds")
        self.results.manual = manual(self._spec_file, self.spec.variant)
        self.results.run["wall_s"] = round(time.monotonic() - self._started, 3)
        try:
            self._save()
            if self.directory is not None:
                write_junit(self.results, self.directory / "junit.xml", self.options.junit_suites)
        except BenchError as error:
            self.abort(str(error))

    def _note_baseline(self) -> None:
        """Note which entries of the baseline say nothing any more."""
        if self._baseline is None:
            return
        deviating = [item.id for item in self.results.deviations()]
        passing = {item.id for item in self.results.items if item.verdict == "pass"}
        self.results.run["baseline"] = {
            "file": str(self.options.baseline),
            "expired": [entry.item for entry in self._baseline.expired(deviating)],
            "no_longer": [it for it in self._baseline.entries if it in passing],
        }

    def _save(self) -> None:
        if self._bench is not None:
            self._bench.link.flush()
        if self.directory is not None:
            self.results.write(self.directory / "results.json")


def _file_name(text: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in text)
