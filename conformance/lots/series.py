"""The lots of a product that were concluded, which the switching rules go by."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from conformance.errors import SpecError
from conformance.lots.inspection import Inspection
from conformance.lots.lot_file import Lot
from conformance.lots.switching import Concluded, Scheme, follow
from conformance.lots.verdict import LotVerdict


class Terms(BaseModel):
    """What the lots of a series have in common.

    Args:
        part: What they were of.
        level: Of inspection of all of them.
        aql: Of all of them.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    part: str
    level: str
    aql: float

    def __str__(self) -> str:
        return f"{self.part}, level {self.level}, AQL {self.aql:g}"

    @classmethod
    def of(cls, lot: Lot) -> Terms:
        """Return the terms of a lot that is sampled."""
        content = lot.content
        assert content.aql is not None  # a series goes with a sampling plan
        return cls(part=content.part, level=content.level, aql=content.aql)


def require_terms(where: object, known: Terms, lot: Lot) -> None:
    """Make sure that a lot is inspected as those of its series were.

    Raises:
        SpecError: It is not.
    """
    if known != (new := Terms.of(lot)):
        raise SpecError(f"{where}: expected lots of {new}, got {known}")


def scheme_for(lot: Lot, lots: list[Concluded]) -> Scheme:
    """Return how severely a lot is to be inspected.

    Args:
        lot: Which.
        lots: Those of its series.

    Raises:
        SpecError: Sampling is discontinued.
    """
    before = [it for it in lots if it.lot != lot.content.order]
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


def concluded(lot: Lot, inspection: Inspection, verdict: LotVerdict) -> Concluded:
    """Return what became of a lot that is decided."""
    severity, plan = inspection.plan.severity, inspection.plan
    assert severity is not None  # a series goes with a sampling plan
    return Concluded(
        lot=lot.content.order,
        severity=severity,
        accepted=verdict.word == "accepted",
        count=verdict.nonconforming + verdict.undecided,
        accept=plan.accept,
        accept_tighter=plan.accept_tighter,
        reduced=lot.content.reduced,
        resumed=lot.content.resumed,
    )
