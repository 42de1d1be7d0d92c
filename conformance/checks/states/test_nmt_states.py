"""NMT states: what keeps one, and what in each of them is no command (CiA 301, 7.2.8, 7.3.2.2)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from conformance.bench.node.node import PROBE, Node
from conformance.bench.services.heartbeat import NO_HEARTBEAT, HeartbeatPort, name_of, state_of
from conformance.checks.cases import neighbours, with_heartbeat
from conformance.checks.steps import ENTER, require_state, state_word
from conformance.effects import Effect
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState
from conformance.wire.sdo import InitiateUpload, encode

NMT = f"{CIA301}, 7.2.8.2.1"
STATES = f"{CIA301}, 7.3.2.2"
SERVICES = f"{CIA301}, 7.3.2.2.5"
KEPT_S = 2.0
PROBE_EVERY_S = 0.02
PACE_S = 0.002
"""Between two of many frames, so that the adapter's queue does not overflow."""

RESERVED = [command for command in range(0x100) if command not in set(NmtCommand)]


class Repeated(NamedTuple):
    """The command for a state, sent in that state."""

    state: NmtState
    broadcast: bool


def _repeated(spec: DeviceSpec) -> Iterable[Case]:
    for broadcast in (False, True):
        for state in ENTER:
            label = f"{state_word(state)}{'/broadcast' if broadcast else ''}"
            effects: tuple[Effect, ...] = ("other-nodes",) if broadcast else ()
            yield Case(label, Repeated(state, broadcast), spec.services.nmt.source, effects)


@requirement(
    "NMT-07",
    level="shall",
    cases=("repeated", with_heartbeat(_repeated)),
    source=STATES,
    effects=("reads", "writes"),
)
def test_repeated_command_keeps_the_state(
    node: Node, heartbeat: HeartbeatPort, repeated: Repeated, verdict: Verdict
) -> None:
    """The command for the state that the node is in keeps it there, without a restart."""
    require_state(node, heartbeat, repeated.state)
    mark = node.link.mark()

    node.nmt(ENTER[repeated.state], node_id=0 if repeated.broadcast else None)

    _judge_kept(node, heartbeat, mark, repeated.state, verdict)


def _states(spec: DeviceSpec) -> Iterable[Case]:
    return (Case(state_word(state), state, spec.services.nmt.source) for state in ENTER)


@requirement(
    "NMT-10",
    level="shall",
    cases=("state", with_heartbeat(_states)),
    source=STATES,
    effects=("reads", "writes"),
)
def test_state_is_kept_without_a_command(
    node: Node, heartbeat: HeartbeatPort, state: NmtState, verdict: Verdict
) -> None:
    """The node stays in its state as long as no command comes."""
    require_state(node, heartbeat, state)

    watched_s = max(KEPT_S, 2 * heartbeat.typical_ms / 1000)
    seen = node.link.listen(watched_s, node.is_error_control)

    states = sorted({state_of(beat) for beat in seen}) or [NO_HEARTBEAT]
    verdict.equal(f"state during {watched_s:g} s", " and ".join(states), name_of(state))


class Foreign(NamedTuple):
    """A command that is meant for another node."""

    command: NmtCommand
    node_id: int


def _foreign(spec: DeviceSpec) -> Iterable[Case]:
    for command in NmtCommand:
        if command is not NmtCommand.START:
            for other in neighbours(spec.node_id):
                label = f"{command.name.lower().replace('_', '-')}/node-{other}"
                yield Case(label, Foreign(command, other), spec.services.nmt.source)


@requirement(
    "NMT-11",
    level="shall",
    cases=("foreign", with_heartbeat(_foreign)),
    source=NMT,
    effects=("reads", "writes", "other-nodes"),
)
def test_command_to_another_node_does_not_end_operational(
    node: Node, heartbeat: HeartbeatPort, foreign: Foreign, verdict: Verdict
) -> None:
    """Stop, enter Pre-operational and the resets leave a node alone that is not addressed."""
    require_state(node, heartbeat, NmtState.OPERATIONAL)
    mark = node.link.mark()

    node.nmt(foreign.command, node_id=foreign.node_id)

    _judge_kept(node, heartbeat, mark, NmtState.OPERATIONAL, verdict)
    node.nmt(NmtCommand.STOP)
    if heartbeat.state_now() != name_of(NmtState.STOPPED):
        raise SetupRefused("the node does not follow a command to itself either, see NMT-01")


@requirement(
    "NMT-12",
    level="shall",
    cases=("state", with_heartbeat(_states)),
    source=NMT,
    effects=("reads", "writes"),
)
def test_no_reserved_command_is_obeyed(
    node: Node, heartbeat: HeartbeatPort, state: NmtState, verdict: Verdict
) -> None:
    """None of the 251 commands that the standard reserves changes the state."""
    require_state(node, heartbeat, state)
    mark = node.link.mark()

    for command in RESERVED:
        node.nmt(command)
        node.link.listen(PACE_S, node.is_boot_up)

    _judge_kept(node, heartbeat, mark, state, verdict)


def _judge_kept(
    node: Node, heartbeat: HeartbeatPort, mark: int, state: NmtState, verdict: Verdict
) -> None:
    seen = heartbeat.state_now()
    boot_ups = len(node.link.since(mark, node.is_boot_up))
    if seen == NO_HEARTBEAT and not boot_ups:
        raise SetupRefused(f"no heartbeat shows the state, see HB-05 ({state_word(state)})")
    verdict.equal("state", seen, name_of(state))
    verdict.equal("boot-up messages", boot_ups, 0)


def _power_on(spec: DeviceSpec) -> Iterable[Case]:
    yield Case("power-on", None, spec.services.nmt.source)


@requirement("NMT-09", level="shall", cases=_power_on, source=SERVICES, effects=("reads", "power"))
def test_nothing_is_served_before_the_boot_up_message(node: Node, verdict: Verdict) -> None:
    """In the initialisation the node sends nothing but the boot-up message at its end."""
    request = Frame(node.channel.request_id, encode(InitiateUpload(*PROBE)))
    mark = node.begin_power_cycle()
    deadline = node.link.now() + node.boot_up_timeout_s
    booted = None
    while booted is None and node.link.now() < deadline:
        node.link.send(request)
        booted = node.link.wait(node.is_boot_up, PROBE_EVERY_S, mark)

    if booted is None:
        raise SetupRefused("there is no boot-up message, see BOOT-01")
    own = {node.channel.response_id, cob_id.heartbeat(node.node_id), cob_id.emcy(node.node_id)}
    sent = node.link.since(mark, lambda frame: frame.can_id in own)
    early = [str(it.frame) for it in sent if it.place < booted.place]
    verdict.equal("frames before the boot-up message", ", ".join(early[:3]) or "none", "none")
    node.link.listen(PROBE_EVERY_S, node.channel.is_response)
    node.channel.begin()
