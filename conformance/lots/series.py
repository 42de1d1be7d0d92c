"""The lots of a product that were concluded, in a file that the switching rules go by."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from conformance.bench.given_back.safe_file import write_safely
from conformance.errors import Problem, SpecError
from conformance.lots.inspection import Inspection
from conformance.lots.lot_file import Lot
from conformance.lots.switching import Concluded, Scheme, follow
from conformance.lots.verdict import LotVerdict


class Series(BaseModel):
    """Concluded lots.

    Args:
        format: Of this file.
        part: What they were of.
        level: Of inspection of all of them.
        aql: Of all of them.
        lots: In the order in which they were concluded.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    format: Literal[1] = 1
    part: str
    level: str
    aql: float
    lots: list[Concluded] = []


def load_series(path: Path, lot: Lot) -> Series:
    """Return the series that a lot belongs to, a new one where there is no such file.

    Raises:
        SpecError: The file is damaged, or of lots that are inspected otherwise.
    """
    content = lot.content
    assert content.aql is not None  # a series goes with a sampling plan
    new = Series(part=content.part, level=content.level, aql=content.aql)
    if not path.exists():
        return new
    try:
        known = Series.model_validate_json(path.read_text("ascii"))
    except (OSError, UnicodeDecodeError, ValidationError) as error:
        text = "expected a series of lots, got what is none"
        raise SpecError(Problem(path, 0, "", text)) from error
    if (known.part, known.level, known.aql) != (new.part, new.level, new.aql):
        raise SpecError(
            f"{path}: expected lots of {new.part}, level {new.level}, AQL {new.aql:g}, "
            f"got {known.part}, level {known.level}, AQL {known.aql:g}"
        )
    return known


def scheme_for(lot: Lot, series: Series) -> Scheme:
    """Return how severely a lot is to be inspected.

    Raises:
        SpecError: Sampling is discontinued.
    """
    before = [it for it in series.lots if it.lot != lot.content.order]
    scheme = follow(before)
    if scheme.discontinued:
        if not lot.content.resumed:
            raise SpecError(
                f"{lot.path}: sampling is discontinued, for {scheme.why}: once the supplier has acted, "
                f"say so by resumed: true; or inspect every unit by level: all"
            )
        scheme.resume()
    if not lot.content.reduced:
        scheme.forbid_reduced()
    return scheme


def conclude(path: Path, lot: Lot, inspection: Inspection, verdict: LotVerdict) -> None:
    """Note what became of a lot, in its place if it was noted before; nothing while that is not decided.

    Raises:
        BenchError: The file cannot be written.
        SpecError: It is damaged.
    """
    series = load_series(path, lot)
    severity, plan = inspection.plan.severity, inspection.plan
    assert severity is not None  # a series goes with a sampling plan
    made = Concluded(
        lot=lot.content.order,
        severity=severity,
        accepted=verdict.word == "accepted",
        count=verdict.nonconforming + verdict.undecided,
        accept=plan.accept,
        accept_tighter=plan.accept_tighter,
        reduced=lot.content.reduced,
        resumed=lot.content.resumed,
    )
    place = next((nth for nth, it in enumerate(series.lots) if it.lot == made.lot), None)
    if verdict.word == "not decided":
        if place is None:
            return
        del series.lots[place]
    elif place is None:
        series.lots.append(made)
    else:
        series.lots[place] = made
    write_safely(path, json.dumps(series.model_dump(mode="json"), indent=1, ensure_ascii=True))
