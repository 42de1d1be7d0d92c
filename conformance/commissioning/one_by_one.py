"""One sensor after the other, connected by the operator, for those that nothing tells apart on the bus."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from conformance.bench.session import Bench
from conformance.commissioning.giving import identity_of
from conformance.errors import BenchError
from conformance.report.console import console

TRIES: Final = 3
"""So often the operator is asked for one sensor before the bench counts as broken."""


def connected(bench: Bench, *, alone: bool) -> Iterator[list[int]]:
    """Ask for sensors until there are no more, and return the identity of each.

    Args:
        bench: The open bench; its home is where sensors fresh from the box are.
        alone: Those done before must be off the bus: they speak at another bit rate.

    Raises:
        BenchError: None of three tries brought a sensor.
        SetupRefused: The operator does not answer.
    """
    others = "and no other" if alone else "and no other that is fresh from the box"
    nth, tries = 1, TRIES
    while bench.operator.connect(nth, f"{others} (it is expected as {bench.reach.home})"):
        bench.reach.go(bench.reach.home)
        try:
            bench.find_node()
        except BenchError as error:
            tries -= 1
            if not tries:
                raise
            console.error(str(error))
            continue
        yield identity_of(bench.node())
        nth, tries = nth + 1, TRIES
