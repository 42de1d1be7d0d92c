"""Numbers as users write them on the command line, and as they read them."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Final

from conformance.errors import SpecError

MOST_NODE_ID: Final = 127


def node_ids(option: str, text: str) -> list[int]:
    """Return the node-IDs of ``1-64`` or ``1,5,9-12``.

    Args:
        option: To name in the error.
        text: What the user wrote.

    Raises:
        SpecError: It is none, or one is there twice.
    """
    numbers: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"\s*(\d{1,3})(?:\s*-\s*(\d{1,3}))?\s*", part)
        first, last = (int(found[1]), int(found[2] or found[1])) if found else (0, 0)
        if not 1 <= first <= last <= MOST_NODE_ID:
            raise SpecError(
                f"{option}: expected node-IDs from 1 to 127 as 1-64 or 1,5, got {text!r}"
            )
        numbers += range(first, last + 1)
    if len(set(numbers)) < len(numbers):
        raise SpecError(f"{option}: expected each node-ID once, got {text!r}")
    return numbers


def figure(value: float, digits: int) -> str:
    """Return a number with so many digits that count, more before the point if it has them, and no exponent."""
    if abs(value) >= 10**digits:
        return f"{value:.0f}"
    return format(Decimal(f"{value:.{digits}g}"), "f")
