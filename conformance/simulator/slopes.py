"""Slopes and their offsets: resolution, operating parameter, preset, zeroing (CiA 410)."""

from __future__ import annotations

from functools import partial
from typing import Final

from conformance.simulator.live import LiveValues, clipped, physical_deg
from conformance.simulator.node import Node
from conformance.simulator.rejection import SdoAbortError
from conformance.spec.behaviours import Slope as SlopeSpec
from conformance.spec.behaviours import Zeroing
from conformance.spec.fields import key_of, of_variant
from conformance.spec.model import DeviceSpec, Entry, Key
from conformance.wire.abort import AbortCode
from conformance.wire.datatypes import Value

TURN_DEG: Final = 360.0


class Slope:
    """One slope; its value becomes the measured angle with the offsets.

    Args:
        node: The node.
        live: The measured values.
        spec: What the manual says of it.
        variant: Of the device.
    """

    def __init__(self, node: Node, live: LiveValues, spec: SlopeSpec, variant: str) -> None:
        self._spec = spec
        low, high = of_variant(spec.covers, variant) or (0.0, 0.0)
        turns = high - low >= TURN_DEG and not node.faults.live_counts_turns
        self._turn_from_deg = float(low) if turns else None
        self._ignores = frozenset(node.faults.slope_ignores)
        self._reversed = node.faults.resolution_reversed
        self._preset_reads = node.faults.preset_reads
        self._dictionary = node.dictionary
        self._live = live
        self._value = node.dictionary.entries[key_of(spec.value)]
        self._preset = self._entry(spec.preset)
        self._offset = self._entry(spec.offset)
        self._differential = self._entry(spec.differential_offset)
        self._resolution = self._entry(spec.resolution)
        self._hidden_deg = 0.0
        self._unit_before = self._unit_deg(self._value)
        self._steps_before = self._steps()
        live.slopes[self._value.key] = self._counts
        if self._value.scale is not None and self._value.ranges is not None:
            live.units[self._value.key] = self._documented_bits
        if self._preset is not None:
            node.dictionary.guards[self._preset.key].append(self._check_preset)
            node.dictionary.actions[self._preset.key] = self._preset_written

    def show(self, value_deg: float) -> None:
        """Set the offset so that the slope shows an angle now."""
        sign = -1 if self._spec.offset_is == "subtracted" else 1
        sum_deg = -value_deg if self._inverted("sum") else value_deg
        offset_deg = sign * (sum_deg - self._subtracted_deg())
        if self._offset is None:
            self._hidden_deg = offset_deg
            return
        unit = self._unit_deg(self._offset)
        self._dictionary.set(self._offset.key, clipped(self._offset, offset_deg / unit))

    @property
    def resolution(self) -> Key | None:
        """The object that holds the resolution."""
        return None if self._resolution is None else self._resolution.key

    def _entry(self, address: int | str | None) -> Entry | None:
        return None if address is None else self._dictionary.entries[key_of(address)]

    def _unit_deg(self, entry: Entry) -> float:
        """Return the angle of one bit of an entry in deg."""
        if self._resolution is None:
            return physical_deg(entry, 1)
        steps = self._dictionary.number(*self._resolution.key)
        if self._reversed:
            return physical_deg(self._resolution, 1) * self._default_steps**2 / (steps or 1)
        return physical_deg(self._resolution, steps or 1)

    @property
    def _default_steps(self) -> int:
        assert self._resolution is not None  # else nobody asks
        default = self._resolution.default_value
        return default if isinstance(default, int) else 0

    def _deg(self, entry: Entry | None) -> float:
        if entry is None:
            return 0.0
        return self._dictionary.number(*entry.key) * self._unit_deg(entry)

    def _is_set(self, bit: int | None) -> bool:
        parameter = self._spec.operating_parameter
        if bit is None or parameter is None:
            return False
        return bool(self._dictionary.number(*key_of(parameter)) >> bit & 1)

    @property
    def _scaled(self) -> bool:
        if "scaling" in self._ignores:
            return True
        return self._spec.scaling is None or self._is_set(self._spec.scaling)

    def _counts(self, tilt_deg: float) -> float:
        """Return the slope in bits of its value, not yet rounded."""
        angle = self._measured_deg(tilt_deg)
        if self._scaled or self._spec.unscaled == "with-offsets":
            sign = -1 if self._spec.offset_is == "subtracted" else 1
            angle += sign * (self._deg(self._offset) + self._hidden_deg)
            if "differential-offset" not in self._ignores:
                angle += self._deg(self._differential)
        return (-angle if self._inverted("sum") else angle) / self._shown_unit_deg

    def _measured_deg(self, tilt_deg: float) -> float:
        """Return what is measured, over a whole turn within the documented one."""
        angle = -tilt_deg if self._inverted("measured") else tilt_deg
        if self._turn_from_deg is None:
            return angle
        return self._turn_from_deg + (angle - self._turn_from_deg) % TURN_DEG

    @property
    def _shown_unit_deg(self) -> float:
        """Return the angle of one bit of the slope in deg."""
        if self._spec.unscaled == "own-steps" and not self._scaled and self._resolution is not None:
            return physical_deg(self._resolution, self._default_steps)
        return self._unit_deg(self._value)

    def _documented_bits(self) -> float:
        return self._shown_unit_deg / physical_deg(self._value, 1)

    def _inverted(self, what: str) -> bool:
        if "inversion" in self._ignores:
            return False
        return self._spec.inverts == what and self._is_set(self._spec.inversion)

    def _subtracted_deg(self) -> float:
        """Return what a preset subtracts."""
        follows = self._value.follows
        measured = 0.0 if follows is None else self._measured_deg(self._live.tilt_deg(follows))
        if self._spec.preset_subtracts == "measured" or "preset-differential" in self._ignores:
            return measured
        return measured + self._deg(self._differential)

    def _check_preset(self, _value: Value) -> None:
        if self._spec.preset_unscaled == "refused" and not self._scaled:
            raise SdoAbortError(AbortCode.DEVICE_STATE)

    def _preset_written(self, value: Value) -> None:
        assert self._preset is not None  # else nobody calls
        if "preset" not in self._ignores:
            self.show(int(value) * self._unit_deg(self._preset))
        reads = value if self._spec.preset_reads == "preset" else 0
        if self._preset_reads is not None:
            reads = self._preset_reads
        self._dictionary.set(self._preset.key, reads)

    def rescaled(self) -> dict[Key, int]:
        """Return what a new resolution makes of preset, offset and differential offset."""
        before, now = self._unit_before, self._unit_deg(self._value)
        same = self._steps_before == self._steps()
        self._unit_before, self._steps_before = now, self._steps()
        change = self._spec.resolution_change
        if "resolution-change" in self._ignores:
            return {}
        whole = [it for it in (self._preset, self._offset, self._differential) if it is not None]
        if change == "keeps-angles" and before != now:
            number = self._dictionary.number
            return {it.key: clipped(it, number(*it.key) * before / now) for it in whole}
        if same or not change.startswith("deletes"):
            return {}
        return {it.key: 0 for it in whole if change == "deletes-all" or it is self._offset}

    def _steps(self) -> Value | None:
        """Return the resolution written, in force or not."""
        return None if self._resolution is None else self._dictionary.value(self._resolution.key)


def follow_slopes(node: Node, live: LiveValues, spec: DeviceSpec) -> None:
    """Let the slopes of a spec be computed, and its zeroing commands act on them."""
    rules = spec.behaviours
    slopes = {
        name: Slope(node, live, rule, spec.variant)
        for name, rule in rules.items()
        if isinstance(rule, SlopeSpec)
    }
    resolutions = {slope.resolution: None for slope in slopes.values()}
    for key in resolutions:
        if key is not None:
            affected = [slope for slope in slopes.values() if slope.resolution == key]
            node.dictionary.observers[key].append(partial(_rescale, node, affected))
    for rule in rules.values():
        if isinstance(rule, Zeroing):
            zeroed = {bit: slopes[it] for bit, it in rule.slopes.items() if it in slopes}
            node.dictionary.actions[key_of(rule.command)] = partial(_zero, node, zeroed)


def _rescale(node: Node, slopes: list[Slope], _value: Value) -> None:
    """Follow a new resolution; the widest last, lest a twin of fewer bits cuts them off."""
    numbers = {key: number for slope in slopes for key, number in slope.rescaled().items()}
    entries = node.dictionary.entries
    for key in sorted(numbers, key=lambda key: entries[key].type.bits or 0):
        node.dictionary.set(key, numbers[key])


def _zero(node: Node, slopes: dict[int, Slope], value: Value) -> None:
    if node.faults.zero_command_ignored:
        return
    for bit, slope in slopes.items():
        if int(value) >> bit & 1 or node.faults.zeroes_all_axes:
            slope.show(0.0)
