"""What a TPDO must carry: the values that mapped entries were seen to hold, and their octets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.errors import SetupRefused
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire.datatypes import Value
from conformance.wire.errors import WireError
from conformance.wire.pdo import unpack

SAMPLES = 5
NOISE = 2
"""Steps by which a measured value may move between two looks at it, for a REAL hundredths of it."""


@dataclass(frozen=True, slots=True)
class Held:
    """A mapped entry and between which values it was seen.

    Args:
        entry: An entry that holds a number.
        low: Least value a TPDO may carry.
        high: Greatest value a TPDO may carry.
    """

    entry: Entry
    low: float
    high: float

    @property
    def expected(self) -> str:
        """The values in words."""
        return f"{self.low}" if self.low == self.high else f"{self.low} to {self.high}"

    def decode(self, raw: int) -> float:
        """Return the field of a TPDO as a number of the entry's type."""
        size = self.entry.type.size or 0
        return _as_number(self.entry.type.decode(raw.to_bytes(size, "little")))


def held(node: Node, entry: Entry) -> Held:
    """Watch an entry; a measured value may move on by as much as it was seen to, and a little."""
    values = [_as_number(_read(node, entry)) for _ in range(SAMPLES)]
    low, high = min(values), max(values)
    step = 1 if entry.type.is_integer else max(abs(low), abs(high)) / 100
    margin = high - low + NOISE * step if entry.kind == "live" else 0
    return Held(entry, low - margin, high + margin)


def _read(node: Node, entry: Entry) -> Value:
    """Return what the node holds as a value of the entry's type, which may be that of a reading."""
    try:
        return entry.type.decode(node.upload(*entry.key))
    except WireError as error:
        raise SetupRefused(f"{entry.address}: {error}, see OD-03") from error


def judge_content(spec: DeviceSpec, verdict: Verdict, data: bytes, mapped: Sequence[Held]) -> None:
    """Judge that a TPDO has the length and the values of the mapped entries, in their order."""
    _judge_length(spec, len(data), octets_of(mapped), verdict)
    judge_values(verdict, data, mapped)


def octets_of(mapped: Sequence[Held]) -> int:
    """Return how many octets mapped entries take."""
    return (sum(field.entry.type.bits or 0 for field in mapped) + 7) // 8


def judge_values(verdict: Verdict, data: bytes, mapped: Sequence[Held]) -> None:
    """Judge that a TPDO that is long enough has the values of the mapped entries, in their order."""
    bits = [field.entry.type.bits or 0 for field in mapped]
    octets = octets_of(mapped)
    if len(data) < octets:
        return
    for field, raw in zip(mapped, unpack(data[:octets], bits), strict=True):
        value = field.decode(raw)
        verdict.holds(
            f"{field.entry.address} in the TPDO",
            expected=field.expected,
            actual=str(value),
            ok=field.low <= value <= field.high,
        )


def _judge_length(spec: DeviceSpec, octets: int, mapped: int, verdict: Verdict) -> None:
    readings = {
        (services.tpdo.octets or mapped) if services.tpdo else mapped: other
        for services, other in spec.services_readings[::-1]
    }
    expected = " or ".join(str(length) for length in sorted(readings))
    verdict.holds("octets", expected=expected, actual=str(octets), ok=octets in readings)
    followed = readings.get(octets)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)


def _as_number(value: Value) -> float:
    if not isinstance(value, int | float):
        raise SetupRefused(f"expected a number, got {value!r}")
    return value
