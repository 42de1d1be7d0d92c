"""One slope of the node: its value, its offsets and the settings that act on it (CiA 410)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.sensor.stimulus import Stimulus
from conformance.errors import SetupRefused
from conformance.spec.behaviours import Slope
from conformance.spec.fields import key_of
from conformance.spec.model import Entry, Key

SAMPLES: Final = 5
_DEG: Final = {"deg": 1.0, "mdeg": 1e-3, "rad": 180 / math.pi}


def degrees(entry: Entry) -> float | None:
    """Return the angle of one bit of an entry in deg; None where it is no angle."""
    unit = _DEG.get(entry.unit or "")
    return None if unit is None or entry.scale is None else entry.scale * unit


@dataclass(frozen=True, slots=True)
class Seen:
    """A measured value as several uploads have seen it.

    Args:
        value: The middle one, in steps.
        spread: From the least to the greatest.
    """

    value: int
    spread: int


def watch(node: Node, key: Key) -> Seen:
    """Upload a measured value several times."""
    values = sorted(node.number(*key) for _ in range(SAMPLES))
    return Seen(values[SAMPLES // 2], values[-1] - values[0])


class SlopePort:
    """A slope of a node.

    Args:
        node: The node under test.
        entry: The slope's value.
        rule: What the manual says of its offsets; None where there is nothing.
    """

    def __init__(self, node: Node, entry: Entry, rule: Slope | None) -> None:
        self._node = node
        self.entry = entry
        self.rule = rule

    def seen(self) -> Seen:
        """Return what the slope shows."""
        return watch(self._node, self.entry.key)

    @property
    def step_deg(self) -> float:
        """The angle of one bit, by the resolution that the node holds."""
        resolution = self.rule.resolution if self.rule else None
        if resolution is None:
            return degrees(self.entry) or 1.0
        key = key_of(resolution)
        unit = degrees(self._node.spec.entries[key])
        steps = self._node.number(*key)
        if not steps or unit is None:
            raise SetupRefused(f"a resolution of {steps} says nothing of the slope's unit")
        return steps * unit

    def tilt(self, stimulus: Stimulus, deg: float) -> None:
        """Tilt the slope's axis, and no other."""
        if self.entry.follows == "tilt-x":
            stimulus.tilt(deg, 0.0)
        else:
            stimulus.tilt(0.0, deg)

    def tilt_other(self, stimulus: Stimulus, deg: float) -> None:
        """Tilt the other axis, and not the slope's own."""
        if self.entry.follows == "tilt-x":
            stimulus.tilt(0.0, deg)
        else:
            stimulus.tilt(deg, 0.0)

    # Settings

    def invert(self, *, on: bool) -> None:
        """Set the inversion, where there is one."""
        self._set_bit(self.rule.inversion if self.rule else None, on=on)

    def scale(self, *, on: bool) -> None:
        """Set whether the offsets count, where that can be set."""
        self._set_bit(self.rule.scaling if self.rule else None, on=on)

    def _set_bit(self, bit: int | None, *, on: bool) -> None:
        if self.rule is None or bit is None or self.rule.operating_parameter is None:
            return
        key = key_of(self.rule.operating_parameter)
        before = self._node.number(*key)
        wanted = before | 1 << bit if on else before & ~(1 << bit)
        if wanted != before:
            self._node.download(*key, wanted)

    def count_upright(self) -> None:
        """Let the offsets count and take the inversion away."""
        self.scale(on=True)
        self.invert(on=False)

    def make_plain(self) -> None:
        """Do so, and take the differential offset away."""
        self.count_upright()
        if (
            self.rule is not None
            and self.rule.differential_offset is not None
            and self.differential
        ):
            self.shift(0)

    # Offsets

    def rule_of(self, attribute: str) -> int | str:
        """Return the address of an object that the slope's rule names.

        Raises:
            SetupRefused: It names none.
        """
        named: int | str | None = getattr(self.rule, attribute, None)
        if named is None:
            raise SetupRefused(f"the manual documents no {attribute} of {self.entry.address}")
        return named

    def seen_offset(self) -> Seen:
        """Return what the offset holds."""
        return watch(self._node, key_of(self.rule_of("offset")))

    @property
    def offset(self) -> int:
        """What the offset holds, in steps; 0 without one."""
        return self._number(self.rule.offset if self.rule else None)

    @property
    def differential(self) -> int:
        """What the differential offset holds, in steps; 0 without one."""
        return self._number(self.rule.differential_offset if self.rule else None)

    def _number(self, address: int | str | None) -> int:
        return 0 if address is None else self._node.number(*key_of(address))

    def shift(self, steps: int) -> None:
        """Write the differential offset."""
        self.set_up("differential_offset", steps)

    def set_up(self, attribute: str, steps: int) -> None:
        """Write an object that the slope's rule names."""
        self._node.download(*key_of(self.rule_of(attribute)), steps)

    def write(self, attribute: str, steps: int) -> Transfer:
        """Write an object that the slope's rule names; what becomes of it is to be judged."""
        key = key_of(self.rule_of(attribute))
        return self._node.try_download(*key, self._node.spec.entries[key].type.encode(steps))
