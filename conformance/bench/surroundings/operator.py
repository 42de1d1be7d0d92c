"""Who answers what only eyes can see: a person at the terminal, or the simulated one who watches the rig."""

from __future__ import annotations

import math
import sys
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from itertools import pairwise
from queue import Empty, SimpleQueue
from typing import Final, TextIO

from conformance.bench.bus.link import Link
from conformance.bench.definition import BenchDefinition, Exposed
from conformance.bench.surroundings.rig import Surroundings
from conformance.errors import SetupRefused

ANSWER_S: Final = 90.0
"""How long a person has for an answer; a check that hangs is ended later than that."""

WARMING_S: Final = 1000.0
"""How long a person has to bring the device to a temperature."""

REACTION_S: Final = 0.2
"""How long after a change the simulated operator begins to look."""

GLANCE_S: Final = 0.01
"""How often the simulated operator looks, less than the shortest time that an eye resolves."""

LIKENESS: Final = 0.25
"""How far a time may be off, as a share of it, for the simulated operator to take it for that time."""

MIDDLE_V: Final = 20.0
"""A supply voltage near the middle of what is usual."""

ON: Final = "steadily on"
OFF: Final = "steadily off"
_PAUSE_S: Final = 0.05

Choices = Mapping[str, Sequence[int]]
"""Patterns in words, beside steadily on and off: the times lit and dark in turn, in ms."""


class Operator(ABC):
    """Looks at the device."""

    @abstractmethod
    def look_at(self, light: str, choices: Choices) -> str | None:
        """Return what a light shows, in words of the choices; None when it is none of them.

        Raises:
            SetupRefused: There is no answer.
        """

    @abstractmethod
    def is_on_label(self, number: int) -> bool:
        """Tell whether a number is the serial number on the device's label.

        Raises:
            SetupRefused: There is no answer.
        """

    @abstractmethod
    def switch_supply(self, *, on: bool) -> None:
        """Switch the supply of the device, and return once that is done.

        Raises:
            SetupRefused: There is no answer.
        """

    @abstractmethod
    def connect(self, nth: int, what: str, /) -> bool:
        """Connect one more device to the bus; tell whether there was one.

        Args:
            nth: Which, from 1 on.
            what: What it is to be, and what else may be connected.

        Raises:
            SetupRefused: There is no answer.
        """

    @abstractmethod
    def tilt(self, x_deg: float, y_deg: float, tolerance_deg: float) -> None:
        """Tilt the device about its axes, and return once it is at rest.

        Args:
            x_deg: About the X axis, in degrees.
            y_deg: About the Y axis, in degrees.
            tolerance_deg: By how much either may be off.

        Raises:
            SetupRefused: There is no answer.
        """

    @abstractmethod
    def expose(self, quantity: Exposed, value: float | None, tolerance: float) -> None:
        """Bring the device to a temperature or a supply voltage, and return once it is there.

        Args:
            quantity: Which.
            value: In degrees Celsius or volts; None for what it usually is.
            tolerance: By how much it may be off, in kelvins or volts.

        Raises:
            SetupRefused: There is no answer.
        """


class TerminalOperator(Operator):
    """A person who answers by a number; the bus goes on being heard meanwhile.

    Args:
        link: The link to the bus.
        answers: Where the answers come from.
        questions: Where the questions go.
    """

    def __init__(self, link: Link, answers: TextIO, questions: TextIO) -> None:
        self._link = link
        self._answers = answers
        self._questions = questions
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)

    def look_at(self, light: str, choices: Choices) -> str | None:
        """Ask for the number of what the light shows."""
        known = [ON, OFF, *choices]
        words = [*known, "something else"]
        chosen = self._choose(f"Which of these does the {light} light show?", words)
        return known[chosen] if chosen < len(known) else None

    def is_on_label(self, number: int) -> bool:
        """Ask for yes or no."""
        question = f"Is {number} ({number:X}h) the serial number on the label of the device?"
        return self._choose(question, ("yes", "no")) == 0

    def switch_supply(self, *, on: bool) -> None:
        """Ask for the switch."""
        self._have_done(f"Switch the supply of the sensor {'ON' if on else 'OFF'}")

    def connect(self, nth: int, what: str, /) -> bool:
        """Ask for a device, or for the word that there is no other."""
        answer = self._answer(f"Connect sensor {nth}, {what}, then press Enter (q: no more): ")
        return answer.strip().lower() != "q"

    def tilt(self, x_deg: float, y_deg: float, tolerance_deg: float) -> None:
        """Ask for a tilt."""
        angles = [
            f"{deg:+g} deg about the {axis} axis"
            for axis, deg in zip("XY", (x_deg, y_deg), strict=True)
            if deg
        ]
        what = f"Tilt the sensor to {' and '.join(angles)}" if angles else "Level the sensor"
        alone = ", keep the other axis level" if len(angles) == 1 else ""
        self._have_done(f"{what} (within {tolerance_deg:g} deg){alone}, and leave it at rest")

    def expose(self, quantity: Exposed, value: float | None, tolerance: float) -> None:
        """Ask for a supply voltage, or for a temperature, which takes its time."""
        if quantity == "supply":
            to = f"{value:g} V (within {tolerance:g} V)" if value is not None else "what is usual"
            self._have_done(f"Set the supply of the sensor to {to}")
            return
        to = f"{value:g} degC (within {tolerance:g} K)" if value is not None else "room temperature"
        self._have_done(f"Bring the sensor to {to}, and wait until all of it has that", WARMING_S)

    def _have_done(self, what: str, answer_s: float | None = None) -> None:
        """Ask for something, and wait for Enter."""
        self._answer(f"{what}, then press Enter: ", answer_s)

    def _answer(self, prompt: str, answer_s: float | None = None) -> str:
        """Ask once and return the line that comes."""
        self._forget()
        self._questions.write(prompt)
        self._questions.flush()
        return self._line(time.monotonic() + (ANSWER_S if answer_s is None else answer_s))

    def _forget(self) -> None:
        """Forget what came too late for the question before."""
        while not self._lines.empty():
            self._lines.get()

    def _choose(self, question: str, words: Sequence[str]) -> int:
        """Return the place of the answer among some words."""
        lines = [f"  {number}  {each}" for number, each in enumerate(words, 1)]
        self._forget()
        prompt = "\n".join([question, *lines, "Number: "])
        deadline_s = time.monotonic() + ANSWER_S
        while True:
            self._questions.write(prompt)
            self._questions.flush()
            answer = self._line(deadline_s).strip()
            if answer.isascii() and answer.isdecimal() and 1 <= int(answer) <= len(words):
                return int(answer) - 1
            prompt = f"Number, 1 to {len(words)}: "

    def _line(self, deadline_s: float) -> str:
        """Return the next line; the bus is heard until it is there."""
        if not self._reader.is_alive():
            self._reader = threading.Thread(target=self._read, daemon=True)
            self._reader.start()
        while time.monotonic() < deadline_s:
            self._link.drain()
            try:
                line = self._lines.get(timeout=_PAUSE_S)
            except Empty:
                continue
            if line:
                return line
            break
        raise SetupRefused("the operator did not answer")

    def _read(self) -> None:
        self._lines.put(self._answers.readline())


class SimulatedOperator(Operator):
    """Watches a simulated light until its pattern is clear, and reads the simulated label.

    Args:
        link: The link to the bus, which is heard meanwhile.
        rig: The simulated device's surroundings.
    """

    def __init__(self, link: Link, rig: Surroundings) -> None:
        self._link = link
        self._rig = rig

    def look_at(self, light: str, choices: Choices) -> str | None:
        """Look at the light again and again, and compare."""
        self._link.listen(REACTION_S, lambda _: False)
        phases_ms = [time_ms for times_ms in choices.values() for time_ms in times_ms]
        most_s = 1.5 * max(phases_ms, default=1000) / 1000
        changes = self._changes(light, most_s, 1 + 2 * max(map(len, choices.values()), default=0))
        if not changes:
            return ON if self._rig.lit(light) else OFF
        times_ms = [(lit, 1000 * (end - start)) for (start, lit), (end, _) in pairwise(changes)]
        found = (words for words, pattern in choices.items() if _is_like(times_ms, pattern))
        return next(found, None)

    def is_on_label(self, number: int) -> bool:
        """Read the label of the simulated device."""
        return self._rig.label() == str(number)

    def switch_supply(self, *, on: bool) -> None:
        """Switch the supply of the simulated device."""
        self._link.listen(REACTION_S, lambda _: False)
        (self._rig.power_on if on else self._rig.power_off)()

    def connect(self, nth: int, _what: str, /) -> bool:
        """Supply one more of the simulated devices."""
        self._link.listen(REACTION_S, lambda _: False)
        return self._rig.connect(nth)

    def tilt(self, x_deg: float, y_deg: float, tolerance_deg: float) -> None:
        """Tilt the simulated device, in steps, and as far off as is allowed."""
        self._link.listen(REACTION_S, lambda _: False)
        off_deg = tolerance_deg if (x_deg, y_deg) != (0.0, 0.0) else 0.0
        self._rig.set_tilt(x_deg + off_deg, y_deg + off_deg)

    def expose(self, quantity: Exposed, value: float | None, tolerance: float) -> None:
        """Expose the simulated device, as far off as is allowed, away from the middle."""
        self._link.listen(REACTION_S, lambda _: False)
        if value is None:
            self._rig.at_rest()
        elif quantity == "temperature":
            self._rig.set_temperature(value + math.copysign(tolerance, value))
        else:
            self._rig.set_supply_voltage(value + math.copysign(tolerance, value - MIDDLE_V))

    def _changes(self, light: str, most_s: float, count: int) -> list[tuple[float, bool]]:
        """Return when the light changes, and to what; until there are so many, or no more come."""
        lit, last_s = self._rig.lit(light), self._link.now()
        changes: list[tuple[float, bool]] = []
        while len(changes) < count and self._link.now() - last_s < most_s:
            self._link.listen(GLANCE_S, lambda _: False)
            if self._rig.lit(light) != lit:
                lit, last_s = not lit, self._link.now()
                changes.append((last_s, lit))
        return changes


def _is_like(seen: Sequence[tuple[bool, float]], pattern: Sequence[int]) -> bool:
    """Tell whether times are those of a pattern, from any place in it on."""
    return len(seen) >= len(pattern) and any(
        all(
            lit == ((first + nth) % 2 == 0)
            and _near(time_ms, pattern[(first + nth) % len(pattern)])
            for nth, (lit, time_ms) in enumerate(seen)
        )
        for first in range(len(pattern))
    )


def _near(time_ms: float, nominal_ms: float) -> bool:
    return abs(time_ms - nominal_ms) <= LIKENESS * nominal_ms


def operator_of(definition: BenchDefinition, link: Link) -> Operator:
    """Return who looks at the device.

    Raises:
        SetupRefused: The simulated operator has no simulated device to look at.
    """
    if definition.operator == "terminal":
        return TerminalOperator(link, sys.stdin, sys.stdout)
    if link.rig is None:
        raise SetupRefused("the simulated operator sees simulated devices only")
    return SimulatedOperator(link, link.rig)
