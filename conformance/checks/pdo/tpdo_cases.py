"""Which TPDOs a rule on their transmission applies to, and what the manual's readings say of them.

CiA 301 v4.2.0, 7.5.2.37.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.checks.pdo.tpdos import (
    ASYNCHRONOUS,
    EVENT_TIMER_SUB,
    SYNCHRONOUS,
    TYPE_SUB,
    allows,
    event_time_ms,
    tpdos,
)
from conformance.errors import SetupRefused
from conformance.requirements import Case
from conformance.spec.document import Tpdo
from conformance.spec.model import DeviceSpec, Entry, OtherServices, address
from conformance.verdict import Verdict

Readings = Mapping[str, OtherServices | None]
"""What a manual says of a TPDO, in words, each with the reading by which it says so."""


class Numbered(NamedTuple):
    """A TPDO and one figure to try."""

    number: int
    figure: int


def parameter(spec: DeviceSpec, number: int, sub: int) -> Entry | None:
    """Return a communication parameter of a TPDO."""
    tpdo = spec.services.tpdo
    return None if tpdo is None else spec.entry(tpdo.communication + number - 1, sub)


def parameter_of(node: Node, number: int, sub: int) -> Entry:
    """Return a communication parameter of a TPDO.

    Raises:
        SetupRefused: The manual documents none.
    """
    entry = parameter(node.spec, number, sub)
    if entry is None:
        raise SetupRefused(f"the manual documents no {address(0x1800 + number - 1, sub)}")
    return entry


def is_free(entry: Entry | None) -> bool:
    """Tell whether every reading lets an entry be written."""
    return entry is not None and all(
        reading.writable and not reading.optional for reading in entry.readings
    )


def asynchronous_type(spec: DeviceSpec, number: int) -> int | None:
    """Return a type with which the event timer sends the TPDO."""
    return next((n for n in ASYNCHRONOUS if allows(spec, number, n)), None)


def timed(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs that are sent by an event timer that can be set."""
    for case in tpdos(spec):
        timer = parameter(spec, case.subject, EVENT_TIMER_SUB)
        able = asynchronous_type(spec, case.subject) is not None
        if able and is_free(timer) and event_time_ms(spec, case.subject, 1) is not None:
            yield case


def synchronous(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs that can be sent after every SYNC."""
    if spec.services.sync_consumer is not None:
        for case in tpdos(spec):
            if allows(spec, case.subject, SYNCHRONOUS[0]):
                yield case


def first_synchronous(spec: DeviceSpec) -> Iterable[Case]:
    """Return one TPDO that can be sent after every SYNC, for rules on SYNC itself."""
    yield from list(synchronous(spec))[:1]


def typed(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs whose transmission type can be written."""
    for case in tpdos(spec):
        if is_free(parameter(spec, case.subject, TYPE_SUB)):
            yield case


def documents(tpdo: Tpdo, transmission_type: int) -> bool:
    """Tell whether a manual lists a transmission type."""
    return any(int(low) <= transmission_type <= int(high) for low, high in tpdo.transmission_types)


def type_readings(spec: DeviceSpec, transmission_type: int) -> Readings:
    """Return what the readings make of a download of a transmission type."""

    def says(tpdo: Tpdo) -> str:
        return "accepted" if documents(tpdo, transmission_type) else tpdo.other_types

    return readings_of(spec, says)


def outcome_of(answer: Transfer) -> str:
    """Return what the node made of a download, in the words of a spec."""
    return "refused" if answer.refused else "accepted" if answer.confirmed else str(answer)


def readings_of(spec: DeviceSpec, says: Callable[[Tpdo], str]) -> Readings:
    """Return what the readings say of TPDOs; where several say the same, the judged one counts."""
    return {
        says(services.tpdo): other
        for services, other in spec.services_readings[::-1]
        if services.tpdo is not None
    }


def judge_reading(
    verdict: Verdict, quantity: str, readings: Readings, actual: str, late_ms: float = 0.0
) -> None:
    """Judge that the node does what a reading says, and note which one.

    Args:
        verdict: Of the check.
        quantity: What it is.
        readings: By what the node does.
        actual: What it did.
        late_ms: By how much times may be off, where that alone leaves it open; else 0.
    """
    expected, ok = " or ".join(sorted(readings)), actual in readings
    verdict.holds(quantity, expected=expected, actual=actual, ok=ok, late_ms=late_ms)
    followed = None if late_ms else readings.get(actual)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)
