"""Expected against actual: what a check measures, and the deviation it raises."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, TypeVar

T = TypeVar("T")
VerdictWord: TypeAlias = Literal["pass", "fail", "inconclusive", "skipped", "not_applicable"]


@dataclass(frozen=True, slots=True)
class Measurement:
    """One comparison, in words fit for a report."""

    quantity: str
    expected: str
    actual: str
    unit: str
    ok: bool


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


class EmptyCheckError(Exception):
    """A check ended without having compared anything: a defect of the suite."""


@dataclass(slots=True)
class Verdict:
    """Collects the measurements of one check; a failed one does not stop the check."""

    measurements: list[Measurement] = field(default_factory=list)
    readings: dict[str, int] = field(default_factory=dict)
    trace: tuple[int, int] | None = None

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

    def holds(self, quantity: str, *, expected: str, actual: str, ok: bool) -> bool:
        """Judge what has no single figure; the words say what was expected and what came."""
        return self._add(quantity, expected, actual, "", ok=ok)

    def within(
        self,
        quantity: str,
        actual: Sequence[float],
        nominal: float,
        tolerance: float,
        *,
        unit: str,
    ) -> bool:
        """Judge that each of some figures is within a tolerance of the nominal one."""
        expected = f"{nominal:g} {unit} ± {tolerance:g} {unit}"
        if not actual:
            return self._add(quantity, expected, "none seen", unit, ok=False)
        worst = max(range(len(actual)), key=lambda n: abs(actual[n] - nominal))
        of = f" (worst of {len(actual)}, no. {worst + 1})" if len(actual) > 1 else ""
        return self._add(
            quantity,
            expected,
            f"{actual[worst]:.4g} {unit}{of}",
            unit,
            ok=abs(actual[worst] - nominal) <= tolerance,
        )

    def at_least(self, quantity: str, actual: float, limit: float, *, unit: str) -> bool:
        """Judge that a figure is not below a limit."""
        return self._add(
            quantity, f"at least {limit:g} {unit}", f"{actual:.4g} {unit}", unit, ok=actual >= limit
        )

    def at_most(self, quantity: str, actual: float, limit: float, *, unit: str) -> bool:
        """Judge that a figure is not above a limit."""
        return self._add(
            quantity, f"at most {limit:g} {unit}", f"{actual:.4g} {unit}", unit, ok=actual <= limit
        )

    def follows(self, ambiguity: str, reading: int) -> None:
        """Note which reading of an ambiguous place the device follows."""
        self.readings[ambiguity] = reading

    def shown_in(self, first: int, last: int) -> None:
        """Note the lines of the trace that show what is judged, where an earlier item saw it."""
        self.trace = first, last

    def conclude(self) -> None:
        """End the check.

        Raises:
            Nonconformity: A measurement failed.
            EmptyCheckError: Nothing was measured.
        """
        if not self.measurements:
            raise EmptyCheckError("the check compared nothing")
        failed = [m for m in self.measurements if not m.ok]
        if failed:
            raise Nonconformity(failed)

    def _add(self, quantity: str, expected: str, actual: str, unit: str, *, ok: bool) -> bool:
        self.measurements.append(Measurement(quantity, expected, actual, unit, ok))
        return ok
