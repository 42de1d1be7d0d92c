"""Boot-up: one message after each start, then Pre-operational (CiA 301 v4.2.0, 7.3.2.2, 7.2.8.3.3)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from conformance.bench.heartbeat import NO_HEARTBEAT, HeartbeatPort, name_of
from conformance.bench.node import Node
from conformance.checks.cases import with_heartbeat
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.document import Services
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtCommand, NmtState

QUIET_S = 0.5
RESETS = {
    "reset-node": NmtCommand.RESET_NODE,
    "reset-communication": NmtCommand.RESET_COMMUNICATION,
}


class Start(NamedTuple):
    """One way to start the node: a reset, or its supply where there is no command."""

    command: NmtCommand | None
    broadcast: bool = False


def _starts(spec: DeviceSpec) -> Iterable[Case]:
    section = spec.services.nmt.source
    for label, command in RESETS.items():
        yield Case(label, Start(command), section, ("resets",))
        yield Case(
            f"{label}/broadcast",
            Start(command, broadcast=True),
            section,
            ("resets", "other-nodes"),
        )
    yield Case("power-on", Start(None), section, ("power",))


def _start(node: Node, way: Start) -> int:
    """Start the node and return the mark from which its boot-up can be seen."""
    rig = node.link.rig
    if way.command is not None:
        mark = node.link.mark()
        node.nmt(way.command, node_id=0 if way.broadcast else None)
    elif rig is None:
        raise SetupRefused("the bench cannot switch the supply")
    else:
        rig.power_off()
        mark = node.link.mark()
        rig.power_on()
    node.was_reset = True
    return mark


@requirement(
    "BOOT-01", level="shall", cases=("way", _starts), source=f"{CIA301}, 7.2.8.3.3", effects=()
)
def test_one_boot_up_message_per_start(node: Node, way: Start, verdict: Verdict) -> None:
    """After each start the node sends exactly one boot-up message, one octet 00h."""
    mark = _start(node, way)

    node.link.wait(node.is_boot_up, node.boot_up_timeout_s, mark)
    node.link.listen(QUIET_S, node.is_boot_up)

    boot_ups = len(node.link.since(mark, node.is_boot_up))
    verdict.equal("boot-up messages", boot_ups, 1)


@requirement(
    "BOOT-02",
    level="shall",
    cases=("way", with_heartbeat(_starts)),
    source=f"{CIA301}, 7.3.2.2",
    effects=(),
)
def test_state_after_start(
    node: Node, heartbeat: HeartbeatPort, way: Start, spec: DeviceSpec, verdict: Verdict
) -> None:
    """After a start the node is Pre-operational, or Operational where it starts by itself."""
    node.await_boot_up(_start(node, way))

    seen = heartbeat.state()
    if seen == NO_HEARTBEAT:
        raise SetupRefused("no heartbeat shows the state, see HB-05")
    readings = {_start_state(services): other for services, other in spec.services_readings[::-1]}
    verdict.holds("state", expected=" or ".join(sorted(readings)), actual=seen, ok=seen in readings)
    followed = readings.get(seen)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)


def _start_state(services: Services) -> str:
    """Return the state that a node is in after its boot-up message."""
    automatic = services.nmt.automatic_start
    return name_of(NmtState.OPERATIONAL if automatic else NmtState.PRE_OPERATIONAL)
