"""How a node is started, and in which NMT state it is afterwards by each reading of its manual."""

from __future__ import annotations

from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import NO_HEARTBEAT, name_of
from conformance.errors import SetupRefused
from conformance.spec.document import Services
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtCommand, NmtState

QUIET_S = 0.5
"""How long after a boot-up message another one counts as one of the same start."""

RESETS = {
    "reset-node": NmtCommand.RESET_NODE,
    "reset-communication": NmtCommand.RESET_COMMUNICATION,
}


class Start(NamedTuple):
    """One way to start the node: a reset, or its supply where there is no command."""

    command: NmtCommand | None
    broadcast: bool = False


def begin_start(node: Node, way: Start) -> int:
    """Start the node and return the mark from which its boot-up can be seen."""
    if way.command is None:
        return node.begin_power_cycle()
    return node.begin_reset(way.command, node_id=0 if way.broadcast else None)


def count_boot_ups(node: Node, mark: int) -> int:
    """Return how many boot-up messages came since a mark, once they have had time for it."""
    node.link.wait(node.is_boot_up, node.boot_up_timeout_s, mark)
    node.link.listen(QUIET_S, node.is_boot_up)
    return len(node.link.since(mark, node.is_boot_up))


def judge_start_state(spec: DeviceSpec, verdict: Verdict, seen: str) -> None:
    """Judge the state after a start, and tell which reading of the manual the node follows.

    Raises:
        SetupRefused: No heartbeat shows it.
    """
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
