"""A person declares a unit nonconforming that no run can decide, as nothing answers."""

from __future__ import annotations

from datetime import datetime

from conformance.errors import SpecError
from conformance.lots.inspection import Declared, Inspection, Unit


def asked_for(unit: int | None, by: str, reason: str, *, alone: bool) -> int | None:
    """Return the unit to declare nonconforming, None if none is.

    Args:
        unit: As asked for.
        by: Who declares it.
        reason: Why.
        alone: Nothing else is asked for.

    Raises:
        SpecError: A part is missing, or there is too much.
    """
    if unit is None:
        if by or reason:
            raise SpecError("--by, --reason: expected --nonconforming UNIT with them, got none")
        return None
    if not by.strip() or not reason.strip():
        raise SpecError(
            "--nonconforming: expected --reason TEXT and --by NAME with it, for the record says "
            "who declared the unit nonconforming and why"
        )
    if not alone:
        raise SpecError("--nonconforming: expected it without --retest and --dry-run, got one")
    return unit


def declare(inspection: Inspection, number: int, by: str, reason: str, now: datetime) -> Unit:
    """Note that a person says that a unit does not conform; its runs stay.

    Args:
        inspection: Of its lot.
        number: The unit, by serial number or place.
        by: Who says so.
        reason: Why.
        now: When, UTC.

    Raises:
        SpecError: It was not drawn, or a run has decided it.
    """
    unit = next((it for it in inspection.units if it.unit == number), None)
    if unit is None:
        raise SpecError(f"--nonconforming: expected a unit that was drawn, got {number}")
    if unit.verdict not in (None, "undecided"):
        how = "by declaration" if unit.declared_so else "by its run"
        raise SpecError(
            f"--nonconforming: expected a unit that no run has decided, "
            f"got {number}, which is {unit.verdict} {how}"
        )
    made = Declared(
        by=by.strip(),
        reason=reason.strip(),
        when=now.isoformat(timespec="seconds"),
        after=len(unit.tries),
    )
    unit.declared.append(made)
    return unit
