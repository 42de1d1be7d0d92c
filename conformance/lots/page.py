"""What an inspection came to, at the terminal and as a page."""

from __future__ import annotations

from conformance.lots.inspection import Inspection, Try, Unit
from conformance.lots.lot_file import Lot
from conformance.lots.statistics import Quantity, Statistics
from conformance.lots.verdict import LotVerdict
from conformance.numbers import figure
from conformance.report.console import Terminal
from conformance.report.pages import render
from conformance.report.printable import printable

STYLES = {"accepted": "bold green", "not accepted": "bold red", "not decided": "bold yellow"}
MOST_OF_A_REASON = 1000
MOST_ROWS = 10
"""Rows that the terminal shows of a statistic; the page and `lot.json` have all."""


def print_plan(lot: Lot, inspection: Inspection, terminal: Terminal, *, drawn: bool) -> None:
    """Print which units are drawn, and why so many.

    Args:
        lot: The lot.
        inspection: Of it.
        terminal: Where to.
        drawn: That is settled also where the lot file has no seed.
    """
    terminal.say(f"{lot.content.name}: {inspection.plan.words}")
    if lot.content.select:
        terminal.say(f"items judged: {lot.content.select}, those alone")
    if inspection.plan.sample == inspection.plan.size:
        terminal.say(f"units to judge: all {inspection.plan.size}")
        return
    if not drawn and lot.content.seed is None:
        terminal.say("which units are drawn is thrown when the inspection begins")
        return
    numbers = ", ".join(str(it.unit) for it in inspection.units)
    what = "serial numbers" if lot.content.serials else "places"
    terminal.say(f"units drawn (seed {inspection.seed}), by {what}: {numbers}")


def say_try(nth: int, inspection: Inspection, unit: Unit, terminal: Terminal) -> None:
    """Print what the last run of a unit came to, in a line."""
    tried = unit.tries[-1]
    terminal.say(f"{nth}/{inspection.plan.sample}  {unit.unit}  {tried.verdict}{_why(tried)}")


def _why(tried: Try) -> str:
    why = tried.reason or ", ".join(tried.deviations[:3])
    more = len(tried.deviations) - 3
    return f"  {why}{f' (and {more} more)' if more > 0 and not tried.reason else ''}" if why else ""


def declarations(unit: Unit) -> list[str]:
    """Return what people said of a unit, a sentence each."""
    return [
        f"declared nonconforming by {printable(it.by)}, {it.when}: {printable(it.reason, MOST_OF_A_REASON)}"
        f" ({'not measured' if it is unit.declared_so else 'a run has decided since'})"
        for it in unit.declared
    ]


def print_summary(
    lot: Lot,
    inspection: Inspection,
    verdict: LotVerdict,
    numbers: Statistics,
    terminal: Terminal,
) -> None:
    """Print what the inspection came to so far."""
    terminal.say()
    wrong = [it for it in inspection.units if it.verdict in ("nonconforming", "undecided")]
    if wrong:
        rows: list[tuple[str, ...]] = [
            (
                str(it.unit),
                str(it.verdict),
                "; ".join(([_why(told).strip()] if told else []) + declarations(it)),
                told.folder if told else "",
            )
            for it in wrong
            for told in [it.telling]
        ]
        terminal.table(("unit", "verdict", "why", "record"), rows)
        terminal.say()
    if numbers.by_requirement:
        counted = list(numbers.by_requirement.items())[:MOST_ROWS]
        terminal.table(("requirement", "units that deviate"), [(it, str(n)) for it, n in counted])
        terminal.say()
    notable = [it for it in numbers.quantities if _notable(it)]
    if notable:
        rows = [quantity_row(it) for it in notable[:MOST_ROWS]]
        terminal.table(("measured", "limits", "mean", "spread", "Cpk", "notable"), rows)
        terminal.say()
    for text in serial_words(numbers):
        terminal.say(text)
    terminal.say(
        f"{numbers.judged} judged: {verdict.conforming} conform, "
        f"{verdict.nonconforming - numbers.declared} deviate, "
        f"{verdict.undecided} undecided; {numbers.first_pass} conformed in their first run"
    )
    if numbers.declared:
        terminal.say(f"declared nonconforming by a person, not measured: {numbers.declared}")
    terminal.say(
        f"{lot.content.name}: {verdict.word.upper()}: {verdict.reason}", style=STYLES[verdict.word]
    )


def serial_words(numbers: Statistics) -> list[str]:
    """Return what is odd about the serial numbers, a sentence each."""
    found = numbers.serials
    parts = {
        "told by more than one unit": found.twice,
        "told and not in the list": found.unlisted,
        "drawn and not told by any unit": found.missing,
    }
    words = [f"serial numbers {what}: {', '.join(them)}" for what, them in parts.items() if them]
    if silent := numbers.judged - found.told:
        words.append(
            f"units that told no serial number, so that nothing shows which they are: {silent}"
        )
    return words


def _notable(it: Quantity) -> bool:
    return bool(it.outliers) or it.drift_per_unit is not None or (it.cpk is not None and it.cpk < 1)


def quantity_row(it: Quantity) -> tuple[str, str, str, str, str, str]:
    """Return a measured quantity as cells: name, limits, mean, spread, Cpk, what is notable."""
    limits = f"{_number(it.least)} to {_number(it.most)} {it.unit}"
    notable = []
    if it.drift_per_unit is not None:
        notable.append(f"drifts by {figure(it.drift_per_unit, 3)} {it.unit} per unit")
    if it.outliers:
        notable.append(f"outliers: {', '.join(map(str, it.outliers))}")
    return (
        f"{it.item} {it.quantity}",
        limits,
        figure(it.mean, 5),
        figure(it.spread, 3),
        "-" if it.cpk is None else f"{it.cpk:.2f}",
        "; ".join(notable),
    )


def _number(limit: float | None) -> str:
    return "-" if limit is None else figure(limit, 6)


def to_html(lot: Lot, inspection: Inspection, verdict: LotVerdict, numbers: Statistics) -> str:
    """Return the lot summary as a page; records are linked by their folders beside it."""
    return render(
        "lot.html.j2",
        lot=lot.content,
        inspection=inspection,
        verdict=verdict,
        numbers=numbers,
        declarations=declarations,
        quantities=[quantity_row(it) for it in numbers.quantities],
        serials=serial_words(numbers),
    )
