"""How far a period may be off.

Neither the manuals nor CiA 301 give a tolerance. These are the suite's own, wide enough for the
timer tick of a small controller and a frame that waits for the bus, and narrow enough to show a
timer that is ten per cent slow.
"""

from __future__ import annotations

from conformance.spec.model import DeviceSpec

_MEAN = 0.05
_GAP = 0.05
_TICK_MS = 2.0


def gap_tolerance_ms(period_ms: float) -> float:
    """Return how far one interval may be from the period: 5 % and 2 ms."""
    return period_ms * _GAP + _TICK_MS


def mean_tolerance_ms(period_ms: float) -> float:
    """Return how far the mean of many intervals may be from the period: 5 %."""
    return period_ms * _MEAN


# What is measured. None of the manuals gives an accuracy; these are wide enough for any sensor of
# its kind and the angle at which it is mounted on the bench, and narrow enough to show a wrong
# sign, scale or axis.

STEPS = 2
"""Steps by which a measured value may move between two looks at it, and one for its rounding."""

_TILT_DEG = 0.5
TEMPERATURE_K = 3.0
"""A sensor for the temperature of its own board; its self-heating cancels out in a difference."""

GRAVITY_G = 0.1
"""Zero-g offset and scale of an uncalibrated acceleration sensor."""

_SUPPLY = 0.05
_DIODE_V = 1.0
_FROM_THE_END_V = 0.1
"""How far inside its documented range a device is supplied, beside what the bench may be off."""


def tilt_tolerance_deg(step_deg: float) -> float:
    """Return how far a change of a slope may be from that of the tilt: 0.5 deg and 2 steps."""
    return _TILT_DEG + STEPS * step_deg


def supply_tolerance_v(volt: float) -> float:
    """Return how far a supply voltage may be shown wrong: 5 % and the drop of a diode."""
    return volt * _SUPPLY + _DIODE_V


def allowed_supply_v(spec: DeviceSpec, volt: float, off_v: float) -> float:
    """Return the voltage nearest to some voltage with which a device may be supplied.

    Args:
        spec: The device's.
        volt: In volts.
        off_v: By how much the bench may be off.
    """
    supply = spec.services.supply
    if supply is None:
        return volt
    off_v += _FROM_THE_END_V
    return min(max(volt, supply.min_v + off_v), supply.max_v - off_v)
