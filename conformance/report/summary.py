"""What a run prints: progress while it goes, then deviations, counts and where the record is."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from typing import Protocol, Self

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar

from conformance.report.console import Terminal, console
from conformance.report.junit import explain
from conformance.report.provenance_words import milliseconds
from conformance.report.results import VERDICTS, Item, Results
from conformance.report.scanned import Scanned

MOST_NAMED = 20
MOST_OF_ONE = 3
SAID_EVERY_S = 10.0
HEADLINES = {
    "conforms": ("CONFORMS", "bold green"),
    "deviates": ("DEVIATES", "bold red"),
    "inconclusive": ("INCONCLUSIVE", "bold yellow"),
}


class Reported(Protocol):
    """What is reported: a run and its record."""

    results: Results
    total: int

    @property
    def asks(self) -> bool:
        """A person at the terminal is asked questions."""


class Progress:
    """A bar on a terminal, a line per service elsewhere and where questions are asked.

    Args:
        run: The run.
    """

    def __init__(self, run: Reported) -> None:
        self._run = run
        self._in_lines = run.asks or not console.out.is_terminal
        self._service = ""
        self._counts: Counter[str] = Counter()
        self._deviations = 0
        self._bar = Bar(
            TextColumn("{task.description:<20}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            console=console.out,
            transient=True,
            disable=self._in_lines,
        )
        self._task = self._bar.add_task("", total=None)
        self._scan_began = self._said = 0.0

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._bar.stop()
        self._line()

    def item(self, item: Item) -> None:
        """Show one more result."""
        if item.service != self._service:
            self._line()
            self._service = item.service
            self._counts.clear()
        self._counts[item.verdict] += 1
        self._deviations += self._run.results.deviates(item)
        if self._in_lines:
            return
        words = _title(item.service) + (
            f", {self._deviations} deviations" if self._deviations else ""
        )
        self._bar.update(self._task, total=self._run.total, advance=1, description=words)

    def scan(self, done: int, total: int, found: int) -> None:
        """Show how far the walk over the object dictionary is."""
        if not self._scan_began:
            self._scan_began = self._said = time.monotonic()
            self._line()
            self._service = ""
            self._bar.columns = (*self._bar.columns, TimeRemainingColumn())
            self._bar.reset(self._task)
        words = "object dictionary" + (f", {found} undocumented" if found else "")
        self._bar.update(self._task, total=total, completed=done, description=words)
        now = time.monotonic()
        if not self._in_lines or now - self._said < SAID_EVERY_S:
            return
        self._said = now
        left_s = (now - self._scan_began) * (total - done) / done
        console.say(f"{words}: {100 * done // total} %, {left_s:.0f} s left")

    def _line(self) -> None:
        if self._service and self._in_lines:
            counted = ", ".join(
                f"{self._counts[v]} {_word(v)}" for v in VERDICTS if self._counts[v]
            )
            console.say(f"{_title(self._service):<20} {counted}")


def print_summary(results: Results, directory: str, terminal: Terminal) -> None:
    """Print what a technician needs to know."""
    device, run = results.device, results.run
    node_id = device["node_id"]
    where = f"recording {run['recording']}" if "recording" in run else f"bench {run['bench']}"
    terminal.say()
    terminal.say(
        f"{device['vendor']} {device['name']}, {device['variant']}, node {node_id} "
        f"({node_id:02X}h), {float(str(run['bitrate'])) / 1000:g} kbit/s, {where}"
        + (f", serial {device['serial']}" if device["serial"] else ""),
        style="bold",
    )
    terminal.say(f"judged against {device['manual']}")
    terminal.say()
    _table(results, terminal)
    deviations, remarks = results.deviations(), results.remarks()
    _grouped(f"{_many(len(deviations), 'deviation')}:", deviations, explain, terminal)
    _grouped(f"{_many(len(remarks), 'remark')}:", remarks, explain, terminal)
    _baseline(results, terminal)
    undecided = [item for item in results.items if item.verdict == "inconclusive"]
    title = f"{_many(len(undecided), 'item')} could not be decided:"
    _grouped(title, undecided, _reason, terminal)
    again = [item for item in results.items if item.verdict == "pass" and item.tried]
    _grouped(f"{_many(len(again), 'item')} passed at a further try:", again, _tried, terminal)
    skipped = [item for item in results.items if item.verdict == "skipped"]
    _skipped(skipped, terminal)
    not_judged = results.run.get("not_judged")
    if isinstance(not_judged, list) and not_judged:
        words = ", ".join(str(name).replace("_", " ") for name in not_judged)
        terminal.say(f"documented, but not judged by these checks: {words}")
    _scan(results.scanned, terminal)
    terminal.say()
    if results.aborted:
        terminal.say(f"The run ended early: {results.aborted}", style="bold yellow")
    _as_found(results, terminal)
    if results.illegal:
        terminal.say(results.illegal, style="bold yellow")
    word, style = HEADLINES[results.verdict]
    terminal.say(f"{word}: {_counts(results)}", style=style)
    terminal.say(_times(results))
    if run.get("acceptance") is not True:
        terminal.say("partial: the record of no acceptance run (see run --acceptance)")
    _response_times(results, terminal)
    _wear(results, terminal)
    _timestamps(results, terminal)
    terminal.say(f"record: {directory} (report.html, results.json, junit.xml, trace.log)")


def _baseline(results: Results, terminal: Terminal) -> None:
    """Say how many deviations are known, and which entries of the baseline say nothing any more."""
    baseline = results.run.get("baseline")
    if not isinstance(baseline, dict):
        return
    deviations = results.deviations()
    known = sum(bool(item.known) for item in deviations)
    terminal.say(f"known by {baseline['file']}: {known} of {_many(len(deviations), 'deviation')}")
    for item in baseline["expired"]:
        terminal.say(f"expired in the baseline, and deviates: {item}", style="bold yellow")
    for item in baseline["no_longer"]:
        terminal.say(f"in the baseline, and passes: {item}", style="yellow")


def _as_found(results: Results, terminal: Terminal) -> None:
    found = results.run.get("as_found")
    if results.left_changed:
        terminal.say(results.left_changed, style="bold yellow")
    elif isinstance(found, dict) and "differences" in found:
        state = found["nmt_state"].partition(" ")[0] or "NMT state unknown"
        terminal.say(f"left as found: {_many(found['objects'], 'setting')}, {state}")


def _table(results: Results, terminal: Terminal) -> None:
    services = list(dict.fromkeys(item.service for item in results.items))
    rows = []
    for service in services:
        counts = Counter(item.verdict for item in results.items if item.service == service)
        rows.append((_title(service), *(str(counts[v] or "") for v in VERDICTS)))
    if rows:
        terminal.table(("service", *(_word(v) for v in VERDICTS)), rows)


def _grouped(
    title: str, items: list[Item], show: Callable[[Item], str], terminal: Terminal
) -> None:
    """Print items, the first few of each requirement."""
    if not items:
        return
    terminal.say()
    terminal.say(title, style="bold")
    for requirement in dict.fromkeys(item.requirement for item in items):
        group = [item for item in items if item.requirement == requirement]
        for item in group[:MOST_OF_ONE]:
            terminal.say(show(item))
        others = [item.object for item in group[MOST_OF_ONE:]]
        if others:
            named = ", ".join(others[:MOST_NAMED]) + (", …" if len(others) > MOST_NAMED else "")
            terminal.say(f"… and {len(others)} more of {requirement}: {named}")


def _reason(item: Item) -> str:
    return f"{item.id}: {item.reason}"


def _tried(item: Item) -> str:
    return f"{item.id}: {item.tried}"


def _skipped(items: list[Item], terminal: Terminal) -> None:
    reasons = Counter(item.reason for item in items)
    if reasons:
        terminal.say()
    for reason, count in reasons.items():
        terminal.say(f"{_many(count, 'item')} skipped: {reason}")


def _scan(scanned: Scanned | None, terminal: Terminal) -> None:
    if scanned is None:
        return
    terminal.say()
    terminal.say(str(scanned), style="bold")
    for found in scanned.undocumented[:MOST_NAMED]:
        terminal.say(f"  {found}")
    more = len(scanned.undocumented) - MOST_NAMED
    if more > 0:
        terminal.say(f"… and {more} more in results.json")


def _counts(results: Results) -> str:
    counts = results.counts()
    shown = ", ".join(f"{counts[v]} {_word(v)}" for v in VERDICTS if counts[v])
    return f"{_many(len(results.items), 'item')}: {shown or 'nothing was judged'}"


def _times(results: Results) -> str:
    run = results.run
    wall = float(str(run.get("wall_s", 0)))
    text = f"{wall:.1f} s, {run.get('frames', 0)} frames"
    bus_time = run.get("bus_time")
    if not isinstance(bus_time, dict) or not wall:
        return text
    needed, taken = bus_time["needed_s"], bus_time["taken_s"]
    if run["clock"] == "virtual":
        return f"{text}; {taken:.0f} s of bus time, {taken / wall:.0f} times as fast as real"
    share = f" ({taken / needed:.2f})" if needed else ""
    return f"{text}; bus time needed {needed:.1f} s, taken {taken:.1f} s{share}"


def _response_times(results: Results, terminal: Terminal) -> None:
    times = results.run.get("sdo_response_times")
    if isinstance(times, dict) and times.get("transfers"):
        terminal.say(
            f"{_many(times['transfers'], 'SDO transfer')} answered: median {times['median_ms']} ms, "
            f"99 % within {times['p99_ms']} ms, at most {times['max_ms']} ms "
            f"({times['max_object']})"
        )


def _wear(results: Results, terminal: Terminal) -> None:
    writes, cycles = results.run.get("non_volatile_writes"), results.run.get("wear_cycles")
    if isinstance(writes, int) and writes:
        of = f" of the {cycles:,} that its manual gives it" if isinstance(cycles, int) else ""
        terminal.say(f"non-volatile memory of the node: {_many(writes, 'write')}{of}")


def _timestamps(results: Results, terminal: Terminal) -> None:
    stamps = results.run.get("timestamps")
    if isinstance(stamps, dict) and stamps["late_ms"]:
        terminal.say(
            f"timestamps by the {stamps['by']}, up to {milliseconds(stamps['late_ms'])} late"
        )


def _many(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _title(service: str) -> str:
    words = service.replace("_", " ")
    return words.upper() if len(words) <= 4 else words


def _word(verdict: str) -> str:
    return verdict.replace("_", " ")
