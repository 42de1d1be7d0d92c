"""NMT slave: each command, each state's services, what is not meant for the node (CiA 301, 7.2.8)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import NO_HEARTBEAT, HeartbeatPort, name_of
from conformance.bench.settings.second_values import is_cob_id
from conformance.checks import cases
from conformance.checks.cases import neighbours, with_heartbeat
from conformance.checks.steps import ENTER, own_value, require_state, state_word
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState

NMT = f"{CIA301}, 7.2.8.2.1"
STATES = f"{CIA301}, 7.3.2.2"


class Transition(NamedTuple):
    """One NMT command in one state."""

    before: NmtState
    after: NmtState
    broadcast: bool


def _transitions(spec: DeviceSpec) -> Iterable[Case]:
    for broadcast in (False, True):
        for before in ENTER:
            for after in ENTER:
                if before is not after:
                    suffix = "/broadcast" if broadcast else ""
                    label = f"{state_word(before)}-to-{state_word(after)}{suffix}"
                    yield Case(
                        label,
                        Transition(before, after, broadcast),
                        spec.services.nmt.source,
                        ("other-nodes",) if broadcast else (),
                    )


@requirement(
    "NMT-01",
    level="shall",
    cases=("transition", with_heartbeat(_transitions)),
    source=STATES,
    effects=("reads", "writes"),
)
def test_command_changes_the_state(
    node: Node, heartbeat: HeartbeatPort, transition: Transition, verdict: Verdict
) -> None:
    """Start, stop and enter Pre-operational lead to their state, addressed and as broadcast."""
    require_state(node, heartbeat, transition.before)

    node.nmt(ENTER[transition.after], node_id=0 if transition.broadcast else None)

    seen = heartbeat.state_now()
    if seen == NO_HEARTBEAT:
        raise SetupRefused(
            f"no heartbeat shows the state, see HB-05 ({state_word(transition.after)})"
        )
    verdict.equal("state", seen, name_of(transition.after))


def _states(spec: DeviceSpec) -> Iterable[Case]:
    return (Case(state_word(state), state, spec.services.nmt.source) for state in ENTER)


@requirement("NMT-02", level="shall", cases=("state", _states), source=f"{CIA301}, 7.3.2.2.5")
def test_sdo_is_served_in_its_states_only(node: Node, state: NmtState, verdict: Verdict) -> None:
    """SDO requests are answered in Pre-operational and Operational, and not in Stopped."""
    node.nmt(ENTER[state])

    served = node.answers()

    wanted = "no answer" if state is NmtState.STOPPED else "an answer"
    verdict.equal(
        f"SDO request in {name_of(state)}", "an answer" if served else "no answer", wanted
    )
    node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    if not node.answers():
        raise SetupRefused("the node does not answer in Pre-operational either, see NMT-01")


def _other_nodes(spec: DeviceSpec) -> Iterable[Case]:
    source = spec.services.nmt.source
    for other in neighbours(spec.node_id):
        yield Case(f"node-{other}", Frame(cob_id.NMT, bytes((NmtCommand.START, other))), source)


@requirement(
    "NMT-03",
    level="shall",
    cases=("foreign", with_heartbeat(_other_nodes)),
    source=NMT,
    effects=("reads", "writes", "other-nodes"),
)
def test_command_to_another_node_is_ignored(
    node: Node, heartbeat: HeartbeatPort, foreign: Frame, verdict: Verdict
) -> None:
    """A command addressed to another node changes nothing; the next one to this node works."""
    _judge_ignored(node, heartbeat, foreign, verdict)


def _malformed(spec: DeviceSpec) -> Iterable[Case]:
    command = bytes((NmtCommand.START, spec.node_id)) + bytes(6)
    for octets in (0, 1, *range(3, 9)):
        label = "1-octet" if octets == 1 else f"{octets}-octets"
        yield Case(label, Frame(cob_id.NMT, command[:octets]), spec.services.nmt.source)


@requirement(
    "NMT-04",
    level="should",
    cases=("malformed", with_heartbeat(_malformed)),
    source=NMT,
    effects=("reads", "writes"),
)
def test_command_of_wrong_length_is_ignored(
    node: Node, heartbeat: HeartbeatPort, malformed: Frame, verdict: Verdict
) -> None:
    """A command that has not exactly two octets changes nothing."""
    _judge_ignored(node, heartbeat, malformed, verdict)


def _unknown(spec: DeviceSpec) -> Iterable[Case]:
    for command in (0x00, 0x03, 0x50, 0x60, 0x7F, 0x83):
        yield Case(
            f"{command:02X}h",
            Frame(cob_id.NMT, bytes((command, spec.node_id))),
            spec.services.nmt.source,
        )


@requirement(
    "NMT-05",
    level="shall",
    cases=("unknown", with_heartbeat(_unknown)),
    source=NMT,
    effects=("reads", "writes"),
)
def test_unknown_command_is_ignored(
    node: Node, heartbeat: HeartbeatPort, unknown: Frame, verdict: Verdict
) -> None:
    """A command that the standard reserves changes nothing."""
    _judge_ignored(node, heartbeat, unknown, verdict)


def _judge_ignored(node: Node, heartbeat: HeartbeatPort, frame: Frame, verdict: Verdict) -> None:
    heartbeat.state()
    mark = node.link.mark()

    node.send(frame)

    verdict.equal("state", heartbeat.state_now(), name_of(NmtState.PRE_OPERATIONAL))
    verdict.equal("boot-up messages", len(node.link.since(mark, node.is_boot_up)), 0)
    node.nmt(NmtCommand.START)
    if heartbeat.state_now() != name_of(NmtState.OPERATIONAL):
        raise SetupRefused("the node does not follow a proper command either, see NMT-01")


class Reset(NamedTuple):
    """One reset and a setting it returns to its value at power-on."""

    command: NmtCommand
    entry: Entry


def _resets(spec: DeviceSpec) -> Iterable[Case]:
    areas = (
        (NmtCommand.RESET_NODE, range(0x2000, 0xA000)),
        (NmtCommand.RESET_NODE, range(0x1000, 0x2000)),
        (NmtCommand.RESET_COMMUNICATION, range(0x1000, 0x2000)),
    )
    for command, area in areas:
        found = [entry for entry in spec.entries.values() if _changeable(entry, spec, area)]
        # a plain number rather than a choice or a COB-ID, which may do more than it says
        plain = [e for e in found if e.values is None and not is_cob_id(e, spec)]
        for entry in (plain or found)[:1]:
            word = command.name.lower().replace("_", "-")
            yield Case(f"{word}/{entry.address}", Reset(command, entry), spec.services.nmt.source)


def _changeable(entry: Entry, spec: DeviceSpec, area: range) -> bool:
    return (
        entry.index in area
        and cases.limited(entry, spec)
        and entry.kind == "config"
        and entry.limits_by is None
        and cases.same_type(entry)
        and spec.partner(entry.key) is None
        and not (entry.persistent and spec.services.store is None)
        and not cases.reach(entry, spec)
        and not cases.is_pdo_object(entry, spec)
        and len(cases.legal_values(cases.limits(entry)[0])) > 1
    )


@requirement(
    "NMT-06", level="shall", cases=("reset", _resets), source=STATES, effects=("writes", "resets")
)
def test_reset_returns_unsaved_settings(node: Node, reset: Reset, verdict: Verdict) -> None:
    """A reset returns a setting that was not stored to the value it had after power-on."""
    entry = reset.entry
    node.reset(reset.command)
    before = own_value(node, entry)
    for value in cases.legal_values(cases.limits(entry)[0]):
        data = entry.type.encode(value)
        if data != before and node.try_download(entry.index, entry.sub, data).confirmed:
            break
    if own_value(node, entry) == before:
        raise SetupRefused(f"{entry.address} keeps its value, see OD-12")

    node.reset(reset.command)

    after = own_value(node, entry)
    verdict.equal(
        f"value of {entry.address} after the reset",
        after,
        before,
        show=lambda data: data.hex(" ").upper(),
    )
