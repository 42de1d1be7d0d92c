"""What was observed once in a run and is judged by several items: stores wear the memory out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from conformance.bench.bus.link import Link
from conformance.errors import ConformanceError

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Seen(Generic[T]):
    """One observation.

    Args:
        outcome: What was seen.
        first: First line of the trace that shows it.
        last: Its last line.
        late_ms: By how much times in it may be off.
    """

    outcome: T
    first: int
    last: int
    late_ms: float


class Observations:
    """The observations of a run by name; whichever item comes first makes one.

    Args:
        link: The link, for the place in the trace.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._seen: dict[str, Seen[object] | ConformanceError] = {}

    def forget(self) -> None:
        """Observe everything anew from now on."""
        self._seen.clear()

    def once(self, name: str, kind: type[T], observe: Callable[[], T]) -> Seen[T]:
        """Return what was observed under a name, observed now if it was not before.

        Raises:
            ConformanceError: What kept it from being observed, to every item alike.
        """
        if name not in self._seen:
            first = self._link.line + 1
            try:
                outcome = observe()
                late_ms = self._link.uncertainty_ms()
                self._seen[name] = Seen(outcome, first, self._link.line, late_ms)
            except ConformanceError as error:
                self._seen[name] = error
        seen = self._seen[name]
        if isinstance(seen, ConformanceError):
            raise seen
        held = seen.outcome
        if not isinstance(held, kind):
            raise TypeError(f"{name} is no {kind.__name__}")
        return Seen(held, seen.first, seen.last, seen.late_ms)
