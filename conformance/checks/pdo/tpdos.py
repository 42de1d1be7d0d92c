"""TPDOs as several checks need them: which a device has, what makes them come, and their set-up.

CiA 301 v4.2.0, 7.2.2 and 7.5.2.37.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import Any

from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort, pace_entries
from conformance.bench.settings.in_force import InForce
from conformance.checks import cases
from conformance.checks.limits import gap_tolerance_ms
from conformance.checks.steps import COB_ID_SUB, tpdo_service
from conformance.checks.waiting import at_need, put_in_force
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases
from conformance.spec.model import DeviceSpec, Entry, address, is_legal
from conformance.verdict import Verdict
from conformance.wire import cob_id, sync
from conformance.wire.datatypes import DataType

EVENT_MS = 50
SYNC_MS = 20
FRAME_BITS = 135
"""A TPDO of eight octets, bit stuffing included."""
WINDOW_S = 0.5
LAST_S = 0.2
PERIODS_BEFORE = 4
NOT_VALID = 1 << 31
MOST_TRIED = 4
ASYNCHRONOUS = (254, 255)
SYNCHRONOUS = range(1, 241)
TYPE_SUB = 2
INHIBIT_SUB = 3
EVENT_TIMER_SUB = 5


@dataclass(frozen=True, slots=True)
class Pace:
    """What makes a TPDO come again and again.

    Args:
        transmission_type: An asynchronous one, or n for every n-th SYNC.
        event_ms: Event timer; 0 for a synchronous TPDO.
        sync_ms: From one SYNC to the next.
        sync_id: CAN-ID of SYNC.
    """

    transmission_type: int
    event_ms: int
    sync_ms: int
    sync_id: int = cob_id.SYNC

    @property
    def period_ms(self) -> int:
        """From one TPDO to the next."""
        return self.event_ms or self.transmission_type * self.sync_ms

    @property
    def window_s(self) -> float:
        """Time within which some TPDOs must have come."""
        return max(WINDOW_S, 4 * self.period_ms / 1000)


def pace_of(spec: DeviceSpec, number: int) -> Pace | None:
    """Return what makes a TPDO come, its event timer or SYNC; None where the manual offers neither."""
    event_ms = event_time_ms(spec, number, EVENT_MS)
    types = [n for n in ASYNCHRONOUS if allows(spec, number, n)]
    if types and event_ms is not None:
        return Pace(types[0], event_ms, 0)
    synchronous = (n for n in SYNCHRONOUS if allows(spec, number, n))
    first = None if spec.services.sync_consumer is None else next(synchronous, None)
    return None if first is None else Pace(first, 0, sync_ms(spec))


def sync_ms(spec: DeviceSpec) -> int:
    """Return a time between two SYNCs in which every TPDO has its place on the bus, twice."""
    count = 0 if spec.services.tpdo is None else spec.services.tpdo.count
    return max(SYNC_MS, ceil(2 * (count + 1) * FRAME_BITS * 1000 / spec.bitrate))


def allows(spec: DeviceSpec, number: int, transmission_type: int) -> bool:
    """Tell whether a TPDO can have, or always has, a transmission type."""
    tpdo = spec.services.tpdo
    if tpdo is None or not _within(transmission_type, tpdo.transmission_types):
        return False
    entry = spec.entry(tpdo.communication + number - 1, TYPE_SUB)
    if entry is None or not entry.writable:
        return entry is None or entry.default in (None, transmission_type)
    return all(is_legal(transmission_type, reading.legal) for reading in entry.readings)


def _within(value: int, intervals: Iterable[list[int]]) -> bool:
    return any(low <= value <= high for low, high in intervals)


def event_time_ms(spec: DeviceSpec, number: int, at_least_ms: int) -> int | None:
    """Return an event time that a TPDO can have, or always has; None where it has no event timer."""
    tpdo = spec.services.tpdo
    entry = None if tpdo is None else spec.entry(tpdo.communication + number - 1, EVENT_TIMER_SUB)
    if tpdo is None or entry is None:
        return None
    if not entry.writable:
        return entry.default if isinstance(entry.default, int) and entry.default else None
    wanted_ms = max(at_least_ms, tpdo.min_cycle_ms or 0)
    edges = {low for reading in entry.readings for low, _ in reading.legal or ()}
    for value in (wanted_ms, *sorted(edge for edge in edges if edge > wanted_ms)):
        if all(is_legal(value, reading.legal) for reading in entry.readings):
            return value
    return None


def tpdos(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs that can be made to come, by their number."""
    tpdo = spec.services.tpdo
    if tpdo is not None:
        for number in range(1, tpdo.count + 1):
            index = tpdo.communication + number - 1
            parameter = spec.entry(index, COB_ID_SUB)
            off = parameter is not None and _always_off(parameter)
            if not off and pace_of(spec, number) is not None:
                section = parameter.source if parameter is not None else tpdo.source
                yield Case(address(index), number, section)


def _always_off(cob_id: Entry) -> bool:
    """Tell whether a TPDO is documented as disabled and cannot be enabled."""
    off = isinstance(cob_id.default, int) and bool(cob_id.default & NOT_VALID)
    return off and not cob_id.writable


def disablable(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs whose COB-ID can be written."""
    for case in tpdos(spec):
        tpdo = spec.services.tpdo
        entry = tpdo and spec.entry(tpdo.communication + case.subject - 1, COB_ID_SUB)
        if entry and entry.writable:
            yield case


def waiting(generate: Cases) -> Cases:
    """Return the same cases; those of TPDOs whose parameters may have to be stored first say so."""

    def generated(spec: DeviceSpec) -> Iterable[Case]:
        first = spec.services.tpdo.communication if spec.services.tpdo is not None else 0
        for case in generate(spec):
            pace = pace_entries(spec, first + _number_of(case.subject) - 1)
            yield replace(case, at_need=at_need(*pace))

    return generated


def _number_of(subject: Any) -> int:
    """Return the number of the TPDO that a check receives, alone or with figures to try."""
    number: int = subject if isinstance(subject, int) else subject.number
    return number


def port_of(node: Node, number: int) -> TpdoPort:
    """Return a TPDO of the node."""
    return TpdoPort(node, tpdo_service(node), number)


def others_off(node: Node, number: int) -> None:
    """Disable the TPDOs that are not tried, so that they do not load the bus."""
    for other in range(1, tpdo_service(node).count + 1):
        if other != number:
            port_of(node, other).disable()


def is_number(entry: Entry) -> bool:
    """Tell whether an entry holds a number of fixed length, a BOOLEAN included."""
    others = (DataType.BOOLEAN, DataType.REAL32, DataType.REAL64)
    return entry.type.is_integer or entry.type in others


def mappable_entries(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what every reading of the manual lets be mapped, with the same type."""
    mappable = bool(entry.mappable and entry.readable) and not entry.optional and is_number(entry)
    return spec.services.tpdo is not None and mappable and cases.same_type(entry)


def mappable(node: Node) -> list[Entry]:
    """Return the entries that can surely be mapped.

    Raises:
        SetupRefused: The manual has none.
    """
    found = [
        entry
        for entry in node.spec.entries.values()
        if all(mappable_entries(reading, node.spec) for reading in entry.readings)
    ]
    if not found:
        raise SetupRefused("the manual documents no mappable object")
    return found


def paced(node: Node, number: int) -> Pace:
    """Return what makes a TPDO come; to be called before the node is stopped, for it may be read.

    Raises:
        SetupRefused: The manual offers nothing.
    """
    pace = pace_of(node.spec, number)
    if pace is None:
        raise SetupRefused(
            "the manual offers neither an event timer nor SYNC to make the TPDO come"
        )
    return pace if pace.event_ms else replace(pace, sync_id=sync_id(node))


def sync_id(node: Node) -> int:
    """Return the CAN-ID of the SYNC that the node listens to.

    Raises:
        SetupRefused: The manual documents no SYNC consumer.
    """
    consumer = node.spec.services.sync_consumer
    if consumer is None:
        raise SetupRefused("the manual documents no SYNC consumer")
    return cob_id.SYNC if consumer.object is None else node.number(consumer.object) & 0x7FF


def send_sync(node: Node) -> None:
    """Send a SYNC with the COB-ID that the node listens to."""
    node.send(sync.encode(sync.Sync(None), sync_id(node)))


def send_syncs(node: Node, port: TpdoPort, count: int) -> list[list[Stamped]]:
    """Send SYNCs and return the TPDOs that came after each, before the next."""
    answered = []
    frame = sync.encode(sync.Sync(None), sync_id(node))
    for _ in range(count):
        node.send(frame)
        answered.append(port.listen(sync_ms(node.spec) / 1000))
    answered[-1] += port.listen(LAST_S)
    return answered


def act_on(in_force: InForce, port: TpdoPort, before_ms: int, verdict: Verdict) -> bool:
    """Have a running TPDO act on its new parameters, where they may have to be stored first.

    Args:
        in_force: What stores them.
        port: The TPDO.
        before_ms: Its period before; 0 where its event timer did not send it.
        verdict: To judge and note what became of them.

    Returns:
        Whether it acts on them, as far as that can be seen.
    """
    return put_in_force(
        in_force, verdict, port.pace, partial(_goes_on, port, before_ms), port.start
    )


def require_acts(in_force: InForce, port: TpdoPort, before_ms: int, verdict: Verdict) -> None:
    """Do the same for set-up.

    Raises:
        SetupRefused: It is still sent as before.
    """
    if not act_on(in_force, port, before_ms, verdict):
        raise SetupRefused("the TPDO does not act on its new parameters, see TPDO-02 and TPDO-03")


def _goes_on(port: TpdoPort, before_ms: int) -> bool | None:
    """Tell whether a TPDO is still sent as before; None where no event timer shows it."""
    if not before_ms:
        period_ms = port.period_ms
        return not port.collect(1, max(WINDOW_S, 4 * period_ms / 1000)) if period_ms else None
    seen = port.collect(PERIODS_BEFORE + 1, (PERIODS_BEFORE + 2) * before_ms / 1000)
    gaps, tolerance_ms = port.gaps_ms(seen[1:], before_ms), gap_tolerance_ms(before_ms)
    return bool(gaps) and all(abs(gap - before_ms) <= tolerance_ms for gap in gaps)


def listen(node: Node, port: TpdoPort, pace: Pace) -> list[Stamped]:
    """Return the TPDOs of one window; SYNCs are sent where the TPDO needs them."""
    if pace.event_ms:
        return port.listen(pace.window_s)
    seen = []
    for _ in range(round(pace.window_s * 1000 / pace.sync_ms)):
        node.send(sync.encode(sync.Sync(None), pace.sync_id))
        seen += port.listen(pace.sync_ms / 1000)
    return seen


def set_up(node: Node, port: TpdoPort, transmission_type: int, event_ms: int = 0) -> None:
    """Configure a TPDO with the first object that the node lets be mapped, if any can be."""
    if not port.can_be_mapped or port.fixed_mapping() is not None:
        port.configure(transmission_type, event_ms=event_ms)
        return
    for entry in mappable(node)[:MOST_TRIED]:
        try:
            port.configure(transmission_type, event_ms=event_ms, mapped=[entry])
        except SetupRefused as error:
            refused = error
        else:
            return
    raise refused
