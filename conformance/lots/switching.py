"""How severely the next lot is inspected, by what became of those before (ISO 2859-1:1999, 9.3 and 9.4)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field

from conformance.lots.tables import Severity

WINDOW: Final = 5
"""So many consecutive lots are looked at."""

TOO_MANY: Final = 2
"""Lots not accepted among them that lead to tightened inspection."""

END: Final = 5
"""Lots not accepted under tightened inspection after which sampling is discontinued."""

ENOUGH_SCORE: Final = 30
"""Switching score from which reduced inspection is allowed."""


class Concluded(BaseModel):
    """What became of a lot on original inspection.

    Args:
        lot: Which.
        severity: It was inspected so.
        accepted: It was.
        count: Nonconforming units in the sample, those left undecided included.
        accept: Ac of its plan.
        accept_tighter: Ac with the AQL one step tighter; None where the table has none.
        reduced: Reduced inspection was allowed for what follows: production is steady, and who is responsible wants it.
        resumed: The supplier had acted since sampling was discontinued.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    lot: str
    severity: Severity
    accepted: bool
    count: Annotated[int, Field(ge=0)]
    accept: Annotated[int, Field(ge=0)]
    accept_tighter: int | None = None
    reduced: bool = False
    resumed: bool = False


@dataclass(slots=True)
class Scheme:
    """Where the switching rules have led.

    Args:
        severity: Of the next lot.
        score: The switching score, under normal inspection.
        discontinued: No lot is accepted by sampling until the supplier has acted.
        why: What led there.
    """

    severity: Severity = "normal"
    score: int = 0
    discontinued: bool = False
    why: str = "inspection begins"
    _recent: list[bool] = field(default_factory=list)

    def resume(self) -> None:
        """Begin again under tightened inspection, the supplier having acted."""
        self._switch("tightened", "sampling was resumed")
        self.discontinued = False

    def forbid_reduced(self) -> None:
        """Return to normal inspection where reduced inspection is not wanted any more."""
        if self.severity == "reduced":
            self._switch("normal", "reduced inspection is not allowed any more")

    def conclude(self, lot: Concluded) -> None:
        """Take in what became of the next lot."""
        if lot.resumed and self.discontinued:
            self.resume()
        if not lot.reduced:
            self.forbid_reduced()
        self._recent.append(lot.accepted)
        if self.severity == "normal":
            self._after_normal(lot)
        elif self.severity == "tightened":
            self._after_tightened()
        elif not lot.accepted:
            self._switch("normal", f"lot {lot.lot} was not accepted under reduced inspection")

    def _after_normal(self, lot: Concluded) -> None:
        self.score = _score(self.score, lot)
        refused = self._recent[-WINDOW:].count(False)
        if refused >= TOO_MANY:
            self._switch(
                "tightened",
                f"{refused} of {min(len(self._recent), WINDOW)} consecutive lots were not accepted",
            )
        elif self.score >= ENOUGH_SCORE and lot.reduced:
            self._switch("reduced", f"the switching score reached {self.score}")

    def _after_tightened(self) -> None:
        refused = self._recent.count(False)
        if refused >= END:
            self.discontinued = True
            self.why = f"{refused} lots were not accepted under tightened inspection"
        elif len(self._recent) >= WINDOW and all(self._recent[-WINDOW:]):
            self._switch("normal", f"{WINDOW} consecutive lots were accepted")

    def _switch(self, severity: Severity, why: str) -> None:
        self.severity, self.why, self.score = severity, why, 0
        self._recent.clear()


def _score(score: int, lot: Concluded) -> int:
    """Return the switching score after a lot (ISO 2859-1:1999, 9.3.3.2.1)."""
    if lot.accept >= TOO_MANY:
        tighter = lot.accept_tighter
        return score + 3 if tighter is not None and lot.count <= tighter else 0
    return score + 2 if lot.accepted else 0


def follow(lots: Iterable[Concluded]) -> Scheme:
    """Return where the switching rules lead after some lots, in their order."""
    scheme = Scheme()
    for lot in lots:
        scheme.conclude(lot)
    return scheme
