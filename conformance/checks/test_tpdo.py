"""TPDO: when it is sent and what it carries (CiA 301 v4.2.0, 7.2.2 and 7.5.2.37 to 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from conformance.bench.link import Stamped
from conformance.bench.node import Node
from conformance.bench.tpdo import ASYNCHRONOUS, TpdoPort
from conformance.checks import cases
from conformance.checks.limits import gap_tolerance_ms, mean, mean_tolerance_ms
from conformance.checks.steps import COB_ID_SUB, ENTER, require_alive, tpdo_service
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire import sync
from conformance.wire.datatypes import DataType
from conformance.wire.nmt import NmtCommand, NmtState
from conformance.wire.pdo import MappingEntry, unpack

COMMUNICATION = f"{CIA301}, 7.5.2.37"
NOT_VALID = 1 << 31
EVENT_MS = 50
WINDOW_S = 0.5
SYNC_MS = 20
LAST_S = 0.2
PERIODS = 20
MOST_BITS = 64
MOST_TRIED = 4
SAMPLES = 5
NOISE = 2
"""Steps by which a measured value may move between two looks at it."""


class Numbered(NamedTuple):
    """A TPDO and one figure to try."""

    number: int
    figure: int


def _tpdos(spec: DeviceSpec) -> Iterable[Case]:
    tpdo = spec.services.tpdo
    if tpdo is not None:
        for number in range(1, tpdo.count + 1):
            index = tpdo.communication + number - 1
            parameter = spec.entry(index, COB_ID_SUB)
            if parameter is None or not _always_off(parameter):
                section = parameter.source if parameter is not None else tpdo.source
                yield Case(address(index), number, section)


def _always_off(cob_id: Entry) -> bool:
    """Tell whether a TPDO is documented as disabled and cannot be enabled."""
    off = isinstance(cob_id.default, int) and bool(cob_id.default & NOT_VALID)
    return off and not cob_id.writable


def _disablable(spec: DeviceSpec) -> Iterable[Case]:
    for case in _tpdos(spec):
        tpdo = spec.services.tpdo
        entry = tpdo and spec.entry(tpdo.communication + case.subject - 1, COB_ID_SUB)
        if entry and entry.writable:
            yield case


def _with_figures(spec: DeviceSpec, words: dict[int, str]) -> Iterable[Case]:
    for case in _tpdos(spec):
        for figure, word in words.items():
            yield Case(f"{case.label}/{word}", Numbered(case.subject, figure), case.section)


def _event_timers(spec: DeviceSpec) -> Iterable[Case]:
    shortest = spec.services.tpdo.min_cycle_ms if spec.services.tpdo else None
    return _with_figures(spec, {n: f"{n}ms" for n in sorted({max(shortest or 0, 20), 100})})


def _sync_types(spec: DeviceSpec) -> Iterable[Case]:
    if spec.services.sync_consumer is None or spec.services.tpdo is None:
        return ()
    allowed = [
        n
        for n in (1, 2, 3, 240)
        if any(int(a) <= n <= int(b) for a, b in spec.services.tpdo.transmission_types)
    ]
    return _with_figures(spec, {n: f"type-{n}" for n in allowed})


def _port(node: Node, number: int) -> TpdoPort:
    return TpdoPort(node, tpdo_service(node), number)


def _others_off(node: Node, number: int) -> None:
    """Disable the TPDOs that are not tried, so that they do not load the bus."""
    for other in range(1, tpdo_service(node).count + 1):
        if other != number:
            _port(node, other).disable()


@requirement(
    "TPDO-01",
    level="shall",
    cases=("number", _tpdos),
    source=f"{CIA301}, 7.3.2.2.5",
    effects=("reads", "writes"),
)
def test_tpdo_is_sent_in_operational_only(node: Node, number: int, verdict: Verdict) -> None:
    """A TPDO is sent in Operational, and neither in Pre-operational nor in Stopped."""
    port = _port(node, number)
    _set_up(node, port, ASYNCHRONOUS, EVENT_MS)
    for state in (NmtState.OPERATIONAL, NmtState.STOPPED, NmtState.PRE_OPERATIONAL):
        node.nmt(ENTER[state])
        node.link.listen(EVENT_MS / 1000, port.matches)

        seen = len(port.listen(WINDOW_S))

        wanted = "some" if state is NmtState.OPERATIONAL else "none"
        verdict.equal(
            f"TPDOs in {state.name.capitalize().replace('_', '-')}",
            "some" if seen else "none",
            wanted,
        )
    require_alive(node)


@requirement(
    "TPDO-02",
    level="shall",
    cases=("timer", _event_timers),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_event_timer_sets_the_period(node: Node, timer: Numbered, verdict: Verdict) -> None:
    """With an asynchronous type the TPDO is sent at the period of its event timer."""
    port = _port(node, timer.number)
    _others_off(node, timer.number)
    _set_up(node, port, ASYNCHRONOUS, timer.figure)
    port.start()

    seen = port.collect(PERIODS + 2, (PERIODS + 2) * timer.figure * 2 / 1000)

    gaps_ms = [(b.time_s - a.time_s) * 1000 for a, b in pairwise(seen[1:])]
    verdict.equal("intervals seen", len(gaps_ms), PERIODS)
    verdict.within("TPDO period", gaps_ms, timer.figure, gap_tolerance_ms(timer.figure), unit="ms")
    verdict.within(
        "mean TPDO period",
        mean(gaps_ms),
        timer.figure,
        mean_tolerance_ms(timer.figure),
        unit="ms",
    )


@requirement(
    "TPDO-03",
    level="manual",
    cases=("kind", _sync_types),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_tpdo_follows_every_nth_sync(node: Node, kind: Numbered, verdict: Verdict) -> None:
    """With a synchronous type n the TPDO is sent after every n-th SYNC."""
    port = _port(node, kind.number)
    _others_off(node, kind.number)
    _set_up(node, port, kind.figure)
    port.start()

    syncs = 2 * kind.figure if kind.figure > 10 else 5 * kind.figure
    answered = _send_syncs(node, port, syncs)

    wanted = syncs // kind.figure
    verdict.equal(f"TPDOs after {syncs} SYNCs", sum(map(len, answered)), wanted)
    places = [place for place, seen in enumerate(answered) if seen]
    distances = sorted({b - a for a, b in pairwise(places)})
    verdict.equal("SYNCs from TPDO to TPDO", distances, [kind.figure])


def _send_syncs(node: Node, port: TpdoPort, count: int) -> list[list[Stamped]]:
    """Send SYNCs and return the TPDOs that came after each, before the next."""
    consumer = node.spec.services.sync_consumer
    if consumer is None:
        raise SetupRefused("the manual documents no SYNC consumer")
    can_id = node.number(consumer.object) & 0x7FF
    answered = []
    for _ in range(count):
        node.send(sync.encode(sync.Sync(None), can_id))
        answered.append(port.listen(SYNC_MS / 1000))
    answered[-1] += port.listen(LAST_S)
    return answered


@requirement(
    "TPDO-04",
    level="manual",
    cases=("number", _disablable),
    source=f"{CIA301}, 7.5.2.37",
    effects=("reads", "writes"),
)
def test_disabled_tpdo_is_not_sent(node: Node, number: int, verdict: Verdict) -> None:
    """With bit 31 of its COB-ID set a TPDO is not sent; with the bit cleared it is."""
    port = _port(node, number)
    _set_up(node, port, ASYNCHRONOUS, EVENT_MS)
    port.disable()
    port.start()

    disabled = len(port.listen(WINDOW_S))
    port.enable()
    enabled = len(port.listen(WINDOW_S))

    verdict.equal("TPDOs with bit 31 set", disabled, 0)
    verdict.equal("TPDOs with bit 31 clear", "some" if enabled else "none", "some")


@requirement(
    "TPDO-05",
    level="manual",
    cases=("number", _tpdos),
    source=f"{CIA301}, 7.5.2.38",
    effects=("reads", "writes"),
)
def test_tpdo_carries_the_mapped_objects(node: Node, number: int, verdict: Verdict) -> None:
    """A TPDO carries the mapped objects' values, in the mapping's order."""
    port = _port(node, number)
    if port.can_be_mapped:
        mapped = _told_apart(node)
        port.configure(ASYNCHRONOUS, event_ms=EVENT_MS, mapped=[field.entry for field in mapped])
    else:
        mapped = _as_mapped(node, port)
        port.configure(ASYNCHRONOUS, event_ms=EVENT_MS)
    node.nmt(NmtCommand.START)

    seen = port.collect(1, 10 * EVENT_MS / 1000)

    if not seen:
        raise SetupRefused("the TPDO does not come, see TPDO-01")
    data = seen[0].frame.data
    bits = [field.entry.type.bits or 0 for field in mapped]
    verdict.equal("octets", len(data), (sum(bits) + 7) // 8)
    if len(data) * 8 < sum(bits):
        return
    for field, raw in zip(mapped, unpack(data, bits), strict=True):
        value = field.decode(raw)
        verdict.holds(
            f"{field.entry.address} in the TPDO",
            expected=field.expected,
            actual=str(value),
            ok=field.low <= value <= field.high,
        )


def _mappable_entries(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what every reading of the manual lets be mapped, with the same type."""
    bits = entry.type.bits is not None and entry.type.is_integer
    mappable = bool(entry.mappable) and not entry.optional
    return spec.services.tpdo is not None and bits and mappable and cases.same_type(entry)


def _to_be_mapped(entry: Entry, spec: DeviceSpec) -> bool:
    tpdo = spec.services.tpdo
    place = tpdo and spec.entry(tpdo.mapping, 1)
    return bool(place and place.writable) and _mappable_entries(entry, spec)


@requirement(
    "TPDO-06",
    level="manual",
    cases=cases.entries(_to_be_mapped, "mappable"),
    source=f"{CIA301}, 7.5.2.38",
    effects=("reads", "writes"),
)
def test_mappable_object_is_mapped(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An object documented as mappable can be mapped into a TPDO by the documented procedure."""
    tpdo = tpdo_service(node)
    port = _port(node, 1)
    node.upload(entry.index, entry.sub)
    port.disable()
    node.download(tpdo.mapping, 0, 0)
    word = MappingEntry(entry.index, entry.sub, entry.type.bits or 0).to_word()

    mapped = node.try_download(tpdo.mapping, 1, DataType.UNSIGNED32.encode(word))
    verdict.holds(
        f"download of {word:08X}h to {address(tpdo.mapping, 1)}",
        expected="confirmed",
        actual=str(mapped),
        ok=mapped.confirmed,
    )
    if mapped.confirmed:
        counted = node.try_download(tpdo.mapping, 0, DataType.UNSIGNED8.encode(1))
        verdict.holds(
            f"download of 1 to {address(tpdo.mapping, 0)}",
            expected="confirmed",
            actual=str(counted),
            ok=counted.confirmed,
        )


def _mappable(node: Node) -> list[Entry]:
    found = [
        entry
        for entry in node.spec.entries.values()
        if all(_mappable_entries(reading, node.spec) for reading in entry.readings)
    ]
    if not found:
        raise SetupRefused("the manual documents no mappable object")
    return found


def _set_up(node: Node, port: TpdoPort, transmission_type: int, event_ms: int = 0) -> None:
    """Configure a TPDO with the first object that the node lets be mapped, if any can be."""
    if not port.can_be_mapped:
        port.configure(transmission_type, event_ms=event_ms)
        return
    for entry in _mappable(node)[:MOST_TRIED]:
        try:
            port.configure(transmission_type, event_ms=event_ms, mapped=[entry])
        except SetupRefused as error:
            refused = error
        else:
            return
    raise refused


@dataclass(frozen=True, slots=True)
class Held:
    """A mapped entry and between which values it was seen.

    Args:
        entry: An integer entry.
        low: Least value a TPDO may carry.
        high: Greatest value a TPDO may carry.
    """

    entry: Entry
    low: int
    high: int

    @property
    def expected(self) -> str:
        """The values in words."""
        return f"{self.low}" if self.low == self.high else f"{self.low} to {self.high}"

    def decode(self, raw: int) -> int:
        """Return the field of a TPDO as a number of the entry's type."""
        size = self.entry.type.size or 0
        return int(self.entry.type.decode(raw.to_bytes(size, "little")))


def _told_apart(node: Node) -> list[Held]:
    """Mappable entries that fit one TPDO and hold different values, so that their order shows."""
    chosen: list[Held] = []
    for entry in sorted(_mappable(node), key=lambda entry: -entry.index):
        bits = sum(field.entry.type.bits or 0 for field in chosen) + (entry.type.bits or 0)
        if bits > MOST_BITS:
            continue
        try:
            held = _held(node, entry)
        except SetupRefused:
            continue
        if all(held.high < other.low or other.high < held.low for other in chosen):
            chosen.append(held)
    if len(chosen) < 2:
        raise SetupRefused("the mappable objects all hold one value, so their order cannot be seen")
    return chosen


def _as_mapped(node: Node, port: TpdoPort) -> list[Held]:
    """The entries of a mapping that cannot be written."""
    entries = [node.spec.entry(word.index, word.sub) for word in port.mapping()]
    found = [entry for entry in entries if entry is not None]
    if len(found) < len(entries) or not found:
        raise SetupRefused("the mapping names an object that the manual does not document")
    return [_held(node, entry) for entry in found]


def _held(node: Node, entry: Entry) -> Held:
    """Watch an entry; a measured value may move on by as much as it was seen to, and a little."""
    values = [node.number(entry.index, entry.sub) for _ in range(SAMPLES)]
    margin = max(values) - min(values) + NOISE if entry.kind == "live" else 0
    return Held(entry, min(values) - margin, max(values) + margin)
