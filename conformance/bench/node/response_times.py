"""How long the node takes to answer SDO requests, over a whole run."""

from __future__ import annotations

from collections import Counter
from math import ceil, floor, log10
from typing import Any

from conformance.spec.model import Key, address

_CONTINUES = (0x00, 0x60, 0xA0, 0xC0)
"""Client command specifiers of requests within a transfer (CiA 301 v4.2.0, 7.2.4.3)."""
_SHARE = 0.99
_PER_DECADE = 20
"""Steps of the histogram from a time to ten times as long."""
_SHORTEST_MS = 0.001


class ResponseTimes:
    """The longest wait for a response in each SDO transfer, as the bench sees it.

    The time runs from the request handed to the bus to the timestamp of its response, so that it
    holds both frames.
    """

    def __init__(self) -> None:
        self._transfers: list[tuple[float, Key]] = []
        self._begun: Key | None = None
        self._waiting_since_s: float | None = None

    def sent(self, request: bytes, time_s: float) -> None:
        """Take note of a request."""
        self._waiting_since_s = time_s
        if _begins(request):
            self._begun = int.from_bytes(request[1:3], "little"), request[3]
            self._transfers.append((-1.0, self._begun))
        elif not request or request[0] & 0xE0 not in _CONTINUES:
            self._begun = None

    def received(self, time_s: float) -> None:
        """Take note of the first response to the last request."""
        if self._begun is None or self._waiting_since_s is None:
            return
        waited_s = max(0.0, time_s - self._waiting_since_s)
        self._waiting_since_s = None
        self._transfers[-1] = max(self._transfers[-1], (waited_s, self._begun))

    def summary(self) -> dict[str, Any]:
        """Return how many transfers were answered, and how fast; nothing but 0 without any.

        ``histogram`` has the upper limit of each step in ms, and how many transfers are in it.
        """
        answered = sorted(it for it in self._transfers if it[0] >= 0)
        if not answered:
            return {"transfers": 0}
        times_ms = [round(time_s * 1000, 3) for time_s, _ in answered]
        return {
            "transfers": len(answered),
            "median_ms": times_ms[(len(answered) - 1) // 2],
            "p99_ms": times_ms[ceil(_SHARE * len(answered)) - 1],
            "max_ms": times_ms[-1],
            "max_object": address(*answered[-1][1]),
            "histogram": _histogram(times_ms),
        }


def _histogram(times_ms: list[float]) -> list[tuple[float, int]]:
    """Return how many times are in each step, by its upper limit, from the first to the last."""
    steps = Counter(floor(log10(max(it, _SHORTEST_MS)) * _PER_DECADE) for it in times_ms)
    return [
        (float(f"{10 ** ((step + 1) / _PER_DECADE):.4g}"), steps[step])
        for step in range(min(steps), max(steps) + 1)
    ]


def _begins(request: bytes) -> bool:
    """Tell whether a request names an object: the first of an upload or download, block or not."""
    if len(request) < 4:
        return False
    command = request[0]
    return command & 0xE0 in (0x20, 0x40) or command & 0xE3 == 0xA0 or command & 0xE1 == 0xC0
