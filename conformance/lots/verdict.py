"""What became of a lot, and why, in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from conformance.lots.inspection import Inspection

LotWord: TypeAlias = Literal["accepted", "not accepted", "not decided"]


@dataclass(frozen=True, slots=True)
class LotVerdict:
    """The verdict of a lot.

    Args:
        word: In a word or two.
        reason: Why.
        conforming: Units of the sample that conform.
        nonconforming: Units of the sample that deviate.
        undecided: Units of the sample that were judged and could not be decided.
        waiting: Units of the sample that were not judged yet.
        declared: Of those that deviate, those that no run decided: a person declared them nonconforming.
    """

    word: LotWord
    reason: str
    conforming: int
    nonconforming: int
    undecided: int
    waiting: int
    declared: int = 0

    @property
    def exit_code(self) -> int:
        """0 accepted, 1 not accepted, 2 not decided."""
        return {"accepted": 0, "not accepted": 1, "not decided": 2}[self.word]


def decide(inspection: Inspection) -> LotVerdict:
    """Return what becomes of a lot.

    A unit that could not be decided is never taken for a conforming one: the lot is accepted only where it
    would be if all such units deviated.
    """
    plan = inspection.plan
    good, bad, open_, waiting = (
        inspection.count(word) for word in ("conforming", "nonconforming", "undecided", None)
    )
    declared = sum(it.declared_so is not None for it in inspection.units)
    seen = f"{bad} of {plan.sample} units nonconforming"
    if declared:
        seen += f" ({declared} declared so by a person, not measured)"
    if bad >= plan.reject:
        reason = f"{seen}, which is Re {plan.reject} or more"
        return LotVerdict("not accepted", reason, good, bad, open_, waiting, declared)
    if waiting:
        reason = f"{waiting} of {plan.sample} units are still to be judged; so far {seen}"
        return LotVerdict("not decided", reason, good, bad, open_, waiting, declared)
    if bad + open_ <= plan.accept:
        reason = f"{seen}, which is not more than Ac {plan.accept}"
        if open_:
            reason = f"{seen} and {open_} undecided: not more than Ac {plan.accept} even if those deviate"
        return LotVerdict("accepted", reason, good, bad, open_, waiting, declared)
    reason = (
        f"{seen}, and {open_} undecided: whether there are more than Ac {plan.accept} cannot be said; "
        f"judge them again with --retest"
    )
    return LotVerdict("not decided", reason, good, bad, open_, waiting, declared)
