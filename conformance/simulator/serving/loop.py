"""The loop of a process of simulated devices: one thread, woken by time, by sockets and by signals."""

from __future__ import annotations

import gc
import selectors
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from conformance.simulator.rig import SimulatorRig
from conformance.simulator.segment import Segment

IDLE_S: Final = 60.0
"""Longest wait when nothing is due."""

_SECOND: Final = 1_000_000_000


class Loop(SimulatorRig):
    """Lets the devices of a segment live in real time.

    Args:
        segment: The devices, and what they are connected by.
    """

    def __init__(self, segment: Segment) -> None:
        self.segment = segment
        self._epoch_ns = time.monotonic_ns()
        self.epoch_s = time.time() - segment.now_ns / _SECOND
        self._selector = selectors.SelectSelector()  # the others wait in whole milliseconds
        self._ended = False

    @contextmanager
    def present(self) -> Iterator[Segment]:
        """Hold the segment, caught up with the clock."""
        self.segment.run_until(time.monotonic_ns() - self._epoch_ns)
        yield self.segment

    def watch(self, source: socket.socket | int, ready: Callable[[], None]) -> None:
        """Call something whenever there is something to read."""
        self._selector.register(source, selectors.EVENT_READ, ready)

    def forget(self, source: socket.socket | int) -> None:
        """Watch it no more."""
        self._selector.unregister(source)

    def end(self) -> None:
        """Leave `run` when what is being done is done."""
        self._ended = True

    def run(self) -> None:
        """Let the devices live until `end`; no look for garbage among all that they are keeps them waiting."""
        gc.collect()
        gc.freeze()
        while not self._ended:
            self.turn(IDLE_S)

    def turn(self, longest_s: float) -> None:
        """Let the devices live until something happens, or for so long."""
        with self.present() as segment:
            event_ns = segment.next_event_ns()
        wait_s = longest_s
        if event_ns is not None:
            due_ns = self._epoch_ns + event_ns
            wait_s = min(max(0.0, (due_ns - time.monotonic_ns()) / _SECOND), longest_s)
        for key, _ in self._selector.select(wait_s):
            key.data()


@contextmanager
def ended_by_signals(loop: Loop) -> Iterator[None]:
    """Let SIGTERM and SIGINT end a loop."""
    waker, woken = socket.socketpair()
    for end in (waker, woken):
        end.setblocking(False)

    def wake() -> None:
        woken.recv(64)
        loop.end()

    numbers = (signal.SIGTERM, signal.SIGINT)
    before = [(number, signal.signal(number, lambda *_: None)) for number in numbers]
    former = signal.set_wakeup_fd(waker.fileno())
    loop.watch(woken, wake)
    try:
        yield
    finally:
        loop.forget(woken)
        signal.set_wakeup_fd(former)
        for number, handler in before:
            signal.signal(number, handler)
        waker.close()
        woken.close()
