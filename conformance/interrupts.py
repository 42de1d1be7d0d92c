"""Ctrl-C and SIGTERM end a run, but not in the middle of what gives the device back as it was."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


@dataclass(slots=True)
class _State:
    sections: int = 0
    waiting: bool = False


_state = _State()


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Put an interrupt off to the end of a section; a second one comes through at once.

    Raises:
        KeyboardInterrupt: At the end, if there was an interrupt.
    """
    _state.sections += 1
    try:
        yield
    finally:
        _state.sections -= 1
        if _state.waiting and not _state.sections:
            _state.waiting = False
            raise KeyboardInterrupt


@contextmanager
def interruptible() -> Iterator[None]:
    """Take SIGINT and SIGTERM for Ctrl-C, as `uninterrupted` has it, where signals can be set."""
    previous = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in previous:
        signal.signal(number, _interrupt)
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    if _state.sections and not _state.waiting:
        _state.waiting = True
        return
    _state.waiting = False
    raise KeyboardInterrupt
