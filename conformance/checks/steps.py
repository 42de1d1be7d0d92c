"""Set-up that several checks share: what must hold before a download can be judged."""

from __future__ import annotations

from collections.abc import Iterator

from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import HeartbeatPort, name_of
from conformance.bench.services.tpdo import TpdoPort
from conformance.bench.settings.settings import unmet_conditions
from conformance.checks.cases import Limits, is_mapping, is_pdo_object, legal_values, limits
from conformance.errors import NodeTimeout, SetupRefused
from conformance.spec.document import Tpdo
from conformance.spec.model import Entry, address, is_legal
from conformance.wire.nmt import NmtCommand, NmtState

COB_ID_SUB = 1
ENTER = {
    NmtState.OPERATIONAL: NmtCommand.START,
    NmtState.STOPPED: NmtCommand.STOP,
    NmtState.PRE_OPERATIONAL: NmtCommand.ENTER_PRE_OPERATIONAL,
}
"""The command that leads to each state."""


def state_word(state: NmtState) -> str:
    """Return a state as specs and item ids write it: ``pre-operational``."""
    return state.name.lower().replace("_", "-")


def require_state(node: Node, heartbeat: HeartbeatPort, state: NmtState) -> None:
    """Bring the node to a state, with heartbeats that show it.

    Raises:
        SetupRefused: They show another one, or do not come.
    """
    heartbeat.state()
    node.nmt(ENTER[state])
    seen = heartbeat.state_now()
    if seen != name_of(state):
        raise SetupRefused(f"the node did not enter {name_of(state)} ({seen}), see NMT-01")


def make_writable(node: Node, entry: Entry) -> None:
    """Bring the node where a download to the entry is allowed: a TPDO is disabled first."""
    tpdo = node.spec.services.tpdo
    if tpdo is None or not is_pdo_object(entry, node.spec):
        return
    mapping = is_mapping(entry, node.spec)
    first = tpdo.mapping if mapping else tpdo.communication
    if mapping or entry.sub != COB_ID_SUB:
        TpdoPort(node, tpdo, entry.index - first + 1).disable()
    if mapping and entry.sub > 0:
        node.download(entry.index, 0, 0)


def own_value(node: Node, entry: Entry) -> bytes:
    """Return what the entry holds, of the documented length.

    Raises:
        SetupRefused: The node does not hold it so; another requirement judges that.
    """
    return of_documented_length(entry, node.upload(entry.index, entry.sub))


def of_documented_length(entry: Entry, data: bytes) -> bytes:
    """Return what an entry holds, if its length is the documented one.

    Raises:
        SetupRefused: It is not; another requirement judges that.
    """
    sizes = {reading.type.size for reading in entry.readings}
    if None not in sizes and len(data) not in sizes:
        raise SetupRefused(f"{entry.address} holds {len(data)} octets, see OD-03")
    return data


def require_writable(node: Node, entry: Entry) -> None:
    """Make sure that a refusal to come can only be for the value.

    Raises:
        SetupRefused: The entry does not even take its own value; OD-04 judges that.
    """
    make_writable(node, entry)
    _meet_conditions(node, entry)
    if entry.access == "wo":
        return
    data = own_value(node, entry)
    transfer = node.try_download(entry.index, entry.sub, data)
    if not transfer.confirmed:
        raise SetupRefused(f"{entry.address} does not take its own value ({transfer}), see OD-04")


def _meet_conditions(node: Node, entry: Entry) -> None:
    """Give other entries what they must hold before this one accepts a new value."""
    for other, wanted in unmet_conditions(node, entry):
        node.download(*other.key, wanted)
    for other in node.spec.entries.values():
        if other.limits_by is not None and other.limits_by.key == entry.key:
            _settle(node, other)


def _settle(node: Node, entry: Entry) -> None:
    """Give an entry a value that is legal whatever the entry that limits it holds, if it takes it."""
    every = limits(entry)
    default = [entry.default] if isinstance(entry.default, int) else []
    tried = [*default, *legal_values(every[0])]
    always = [v for v in tried if all(is_legal(v, x.ranges) for x in every)]
    if always:
        node.try_download(entry.index, entry.sub, entry.type.encode(always[0]))


def each_limit(node: Node, entry: Entry) -> Iterator[tuple[str, Limits]]:
    """Return the entry's ranges; those that depend on another entry with that entry set."""
    for limit in limits(entry):
        when = ""
        if entry.limits_by is not None and limit.setting is not None:
            _settle(node, entry)
            index, sub = entry.limits_by.key
            node.download(index, sub, limit.setting)
            when = f" with {address(index, sub)} = {limit.setting}"
        yield when, limit


def agree(node: Node, entry: Entry, value: int) -> None:
    """Give the other entry of a pair the same value, so that the setting of both changes."""
    partner = node.spec.partner(entry.key)
    if partner is not None:
        node.download(*partner, value)


def tpdo_service(node: Node) -> Tpdo:
    """Return the spec's TPDO service."""
    tpdo = node.spec.services.tpdo
    if tpdo is None:
        raise SetupRefused("the manual documents no TPDO")
    return tpdo


def run_and_switch_off(heartbeat: HeartbeatPort) -> int:
    """Switch the heartbeat on, see it, switch it off and return the period that it had, in ms.

    Raises:
        SetupRefused: It did not come.
    """
    period_ms = heartbeat.typical_ms
    heartbeat.enter()
    heartbeat.set(period_ms)
    if len(heartbeat.collect(2, 4 * period_ms / 1000)) < 2:
        raise SetupRefused("there is no heartbeat to be switched off, see HB-01")
    heartbeat.set(heartbeat.producer.off)
    return period_ms


def require_alive(node: Node) -> None:
    """Make sure that a silence was not that of a dead node.

    Raises:
        NodeTimeout: It does not answer.
    """
    if not node.answers():
        raise NodeTimeout(f"node {node.node_id} does not answer after the silence to be judged")
