"""Waiting until the node's filters have followed a tilt."""

from __future__ import annotations

from typing import Final

from conformance.bench.node.node import Node
from conformance.spec.behaviours import LowPassFilter
from conformance.spec.fields import key_of
from conformance.spec.model import Entry

LOOK_S: Final = 0.1
"""Between two looks at a value that may still be following."""

CALM_S: Final = 0.3
"""So long without a change, or half of the response time, is the end."""

MOST_S: Final = 20.0
"""A value that moves for longer will not come to rest: it is noise, or a defect."""

STEPS: Final = 1
"""A value at rest may go to and fro between two steps."""

_HERTZ: Final = {"Hz": 1.0, "mHz": 1e-3}


class Settling:
    """The filters of a node.

    Args:
        node: The node under test.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        rules = node.spec.behaviours.values()
        self._rules = [rule for rule in rules if isinstance(rule, LowPassFilter)]
        filtered = [key_of(rule.value) for rule in self._rules]
        self._keys = filtered or [it.key for it in node.spec.entries.values() if _is_tilt(it)]

    def wait(self) -> None:
        """Wait for the response time, where one is documented, and until the values are at rest.

        A node that does not answer SDO requests in its present state is not waited for.
        """
        before = self._look()
        if not before:
            return
        link, response_s = self._node.link, self._response_s()
        link.listen(response_s, lambda _: False)
        changed_s = link.now()
        deadline = changed_s + MOST_S
        while link.now() - changed_s < max(CALM_S, response_s / 2) and link.now() < deadline:
            link.listen(LOOK_S, lambda _: False)
            seen = self._look()
            if seen is None:
                return
            if any(abs(a - b) > STEPS for a, b in zip(before, seen, strict=True)):
                before, changed_s = seen, link.now()

    def _look(self) -> list[int] | None:
        values = []
        for key in self._keys:
            transfer = self._node.sdo.upload(*key)
            if not transfer.answered:
                return None
            values.append(int.from_bytes((transfer.data or b"")[:4], "little"))
        return values

    def _response_s(self) -> float:
        """Return the documented response time of the slowest filter, with what the node holds."""
        return max(map(self._response_of, self._rules), default=0.0)

    def _response_of(self, rule: LowPassFilter) -> float:
        entry = None if rule.cut_off is None else self._node.spec.entries[key_of(rule.cut_off)]
        if entry is None or rule.kinds.get(self._node.number(*key_of(rule.selector))) == "off":
            return 0.0
        frequency_hz = hertz(entry, self._node.number(*entry.key))
        return min(1 / frequency_hz, MOST_S) if frequency_hz else 0.0


def _is_tilt(entry: Entry) -> bool:
    """Tell whether an entry shows a tilt in whole steps; a filter that nobody documents may delay it."""
    return entry.follows in ("tilt-x", "tilt-y") and entry.readable and entry.type.is_integer


def hertz(entry: Entry, value: int) -> float:
    """Return the frequency that a value of an entry stands for."""
    return value * (entry.scale or 1.0) * _HERTZ.get(entry.unit or "", 1.0)
