"""The lights of a node: the patterns that its manual knows, and which of them an operator sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from conformance.bench.surroundings.operator import Operator
from conformance.spec.model import DeviceSpec
from conformance.spec.services import STEADY, Leds, LightCondition


@dataclass(frozen=True, slots=True)
class Pattern:
    """What a light shows.

    Args:
        name: As the manual calls it.
        times_ms: How long it is lit and dark in turn, in ms; empty for steadily on or off.
    """

    name: str
    times_ms: tuple[int, ...] = ()

    def __str__(self) -> str:
        if self.name in STEADY:
            return f"steadily {self.name}"
        words = [f"{ms} ms {'off' if nth % 2 else 'on'}" for nth, ms in enumerate(self.times_ms)]
        return ": ".join((self.name, *([", ".join(words)] if words else [])))


ELSE: Final = Pattern("something else")
"""None of the patterns that the manual knows."""


def pattern_of(leds: Leds, condition: LightCondition, light: str) -> Pattern | None:
    """Return the pattern that a light shows under a condition; None where the manual has none."""
    name = leds.shows.get(condition, {}).get(light)
    return None if name is None else Pattern(name, tuple(leds.patterns.get(name, ())))


class LightsPort:
    """The lights of a node.

    Args:
        spec: What the node is held against.
        operator: Who looks at them.
    """

    def __init__(self, spec: DeviceSpec, operator: Operator) -> None:
        self._operator = operator
        self._patterns = {str(it): it for it in _known(spec)}
        self._choices = {words: it.times_ms for words, it in self._patterns.items() if it.times_ms}

    def seen(self, light: str) -> Pattern:
        """Return the pattern that a light shows now.

        Raises:
            SetupRefused: The operator does not say.
        """
        words = self._operator.look_at(light, self._choices)
        return ELSE if words is None else self._patterns[words]


def _known(spec: DeviceSpec) -> list[Pattern]:
    """Return steadily off and on, and the patterns of every reading of the manual."""
    found = [Pattern(name) for name in STEADY]
    for services, _ in spec.services_readings:
        if services.leds is not None:
            found += [Pattern(name, tuple(ms)) for name, ms in services.leds.patterns.items()]
    return list(dict.fromkeys(found))
