"""The lights of a simulated device: which pattern a light shows, and whether it is lit now (CiA 303-3)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import accumulate
from typing import Final

from conformance.simulator.faults import Faults
from conformance.spec.services import Leds, LightCondition

_MS: Final = 1_000_000


def is_lit(
    leds: Leds | None,
    faults: Faults,
    light: str,
    holding: Collection[LightCondition],
    now_ns: int,
) -> bool:
    """Tell whether a light is lit.

    Args:
        leds: The lights; None of a device without any.
        faults: Defects to show.
        light: Its name.
        holding: The conditions that hold now.
        now_ns: The time.
    """
    shown = "off"
    for condition, lights in leds.shows.items() if leds is not None else ():
        if condition in holding:
            shown = lights.get(light, shown)
            shown = faults.lights_show.get(condition, {}).get(light, shown)
    times_ms = leds.patterns.get(shown) if leds is not None else None
    return shown == "on" if times_ms is None else _within(times_ms, now_ns)


def _within(times_ms: Sequence[int], now_ns: int) -> bool:
    """Tell whether a moment is in one of the times lit, which are the first, the third and so on."""
    ends_ns = [end_ms * _MS for end_ms in accumulate(times_ms)]
    passed = sum(now_ns % ends_ns[-1] >= end_ns for end_ns in ends_ns)
    return passed % 2 == 0
