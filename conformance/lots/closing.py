"""What came of an inspection so far is concluded, written and printed."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from conformance.errors import BenchError
from conformance.lots.inspection import NAME, Inspection
from conformance.lots.kept_series import KeptSeries
from conformance.lots.lot_file import Lot
from conformance.lots.page import print_summary, to_html
from conformance.lots.series import concluded
from conformance.lots.statistics import Statistics, statistics_of
from conformance.lots.verdict import LotVerdict, decide
from conformance.report.console import console

PAGE: Final = "lot.html"


def close(lot: Lot, inspection: Inspection, folder: Path, series: KeptSeries | None) -> LotVerdict:
    """Write and print what came of an inspection so far, and return the verdict.

    Args:
        lot: The lot.
        inspection: Its state.
        folder: Of the inspection.
        series: That the lot is one of; None where it is of none.

    Raises:
        BenchError: The disk does not take it.
    """
    verdict, numbers = _concluded(lot, inspection, folder)
    page = folder / PAGE
    try:
        page.write_text(to_html(lot, inspection, verdict, numbers), encoding="utf-8", newline="\n")
    except OSError as error:
        raise BenchError(f"cannot write {page}: {error.strerror}") from error
    print_summary(lot, inspection, verdict, numbers, console)
    console.say(f"record: {folder} ({PAGE}, {NAME}, and a folder for each run)")
    if series is not None and not lot.content.resubmitted:
        _note(lot, inspection, verdict, series)
    return verdict


def _note(lot: Lot, inspection: Inspection, verdict: LotVerdict, series: KeptSeries) -> None:
    """Note in the series what became of the lot."""
    if verdict.word != "not decided":
        series.note(lot, concluded(lot, inspection, verdict))
    elif inspection.concluded:
        series.note(lot, None)


def _concluded(lot: Lot, inspection: Inspection, folder: Path) -> tuple[LotVerdict, Statistics]:
    """Write the state with the verdict and the statistics, and return those."""
    verdict = decide(inspection)
    inspection.concluded |= verdict.word != "not decided"
    numbers = statistics_of(inspection, lot.content.serials)
    more: dict[str, Any] = {
        "verdict": {**asdict(verdict), "exit_code": verdict.exit_code},
        "statistics": numbers.as_keys(),
    }
    inspection.keep(folder, **more)
    return verdict, numbers
