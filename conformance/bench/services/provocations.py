"""The errors that a bench can bring about: angles beyond their limits, and destroyed frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from conformance.spec.document import EmcyProducer
from conformance.spec.fields import of_variant
from conformance.spec.model import DeviceSpec

MARGIN_DEG = 1.0
"""How far from a limit the node is tilted, more than bench and node are off."""

_TURN_DEG = 360.0


@dataclass(frozen=True, slots=True)
class Provocation:
    """An error that tilting brings about.

    Args:
        axis: What is tilted.
        code: The emergency error code it has.
        bit: Its bit of the manufacturer's code, if any.
        limit_deg: The greatest, or least, angle without it.
        side: On which side of the limit it is.
        source: Section of the manual.
    """

    axis: Literal["tilt-x", "tilt-y"]
    code: int
    bit: int | None
    limit_deg: float
    side: Literal["above", "below"]
    source: str

    def beyond_deg(self, tolerance_deg: float) -> float:
        """Return an angle that is the error for sure, on a bench that is so exact."""
        margin_deg = MARGIN_DEG + tolerance_deg
        return self.limit_deg + (margin_deg if self.side == "above" else -margin_deg)

    @property
    def within_deg(self) -> float:
        """An angle near the limit that is no error for sure."""
        return self.limit_deg - (MARGIN_DEG if self.side == "above" else -MARGIN_DEG)


@dataclass(frozen=True, slots=True)
class BusProvocation:
    """An error that destroyed frames bring about: the CAN controller becomes error passive.

    Args:
        code: The emergency error code it has.
    """

    code: int
    axis: Literal["bus"] = "bus"


AnyProvocation = Provocation | BusProvocation


def provocations(spec: DeviceSpec, producer: EmcyProducer | None) -> list[Provocation]:
    """Return the errors that tilting brings about, by what the manual says of a producer.

    Those above a limit come first, one per cause, then those below.
    """
    found = []
    for cause in producer.causes if producer is not None else ():
        limits = of_variant(cause.limits, spec.variant)
        if limits is None and cause.limits is None:
            limits = _shown(spec, cause.cause)
        if limits is not None:
            given = (cause.cause, cause.code, cause.bit)
            found += [
                Provocation(*given, limits[1], "above", cause.source),
                Provocation(*given, limits[0], "below", cause.source),
            ]
    return sorted(found, key=lambda error: error.side)


def _shown(spec: DeviceSpec, axis: str) -> list[float] | None:
    """Return the angles that the objects of an axis can show; None for a whole turn."""
    shown = [
        (low * scale, high * scale)
        for entry in spec.entries.values()
        if entry.follows == axis and entry.unit == "deg" and entry.ranges
        for scale in (entry.scale or 1.0,)
        for low, high in entry.ranges
    ]
    narrow = [(low, high) for low, high in shown if high - low < _TURN_DEG - 1]
    return list(narrow[0]) if narrow else None
