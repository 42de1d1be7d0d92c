"""Timers of a sans-IO node: who wants to be woken when, in integer nanoseconds."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count


class Timer:
    """One timer; it calls ``fire`` with the time it was due at and is then stopped."""

    __slots__ = ("_agenda", "_fire", "_ticket", "due_ns")

    def __init__(self, agenda: Agenda, fire: Callable[[int], None]) -> None:
        self._agenda = agenda
        self._fire = fire
        self._ticket = 0
        self.due_ns: int | None = None

    def start(self, due_ns: int) -> None:
        """Start the timer, or move it when it runs."""
        self.due_ns = due_ns
        self._ticket = self._agenda.enter(due_ns, self)

    def stop(self) -> None:
        """Stop the timer."""
        self.due_ns = None

    def holds(self, ticket: int) -> bool:
        """Return whether ``ticket`` is the entry that counts, not one overtaken since."""
        return self.due_ns is not None and self._ticket == ticket

    def fire(self, due_ns: int) -> None:
        """Call back; the callback may start the timer again."""
        self.due_ns = None
        self._fire(due_ns)


class Agenda:
    """The timers of one node, earliest first; equal times in the order of starting."""

    def __init__(self) -> None:
        self.now_ns = 0
        self._entries: list[tuple[int, int, Timer]] = []
        self._tickets = count(1)

    def timer(self, fire: Callable[[int], None]) -> Timer:
        """Return a new timer, not running."""
        return Timer(self, fire)

    def after(self, delay_ns: int, act: Callable[[], None]) -> None:
        """Call ``act`` once, ``delay_ns`` from now."""
        self.timer(lambda _due_ns: act()).start(self.now_ns + delay_ns)

    def enter(self, due_ns: int, timer: Timer) -> int:
        """Enter a timer; return the ticket of this entry."""
        ticket = next(self._tickets)
        heapq.heappush(self._entries, (due_ns, ticket, timer))
        return ticket

    @property
    def deadline_ns(self) -> int | None:
        """When the next timer is due, None when none runs."""
        entries = self._entries
        while entries:
            due_ns, ticket, timer = entries[0]
            if timer.holds(ticket):
                return due_ns
            heapq.heappop(entries)
        return None

    def run(self, now_ns: int) -> None:
        """Fire every timer due up to ``now_ns``, each seeing its own due time as the present."""
        entries = self._entries
        while entries and entries[0][0] <= now_ns:
            due_ns, ticket, timer = heapq.heappop(entries)
            if timer.holds(ticket):
                self.now_ns = due_ns
                timer.fire(due_ns)
        self.now_ns = now_ns

    def clear(self) -> None:
        """Forget every timer, as a reset does."""
        for _, _, timer in self._entries:
            timer.stop()
        self._entries.clear()
