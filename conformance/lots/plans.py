"""The sampling plan of one lot: how many units are drawn, and how many of them may be nonconforming."""

from __future__ import annotations

from dataclasses import dataclass

from conformance.lots.tables import Level, Severity, tables


@dataclass(frozen=True, slots=True)
class Plan:
    """A single sampling plan.

    Args:
        sample: Units to draw; all of the lot where the plan's sample is no smaller.
        accept: The lot is accepted with so many nonconforming units in the sample (Ac).
        size: Units of the lot.
        words: How the plan was found.
        letter: Code letter of the lot size; empty where all units are inspected because that was asked for.
        accept_tighter: Ac of the same sample with the AQL one step tighter; None where there is none.
    """

    sample: int
    accept: int
    size: int
    words: str
    letter: str = ""
    accept_tighter: int | None = None

    @property
    def reject(self) -> int:
        """The lot is not accepted with so many nonconforming units (Re)."""
        return self.accept + 1

    @property
    def whole(self) -> bool:
        """Every unit of the lot is inspected."""
        return self.sample == self.size


def whole_lot(size: int) -> Plan:
    """Return the plan that inspects every unit and accepts no nonconforming one."""
    return Plan(size, 0, size, "100 % inspection, as the lot file asks for")


def plan_of(size: int, level: Level, aql: float, severity: Severity) -> Plan:
    """Return the plan of ISO 2859-1 for a lot.

    Args:
        size: Units of the lot, at least two.
        level: Of inspection.
        aql: One of the table's, in percent nonconforming.
        severity: Of inspection.

    Source: ISO 2859-1:1999, 10.1 to 10.3, tables 1 and 2-A to 2-C.
    """
    known = tables()
    master, column = known.masters[severity], known.aqls.index(aql)
    letter = known.letter(size, level)
    found, accept = master.plan(letter, column)
    wanted = master.sizes[found]
    words = (
        f"level {level}, AQL {aql:g}, {severity} inspection: code letter {letter}, "
        f"table {master.name}"
    )
    if found != letter:
        words += f", whose arrow leads to {found}"
    words += f": {wanted} units, Ac {accept}, Re {accept + 1}"
    if wanted >= size:
        words += f"; the lot has {size}: 100 % inspection"
    tighter = master.accepted_at(found, column - 1) if column else None
    return Plan(min(wanted, size), accept, size, words, letter, tighter)
