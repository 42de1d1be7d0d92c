"""A bench file's channel and bit rate, where the user gives others for one run."""

from __future__ import annotations

from typing import Any, Final

from conformance.bench.definition import BenchDefinition
from conformance.errors import SpecError

BIT_RATES: Final = range(5_000, 1_000_001)
"""What CAN controllers of the classical frame format carry, in bit/s."""


def overridden(
    definition: BenchDefinition, channel: str | int | None = None, bitrate: int | None = None
) -> BenchDefinition:
    """Return a bench with another channel or bit rate; its own where none is given.

    Args:
        definition: The bench.
        channel: As text, or the number that interfaces want which count their channels.
        bitrate: In bit/s.

    Raises:
        SpecError: No bus has such a bit rate, or the bench has no channel.
    """
    changes: dict[str, Any] = {}
    if channel is not None:
        if definition.simulated:
            raise SpecError(f"--channel: expected a bench with an adapter, got {definition.what!r}")
        is_number = isinstance(channel, str) and channel.isascii() and channel.isdecimal()
        changes["channel"] = int(channel) if is_number else channel
    if bitrate is not None:
        if bitrate not in BIT_RATES:
            raise SpecError(
                f"--bitrate: expected {BIT_RATES[0]} to {BIT_RATES[-1]} bit/s, got {bitrate}"
            )
        changes["bitrate"] = bitrate
    return definition.model_copy(update=changes)
