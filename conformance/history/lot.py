"""A lot as the history has it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Lot:
    """A delivery that is inspected.

    Args:
        name: Its own, by which it is found.
        part: What was ordered.
        order: With which order.
        size: Units in it.
        plan: How it is sampled, in words.
        verdict: What became of it, empty while nobody knows.
        decided: When, in ISO 8601; empty until then.
    """

    name: str
    part: str = ""
    order: str = ""
    size: int = 0
    plan: str = ""
    verdict: str = ""
    decided: str = ""
