"""One simulated bus for all objects of a channel in a process, guarded by one lock."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

from conformance.simulator.bus import SimulatedBus

PATIENCE_S: Final = 5e-3
"""How long other threads have for a reaction before idle time is skipped."""

IDLE_NS: Final = 1_000_000
"""Idle time shorter than this is skipped without waiting, as between SDO request and answer."""


class SharedBus:
    """A simulated bus, its clock, and the lock that guards both.

    Attributes:
        bus: The bus; to be touched with ``lock`` held.
        lock: Guards the bus.
        changed: Signal that something happened on the bus.
        crowded: Several threads use the bus.
        real_time: Simulated time follows the clock of the computer.
    """

    def __init__(self, bus: SimulatedBus, *, real_time: bool) -> None:
        self.bus = bus
        self.real_time = real_time
        self.lock = threading.RLock()
        self.changed = threading.Condition(self.lock)
        self.crowded = False
        self.users = 0
        self._waiting = 0
        self._threads: set[int] = set()
        self._epoch_ns = time.monotonic_ns()

    def catch_up(self) -> None:
        """Let simulated time pass up to the present, on the real clock."""
        if self.real_time:
            self.bus.run_until(time.monotonic_ns() - self._epoch_ns)

    def wake_others(self) -> None:
        """Wake the threads that wait for a frame."""
        if self._waiting:
            self.changed.notify_all()

    def wait(self, timeout_s: float | None) -> bool:
        """Wait until another thread has changed something; return False after the timeout."""
        self._waiting += 1
        try:
            return self.changed.wait(timeout_s)
        finally:
            self._waiting -= 1

    def note_user(self) -> None:
        """Note that this thread uses the bus."""
        self._threads.add(threading.get_ident())
        self.crowded = len(self._threads) > 1

    def others_busy(self, until_ns: int | None) -> bool:
        """Return whether another thread did something while this one was about to skip idle time.

        On the virtual clock time would run ahead of threads that are about to send or to wait for
        a frame. So a longer idle stretch is only skipped when no other thread has done anything
        for a moment.

        Args:
            until_ns: Simulated time at which the idle stretch ends, None when it does not.
        """
        if until_ns is None or until_ns - self.bus.now_ns < IDLE_NS:
            return False
        return self.wait(PATIENCE_S)


_buses: Final[dict[str, SharedBus]] = {}
_lock: Final = threading.Lock()


def join(channel: str, build: Callable[[], SharedBus]) -> SharedBus:
    """Return the bus of a channel, built when nobody has it yet."""
    with _lock:
        shared = _buses.get(channel)
        if shared is None:
            shared = _buses[channel] = build()
        shared.users += 1
    return shared


def leave(channel: str, shared: SharedBus) -> None:
    """Give a bus back; the last one ends it."""
    with _lock:
        shared.users -= 1
        if not shared.users:
            del _buses[channel]
