"""Heartbeats after a start: at the time stored, counted from the boot-up message (CiA 301, 7.2.8.3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, get_args

from conformance.bench.bus.intervals import gaps_ms
from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import HeartbeatPort
from conformance.bench.services.starting import Restart, restarted_heartbeat
from conformance.effects import Effect
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, address
from conformance.verdict import Verdict

BEATS = 4


class Write(NamedTuple):
    """A heartbeat time written, stored or not, and a restart after it."""

    save: bool
    how: Restart


def _writes(spec: DeviceSpec) -> Iterable[Case]:
    producer = spec.services.heartbeat_producer
    stores = all(it.store is not None for it, _ in spec.services_readings)
    if producer is None or not stores:
        return
    for save in (True, False):
        for how in get_args(Restart):
            word = "stored" if save else "not-stored"
            effects: tuple[Effect, ...] = ("non-volatile",) if save else ()
            power: tuple[Effect, ...] = ("power",) if how == "power-on" else ()
            label = f"{address(producer.object)}/{word}/{how}"
            yield Case(label, Write(save, how), producer.source, effects + power)


@requirement(
    "HB-11",
    level="shall",
    cases=("write", _writes),
    source=f"{CIA301}, 7.2.8.3.2.2",
    effects=("reads", "writes", "resets"),
)
def test_heartbeat_starts_with_the_node(
    node: Node, heartbeat: HeartbeatPort, write: Write, verdict: Verdict
) -> None:
    """After a start heartbeats come at the time the node then holds; boot-up counts as the first."""
    seen = restarted_heartbeat(node, heartbeat, write.how, BEATS, save=write.save)

    if seen.held_ms == heartbeat.producer.off:
        verdict.equal("heartbeats with the time off", len(seen.beats), 0)
        return
    boot_up = [] if seen.boot_up is None else [seen.boot_up]
    gaps = gaps_ms(node.link, [*boot_up, *seen.beats], seen.held_ms)
    verdict.equal("heartbeats seen", len(seen.beats), BEATS)
    margin_ms = seen.held_ms / 2
    verdict.within("heartbeat period", gaps, seen.held_ms, margin_ms, unit="ms")
