"""Guards for ranges and lengths, shared by all services of CiA 301 v4.2.0 and CiA 305 v3.0."""

from conformance.wire.errors import WireError
from conformance.wire.notation import hex_bytes


def check_range(what: str, value: int, low: int, high: int) -> None:
    """Raise WireError unless `low <= value <= high`."""
    if not low <= value <= high:
        raise WireError(f"{what}: expected {low:X}h to {high:X}h, got {_signed_hex(value)}")


def check_length(what: str, data: bytes, *lengths: int) -> None:
    """Raise WireError unless `data` has one of the `lengths` (bytes)."""
    if len(data) not in lengths:
        expected = " or ".join(map(str, lengths))
        raise WireError(
            f"{what}: expected {expected} bytes, got {len(data)} ({hex_bytes(data)})",
        )


def _signed_hex(value: int) -> str:
    return f"{'-' if value < 0 else ''}{abs(value):X}h"
