"""Expected against actual: what a check measures, and the deviation it raises."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, TypeVar

from conformance.numbers import figure

T = TypeVar("T")
VerdictWord: TypeAlias = Literal["pass", "fail", "inconclusive", "skipped", "not_applicable"]

_PER_MS = {"ms": 1.0, "s": 1e-3}
"""Units of time, and what a millisecond is in them."""


@dataclass(frozen=True, slots=True)
class Figures:
    """What was measured, as numbers in the measurement's unit.

    Args:
        values: In the order in which they came.
        least: They may not be below it; None without such a limit.
        most: They may not be above it; None without such a limit.
        nominal: What they should be; None where only a limit is documented.
    """

    values: tuple[float, ...]
    least: float | None = None
    most: float | None = None
    nominal: float | None = None


@dataclass(frozen=True, slots=True)
class Measurement:
    """One comparison, in words fit for a report; not resolved where the rig cannot tell.

    Args:
        quantity: What it is.
        expected: In words.
        actual: In words.
        unit: Of a figure.
        ok: It is as expected.
        resolved: The rig can tell.
        figures: The numbers, None without any.
        late_ms: By how much times may be off, where that alone leaves it open; else 0.
    """

    quantity: str
    expected: str
    actual: str
    unit: str
    ok: bool
    resolved: bool = True
    figures: Figures | None = None
    late_ms: float = 0.0


class Nonconformity(AssertionError):  # noqa: N818 - the word of the trade
    """The device deviates from the requirement.

    Args:
        measurements: The comparisons that failed, at least one.
    """

    def __init__(self, measurements: Sequence[Measurement]) -> None:
        self.measurements = tuple(measurements)
        super().__init__(
            "; ".join(f"{m.quantity}: expected {m.expected}, got {m.actual}" for m in measurements)
        )


class Unresolved(Exception):  # noqa: N818 - what the rig cannot tell is no error
    """What was measured is nearer to a limit than the rig's uncertainty.

    Args:
        measurements: The comparisons that are open, at least one.
    """

    def __init__(self, measurements: Sequence[Measurement]) -> None:
        self.measurements = tuple(measurements)
        m = self.measurements[0]
        super().__init__(
            f"{m.quantity}: {m.actual} against {m.expected}: nearer to the limit than this bench "
            "can tell"
        )

    @property
    def late_ms(self) -> float:
        """By how much times may be off, where that alone leaves all of them open; else 0."""
        late = [m.late_ms for m in self.measurements]
        return max(late) if all(late) else 0.0


class EmptyCheckError(Exception):
    """A check ended without having compared anything: a defect of the suite."""


@dataclass(slots=True)
class Verdict:
    """Collects the measurements of one check; a failed one does not stop the check.

    Args:
        uncertainty_ms: Returns how far a time may be off, in ms; times are judged with that in mind.
    """

    uncertainty_ms: Callable[[], float] = lambda: 0.0
    measurements: list[Measurement] = field(default_factory=list)
    readings: dict[str, int] = field(default_factory=dict)
    trace: tuple[int, int] | None = None
    shown_late_ms: float = 0.0

    def equal(
        self,
        quantity: str,
        actual: T,
        expected: T,
        *,
        unit: str = "",
        show: Callable[[T], str] = str,
    ) -> bool:
        """Judge that ``actual`` is ``expected``."""
        return self._add(quantity, show(expected), show(actual), unit, ok=actual == expected)

    def one_of(
        self,
        quantity: str,
        actual: T,
        expected: Collection[T],
        *,
        unit: str = "",
        show: Callable[[T], str] = str,
    ) -> bool:
        """Judge that ``actual`` is one of several values."""
        wanted = " or ".join(show(value) for value in expected)
        return self._add(quantity, wanted, show(actual), unit, ok=actual in expected)

    def holds(
        self,
        quantity: str,
        *,
        expected: str,
        actual: str,
        ok: bool,
        resolved: bool = True,
        late_ms: float = 0.0,
    ) -> bool:
        """Judge what has no single figure; the words say what was expected and what came.

        Args:
            quantity: What it is.
            expected: In words.
            actual: In words.
            ok: It is as expected.
            resolved: The bench can tell, but for how late times may be.
            late_ms: By how much times may be off, where that alone leaves it open; else 0.
        """
        resolved = resolved and not late_ms
        return self._add(quantity, expected, actual, "", ok=ok, resolved=resolved, late_ms=late_ms)

    def within(
        self,
        quantity: str,
        actual: Sequence[float],
        nominal: float,
        tolerance: float,
        *,
        unit: str,
        over: int = 1,
        doubt: float = 0.0,
    ) -> bool:
        """Judge that each of some figures is within a tolerance of the nominal one.

        Args:
            quantity: What it is.
            actual: The figures.
            nominal: What they should be.
            tolerance: How far they may be off.
            unit: Theirs.
            over: How many periods a figure is the mean of.
            doubt: By how much the bench may have put a figure off, beside its times.
        """
        expected = f"{figure(nominal, 6)} {unit} ± {figure(tolerance, 6)} {unit}"
        if not actual:
            return self._add(quantity, expected, "none seen", unit, ok=False)
        worst = max(range(len(actual)), key=lambda n: abs(actual[n] - nominal))
        of = f" (worst of {len(actual)}, no. {worst + 1})" if len(actual) > 1 else ""
        margin = tolerance - abs(actual[worst] - nominal)
        figures = Figures(tuple(actual), nominal - tolerance, nominal + tolerance, nominal)
        return self._measured(
            quantity, expected, actual[worst], of, margin, unit, figures, over, doubt
        )

    def at_least(
        self, quantity: str, actual: float, limit: float, *, unit: str, over: int = 1
    ) -> bool:
        """Judge that a figure, the mean of so many periods, is not below a limit."""
        expected = f"at least {figure(limit, 6)} {unit}"
        figures = Figures((actual,), least=limit)
        return self._measured(quantity, expected, actual, "", actual - limit, unit, figures, over)

    def at_most(
        self, quantity: str, actual: float, limit: float, *, unit: str, doubt: float = 0.0
    ) -> bool:
        """Judge that a figure, which the bench may have put off by so much, is not above a limit."""
        expected = f"at most {figure(limit, 6)} {unit}"
        figures = Figures((actual,), most=limit)
        margin = limit - actual
        return self._measured(quantity, expected, actual, "", margin, unit, figures, doubt=doubt)

    def follows(self, ambiguity: str, reading: int) -> None:
        """Note which reading of an ambiguous place the device follows."""
        self.readings[ambiguity] = reading

    def shown_in(self, first: int, last: int, late_ms: float) -> None:
        """Note the lines of the trace that show what is judged, where an earlier item may have seen it.

        Args:
            first: The first of them.
            last: The last of them.
            late_ms: By how much times in them may be off.
        """
        self.trace = first, last
        self.shown_late_ms = max(self.shown_late_ms, late_ms)

    def conclude(self) -> None:
        """End the check.

        Raises:
            Nonconformity: A measurement failed.
            Unresolved: None failed, but the rig cannot tell whether one did.
            EmptyCheckError: Nothing was measured.
        """
        if not self.measurements:
            raise EmptyCheckError("the check compared nothing")
        failed = [m for m in self.measurements if not m.ok and m.resolved]
        if failed:
            raise Nonconformity(failed)
        if unresolved := [m for m in self.measurements if not m.resolved]:
            raise Unresolved(unresolved)

    def _measured(
        self,
        quantity: str,
        expected: str,
        actual: float,
        of: str,
        margin: float,
        unit: str,
        figures: Figures,
        over: int = 1,
        doubt: float = 0.0,
    ) -> bool:
        """Judge a figure by how far inside its limits it is, negative where it is not."""
        late_ms = max(self.uncertainty_ms(), self.shown_late_ms)
        uncertainty = late_ms * _PER_MS.get(unit, 0.0) / over + doubt
        words = f" ± {figure(uncertainty, 2)} {unit}" if uncertainty else ""
        resolved = not uncertainty or abs(margin) > uncertainty
        open_anyway = doubt > 0 and abs(margin) <= doubt
        return self._add(
            quantity,
            expected,
            f"{figure(actual, 4)} {unit}{words}{of}",
            unit,
            ok=margin >= 0,
            resolved=resolved,
            figures=figures,
            late_ms=0.0 if resolved or open_anyway else late_ms,
        )

    def _add(
        self,
        quantity: str,
        expected: str,
        actual: str,
        unit: str,
        *,
        ok: bool,
        resolved: bool = True,
        figures: Figures | None = None,
        late_ms: float = 0.0,
    ) -> bool:
        self.measurements.append(
            Measurement(quantity, expected, actual, unit, ok, resolved, figures, late_ms)
        )
        return ok
