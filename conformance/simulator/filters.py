"""Low-pass filters of measured angles: how far they lag behind turns of the sensor."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Final, Literal, TypeAlias

from conformance.simulator.live import LiveValues, World
from conformance.simulator.node import Node
from conformance.spec.behaviours import LowPassFilter
from conformance.spec.document import Follows
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec

Kind: TypeAlias = Literal["critically-damped", "butterworth"]
Lag: TypeAlias = Callable[[float], float]

SLOWEST_HZ: Final = 2.0
"""Cut-off frequency of the slowest filter of a device that names none; of the next ones twice that."""

_S: Final = 1e9
_HZ: Final = {"mHz": 1e-3}


class Filter:
    """The filter of one axis.

    Args:
        node: The node.
        world: Where the sensor is turned.
        rule: What the manual says of it.
        axis: What it filters.
    """

    def __init__(self, node: Node, world: World, rule: LowPassFilter, axis: Follows) -> None:
        self._node = node
        self._world = world
        self._rule = rule
        self._axis = axis

    def lag_deg(self) -> float:
        """Return by how much the angle is ahead of what comes out of the filter."""
        lag = self._lag()
        if lag is None:
            return 0.0
        now_ns = self._node.agenda.now_ns
        return math.fsum(
            turn.deg(self._axis) * lag((now_ns - turn.at_ns) / _S) for turn in self._world.turns
        )

    def _lag(self) -> Lag | None:
        """Return what is left of a step of 1 after some seconds; None without a filter."""
        fusion = self._rule.fusion
        fused = fusion is not None and self._number(fusion.object) == fusion.value
        if fused and not self._node.faults.fusion_lags:
            return None
        chosen = self._number(self._rule.selector)
        kind = self._rule.kinds.get(chosen, "any")
        if kind == "off":
            return None
        known: Kind = "butterworth" if kind == "butterworth" else "critically-damped"
        hertz = self._node.faults.filter_cut_off_hz or self._hertz(chosen)
        return step_left(self._node.faults.filter_kind or known, self._rule.order, hertz)

    def _hertz(self, chosen: int) -> float:
        if self._rule.cut_off is None:
            places = self._rule.slowest_first
            places = places[::-1] if self._node.faults.filter_order_reversed else places
            return SLOWEST_HZ * 2.0 ** (places.index(chosen) if chosen in places else 0)
        entry = self._node.dictionary.entries[key_of(self._rule.cut_off)]
        steps = max(self._number(self._rule.cut_off), 1)
        return steps * (entry.scale or 1.0) * _HZ.get(entry.unit or "", 1.0)

    def _number(self, address: int | str) -> int:
        if self._node.faults.filter_acts_unsaved:
            value = self._node.dictionary.value(key_of(address))
            return value if isinstance(value, int) else 0
        return self._node.dictionary.number(*key_of(address))


def follow_filters(node: Node, live: LiveValues, world: World, spec: DeviceSpec) -> None:
    """Let the angles of a spec pass their filters."""
    for rule in spec.behaviours.values():
        if isinstance(rule, LowPassFilter):
            axis = node.dictionary.entries[key_of(rule.value)].follows
            if axis is not None:
                live.lags[axis] = Filter(node, world, rule, axis).lag_deg


@lru_cache(maxsize=32)
def step_left(kind: Kind, order: int, hertz: float) -> Lag:
    """Return what a filter has left of a step of 1, as a function of the seconds since.

    Args:
        kind: Of the filter.
        order: 1 or more.
        hertz: Where it lets through half of the power.
    """
    corner = 2 * math.pi * hertz
    if kind == "critically-damped":
        return partial(_critically_damped, corner / math.sqrt(2 ** (1 / order) - 1), order)
    poles = [
        corner * cmath.exp(1j * math.pi * (2 * nth + order + 1) / (2 * order))
        for nth in range(order)
    ]
    weights = []
    for pole in poles:
        others = math.prod((pole - it for it in poles if it is not pole), start=1 + 0j)
        weights.append(corner**order / (pole * others))
    return partial(_sum_of_modes, tuple(zip(weights, poles, strict=True)))


def _critically_damped(rate: float, order: int, seconds: float) -> float:
    """All poles in one place: what is left is the start of the exponential series."""
    passed = rate * seconds
    term = total = math.exp(-passed)
    for nth in range(1, order):
        term *= passed / nth
        total += term
    return total


def _sum_of_modes(modes: tuple[tuple[complex, complex], ...], seconds: float) -> float:
    """Poles apart: each has a mode of its own."""
    return -sum((weight * cmath.exp(pole * seconds)).real for weight, pole in modes)
