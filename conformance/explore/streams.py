"""Frames that two devices send by themselves, paired in time: what one sends, the other sends too."""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from conformance.wire.frame import Frame

Name: TypeAlias = tuple[int, bool, bool]
"""Identifier, 29 bits, remote: frames with one name come in an order."""


@dataclass(frozen=True, slots=True)
class Heard:
    """A frame of a device.

    Args:
        frame: The frame.
        time_s: In seconds since both devices were started.
        step: Number of the step during which it came.
    """

    frame: Frame
    time_s: float
    step: int


@dataclass(frozen=True, slots=True)
class Unlike:
    """Frames that do not go together, None where one of them is missing."""

    model: Heard | None
    device: Heard | None


Same: TypeAlias = Callable[[Heard, Heard], bool]
"""Tells whether what the model sent allows what the device sent."""


class Streams:
    """The frames of a model and of a device that have no counterpart yet.

    Args:
        tolerance_s: How far apart in time two frames may be that go together.
        same: What contents go together.
    """

    def __init__(self, tolerance_s: float, same: Same) -> None:
        self._tolerance_s = tolerance_s
        self._same = same
        self._model: defaultdict[Name, deque[Heard]] = defaultdict(deque)
        self._device: defaultdict[Name, deque[Heard]] = defaultdict(deque)

    def forget(self) -> None:
        """Drop what has no counterpart, as when both start anew."""
        self._model.clear()
        self._device.clear()

    def of_model(self, heard: Heard) -> None:
        """Add a frame of the model."""
        self._model[_name(heard.frame)].append(heard)

    def of_device(self, heard: Heard) -> None:
        """Add a frame of the device."""
        self._device[_name(heard.frame)].append(heard)

    def unlike(self, now_s: float) -> Iterator[Unlike]:
        """Take out the frames that go together, and return those that have no counterpart.

        Args:
            now_s: A counterpart that is not there by now may still come for frames that are younger
                than the tolerance.
        """
        for name in sorted({*self._model, *self._device}):
            yield from self._of_one(self._model[name], self._device[name], now_s)

    def _of_one(self, model: deque[Heard], device: deque[Heard], now_s: float) -> Iterator[Unlike]:
        while model or device:
            if model and device and self._together(model[0], device[0]):
                wanted, got = model.popleft(), device.popleft()
                if not self._same(wanted, got):
                    yield Unlike(wanted, got)
                continue
            first = min((it[0] for it in (model, device) if it), key=lambda heard: heard.time_s)
            if first.time_s >= now_s - self._tolerance_s:
                return
            if model and model[0] is first:
                yield Unlike(model.popleft(), None)
            else:
                yield Unlike(None, device.popleft())

    def _together(self, model: Heard, device: Heard) -> bool:
        return abs(model.time_s - device.time_s) <= self._tolerance_s


def _name(frame: Frame) -> Name:
    return frame.can_id, frame.extended, frame.remote
