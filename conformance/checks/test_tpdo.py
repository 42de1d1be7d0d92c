"""TPDO: when it is sent and what it carries (CiA 301 v4.2.0, 7.2.2 and 7.5.2.35 to 7.5.2.36)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

from conformance.bench.link import Stamped
from conformance.bench.node import Node
from conformance.bench.tpdo import ASYNCHRONOUS, TpdoPort
from conformance.checks.limits import gap_tolerance_ms, mean, mean_tolerance_ms
from conformance.checks.steps import require_alive, tpdo_service
from conformance.checks.test_nmt import TO
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire import sync
from conformance.wire.nmt import NmtCommand, NmtState
from conformance.wire.pdo import pack

PDO = f"{CIA301}, 7.2.2"
COMMUNICATION = f"{CIA301}, 7.5.2.35"
EVENT_MS = 50
WINDOW_S = 0.5
SYNC_MS = 10
PERIODS = 20
MOST_BITS = 64


class Numbered(NamedTuple):
    """A TPDO and one figure to try."""

    number: int
    figure: int


def _tpdos(spec: DeviceSpec) -> Iterable[Case]:
    tpdo = spec.services.tpdo
    if tpdo is not None:
        for number in range(1, tpdo.count + 1):
            yield Case(address(tpdo.communication + number - 1), number, tpdo.source)


def _with_figures(spec: DeviceSpec, unit: str, figures: Sequence[int]) -> Iterable[Case]:
    for case in _tpdos(spec):
        for figure in figures:
            label = (
                f"{case.label}/{figure}{unit}" if unit == "ms" else f"{case.label}/type-{figure}"
            )
            yield Case(label, Numbered(case.subject, figure), case.section)


def _event_timers(spec: DeviceSpec) -> Iterable[Case]:
    shortest = spec.services.tpdo.min_cycle_ms if spec.services.tpdo else None
    return _with_figures(spec, "ms", sorted({max(shortest or 0, 20), 100}))


def _sync_types(spec: DeviceSpec) -> Iterable[Case]:
    if spec.services.sync_consumer is None or spec.services.tpdo is None:
        return ()
    allowed = [
        n
        for n in (1, 2, 3, 240)
        if any(int(a) <= n <= int(b) for a, b in spec.services.tpdo.transmission_types)
    ]
    return _with_figures(spec, "", allowed)


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
    port.configure(ASYNCHRONOUS, event_ms=EVENT_MS, mapped=_mappable(node)[:1])
    for state in (NmtState.OPERATIONAL, NmtState.STOPPED, NmtState.PRE_OPERATIONAL):
        node.nmt(TO[state])
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
    port.configure(ASYNCHRONOUS, event_ms=timer.figure, mapped=_mappable(node)[:1])
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
    port.configure(kind.figure, mapped=_mappable(node)[:1])
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
    return answered


@requirement(
    "TPDO-04",
    level="manual",
    cases=("number", _tpdos),
    source=f"{CIA301}, 7.5.2.35",
    effects=("reads", "writes"),
)
def test_disabled_tpdo_is_not_sent(node: Node, number: int, verdict: Verdict) -> None:
    """With bit 31 of its COB-ID set a TPDO is not sent; with the bit cleared it is."""
    port = _port(node, number)
    port.configure(ASYNCHRONOUS, event_ms=EVENT_MS, mapped=_mappable(node)[:1])
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
    source=f"{CIA301}, 7.5.2.36",
    effects=("reads", "writes"),
)
def test_tpdo_carries_the_mapped_objects(node: Node, number: int, verdict: Verdict) -> None:
    """A TPDO carries the mapped objects' values, in the mapping's order."""
    port = _port(node, number)
    mapped = _told_apart(node)
    port.configure(ASYNCHRONOUS, event_ms=EVENT_MS, mapped=mapped)
    node.nmt(NmtCommand.START)

    before = _values(node, mapped)
    seen = port.collect(1, 10 * EVENT_MS / 1000)
    after = _values(node, mapped)

    if not seen:
        raise SetupRefused("the TPDO does not come, see TPDO-01")
    if before != after:
        raise SetupRefused("the mapped values do not stand still long enough to be compared")
    verdict.equal(
        f"TPDO with {', '.join(entry.address for entry in mapped)}",
        seen[0].frame.data,
        pack([(value, entry.type.bits or 0) for value, entry in zip(before, mapped, strict=True)]),
        show=lambda data: data.hex(" ").upper(),
    )


def _mappable(node: Node) -> list[Entry]:
    """The entries that every reading of the manual lets be mapped."""
    found = [
        entry
        for entry in node.spec.entries.values()
        if entry.type.bits and all(reading.mappable for reading in entry.readings)
    ]
    if not found:
        raise SetupRefused("the manual documents no mappable object")
    return found


def _told_apart(node: Node) -> list[Entry]:
    """Mappable entries that fit one TPDO and hold different values, so that their order shows."""
    chosen: list[Entry] = []
    held: set[int] = set()
    for entry in sorted(_mappable(node), key=lambda entry: -entry.index):
        bits = sum(other.type.bits or 0 for other in chosen) + (entry.type.bits or 0)
        transfer = node.sdo.upload(entry.index, entry.sub)
        if transfer.data is None or bits > MOST_BITS:
            continue
        raw = int.from_bytes(transfer.data, "little")
        if raw not in held:
            chosen.append(entry)
            held.add(raw)
    if len(chosen) < 2:
        raise SetupRefused("the mappable objects all hold one value, so their order cannot be seen")
    return chosen


def _values(node: Node, mapped: Sequence[Entry]) -> list[int]:
    return [int.from_bytes(node.upload(e.index, e.sub), "little") for e in mapped]
