"""What a slope shows, and how exactly that can be judged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from conformance.bench.node.sdo import Transfer
from conformance.bench.sensor.slope import Seen
from conformance.checks.limits import STEPS, tilt_tolerance_deg
from conformance.checks.profile.slopes import TURN_DEG, MeasuredSlope, Other
from conformance.verdict import Verdict


def is_same(before: Seen, turn: float, seen: Seen) -> bool:
    """Tell whether a slope shows what it did before, whole turns left out of account."""
    return distance(seen.value, before.value, turn) <= margin_of(seen, before)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a slope or an offset may show, and the readings by which it does.

    Args:
        steps: The value.
        others: The readings, none for what is judged first.
    """

    steps: float
    others: tuple[Other | None, ...] = ()


def judge(
    verdict: Verdict,
    quantity: str,
    seen: Seen,
    outcomes: Sequence[Outcome],
    *,
    before: Seen | None = None,
    turn_steps: float = 0.0,
) -> None:
    """Judge that a value is one of several, as exactly as it was seen to be steady.

    Args:
        verdict: The check's verdict.
        quantity: What was seen.
        seen: The value.
        outcomes: What it may be.
        before: The value from which the outcomes were calculated.
        turn_steps: Steps of a whole turn, by which it may be off; 0 for none.
    """
    margin = margin_of(seen, before)
    fitting = [it for it in outcomes if distance(seen.value, it.steps, turn_steps) <= margin]
    values = dict.fromkeys(f"{it.steps:g}" for it in outcomes)
    verdict.holds(
        quantity,
        expected=f"{' or '.join(values)} ± {margin}",
        actual=str(seen.value),
        ok=bool(fitting),
    )
    if fitting and len({it.steps for it in outcomes}) > 1:
        for other in fitting[0].others:
            if other is not None:
                verdict.follows(other.ambiguity, other.reading)


def margin_of(seen: Seen, before: Seen | None = None) -> int:
    """Return how exact a comparison of two values can be, in steps."""
    return STEPS + seen.spread + (before.spread if before is not None else 0)


def distance(value: float, wanted: float, turn_steps: float) -> float:
    """Return how far two values are apart, whole turns left out of account."""
    apart = abs(value - wanted)
    return min(apart % turn_steps, -apart % turn_steps) if turn_steps else apart


def within_a_turn(slope: MeasuredSlope, value_deg: float, near_deg: float) -> float:
    """Return an angle without the whole turns that a slope may show more or less."""
    if not slope.turn:
        return value_deg
    return math.remainder(value_deg - near_deg, TURN_DEG) + near_deg


def judge_angle(
    verdict: Verdict,
    what: str,
    slope: MeasuredSlope,
    shown_deg: float,
    tilt_deg: float,
    step_deg: float,
    doubt_deg: float,
) -> None:
    """Judge that a slope shows the angle of a tilt, or one a whole turn from it where it may."""
    verdict.within(
        what,
        [within_a_turn(slope, shown_deg, tilt_deg)],
        tilt_deg,
        tilt_tolerance_deg(step_deg),
        unit="deg",
        doubt=doubt_deg,
    )


def told_apart(margins: Sequence[float], doubt: float) -> bool:
    """Tell whether a bench that may be off by so much knows if a value is inside any of its limits.

    Args:
        margins: How far it is inside each, negative where it is not.
        doubt: By how much the bench may have put it off.
    """
    return not doubt or abs(max(margins)) > doubt


def turn_steps(slope: MeasuredSlope, step_deg: float) -> float:
    """Return the steps of a turn where a slope may show one more or less, else 0."""
    return TURN_DEG / step_deg if slope.turn else 0.0


def confirmed(verdict: Verdict, what: str, transfer: Transfer) -> None:
    """Judge that a download was confirmed."""
    verdict.holds(what, expected="confirmed", actual=str(transfer), ok=transfer.confirmed)
