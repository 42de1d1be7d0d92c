"""LSS slave: its two states, how they are entered, and what each of them has (CiA 305 v3.0, 6.3)."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.services.lss import LssPort, index_of
from conformance.bench.services.lss_master import CONFIGURATION
from conformance.checks.lss.lss_cases import (
    CIA305,
    NUMBERS,
    SILENT,
    LssState,
    ever,
    follow,
    offers,
    once,
    services_in,
)
from conformance.effects import Effect
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, StateName
from conformance.spec.services import LssService, Services
from conformance.verdict import Verdict
from conformance.wire import lss as wire
from conformance.wire.lss import LssCommand

SWITCHING = f"{CIA305}, 6.3"
NMT_STATES: tuple[StateName, ...] = ("pre-operational", "operational", "stopped")


def _lss_state(lss: LssPort) -> LssState:
    return "configuration" if lss.configuring else "waiting"


def _switches(spec: DeviceSpec) -> Iterable[Case]:
    """Both directions, where an inquiry shows the state."""
    if True not in offers(spec, "inquire-serial-number", "configuration"):
        return
    for source in ever(spec, "switch-state-global", "waiting"):
        for state in ("configuration", "waiting"):
            yield Case(f"04h/{state}", state, source)


@requirement(
    "LSS-01",
    level="manual",
    cases=("state", _switches),
    source=SWITCHING,
    effects=("reads", "other-nodes"),
)
def test_global_switch_changes_the_state(lss: LssPort, state: LssState, verdict: Verdict) -> None:
    """A global switch leads to the configuration state, and back to waiting."""
    to_configuration = wire.SwitchStateGlobal(CONFIGURATION)
    lss.enter()
    lss.tell(to_configuration)
    if state == "waiting":
        if not lss.configuring:
            raise SetupRefused("no configuration state was seen, see LSS-01/04h/configuration")
        lss.wait()

    seen = _lss_state(lss)

    verdict.equal("LSS state", seen, state)
    lss.tell(to_configuration)
    if state == "waiting" and not lss.configuring:
        raise SetupRefused("the node went silent for good")


@requirement(
    "LSS-02",
    level="shall",
    cases=once("power-on", "inquire-serial-number"),
    source=SWITCHING,
    effects=("reads", "power"),
)
def test_node_starts_in_waiting(lss: LssPort, node: Node, verdict: Verdict) -> None:
    """After power-on the node is in LSS waiting."""
    node.power_cycle()
    lss.enter_nmt()

    seen = _lss_state(lss)

    verdict.equal("LSS state", seen, "waiting")
    if seen == "waiting":
        lss.configure()
    else:
        lss.require_waiting()


@requirement(
    "LSS-03",
    level="manual",
    cases=once("40h-43h", "switch-state-selective", state="waiting"),
    source=SWITCHING,
)
def test_own_address_selects_the_node(lss: LssPort, spec: DeviceSpec, verdict: Verdict) -> None:
    """The four numbers of 1018h select the node, which answers 44h once and is configurable then."""
    lss.enter()

    answers = lss.ask_all(*lss.address.select())

    verdict.equal("answers", len(answers), 1)
    for answer in answers:
        reply = answer.message
        selected = isinstance(reply, wire.SwitchSelectiveReply)
        verdict.holds("answer", expected="44h", actual=str(answer), ok=selected)
        if isinstance(reply, wire.SwitchSelectiveReply):
            follow(verdict, spec, partial(_tells_mode, told=reply.mode == CONFIGURATION))
    verdict.equal("LSS state", _lss_state(lss), "configuration")


def _tells_mode(services: Services, *, told: bool) -> bool:
    return services.lss is None or services.lss.tells_mode == told


def _numbers(spec: DeviceSpec) -> Iterable[Case]:
    for source in ever(spec, "switch-state-selective", "waiting"):
        for number, name in enumerate(NUMBERS):
            yield Case(name, number, source)


@requirement("LSS-04", level="shall", cases=("number", _numbers), source=SWITCHING)
def test_foreign_address_selects_nobody(lss: LssPort, number: int, verdict: Verdict) -> None:
    """With one number of another node the node neither answers nor leaves LSS waiting."""
    lss.enter()

    answer = lss.ask(*lss.address.select_other(number))

    verdict.equal(f"answer with another {NUMBERS[number]}", str(answer), SILENT)
    seen = _lss_state(lss)
    verdict.equal("LSS state", seen, "waiting")
    if seen == "waiting":
        lss.configure()
    else:
        lss.require_waiting()


@requirement(
    "LSS-05",
    level="should",
    cases=once("43h-40h", "switch-state-selective", state="waiting"),
    source=SWITCHING,
)
def test_address_in_reverse_selects_nobody(lss: LssPort, verdict: Verdict) -> None:
    """The four numbers in reverse order do not select the node."""
    lss.enter()
    lss.tell(*lss.address.select_other(*range(4)))

    answer = lss.ask(*lss.address.select()[::-1])

    verdict.equal("answer to 43h, 42h, 41h, 40h", str(answer), SILENT)
    if answer.received is None:
        lss.configure()


class Misplaced(NamedTuple):
    """A service, by its first command specifier, in the LSS state that does not have it."""

    state: LssState
    command: LssCommand


_BY_COMMAND: dict[LssCommand, LssService] = {
    LssCommand.CONFIGURE_NODE_ID: "configure-node-id",
    LssCommand.CONFIGURE_BIT_TIMING: "configure-bit-timing",
    LssCommand.STORE_CONFIGURATION: "store-configuration",
    LssCommand.SWITCH_SELECTIVE_VENDOR: "switch-state-selective",
    LssCommand.INQUIRE_VENDOR: "inquire-identity",
    LssCommand.INQUIRE_PRODUCT: "inquire-identity",
    LssCommand.INQUIRE_REVISION: "inquire-identity",
    LssCommand.INQUIRE_SERIAL: "inquire-serial-number",
    LssCommand.INQUIRE_NODE_ID: "inquire-node-id",
}


def _misplaced(spec: DeviceSpec) -> Iterable[Case]:
    for command, service in _BY_COMMAND.items():
        selective = service == "switch-state-selective"
        state: LssState = "configuration" if selective else "waiting"
        other: LssState = "waiting" if selective else "configuration"
        stores = command is LssCommand.STORE_CONFIGURATION
        effects: tuple[Effect, ...] = ("resets", "non-volatile") if stores else ()
        for source in ever(spec, service, other):
            if True not in offers(spec, service, state):
                yield Case(f"{state}/{command:02X}h", Misplaced(state, command), source, effects)


@requirement("LSS-08", level="shall", cases=("misplaced", _misplaced), source=SWITCHING)
def test_service_of_the_other_state_is_ignored(
    lss: LssPort, misplaced: Misplaced, verdict: Verdict
) -> None:
    """A service that one LSS state has is not answered in the other."""
    _prepare(lss, misplaced.command)
    lss.enter()
    if misplaced.state == "configuration":
        lss.configure()

    answer = lss.ask(*_harmless(lss, misplaced.command))

    verdict.equal(f"answer in LSS {misplaced.state}", str(answer), SILENT)
    if misplaced.state == "waiting":
        lss.configure()
    elif not lss.configuring:
        raise SetupRefused("the node went silent for good")


def _prepare(lss: LssPort, command: LssCommand) -> None:
    if command is LssCommand.STORE_CONFIGURATION:
        lss.begin()


def _harmless(lss: LssPort, command: LssCommand) -> list[wire.MasterMessage]:
    """Return a request that would change nothing if it were obeyed."""
    home = lss.reach.home
    match command:
        case LssCommand.SWITCH_SELECTIVE_VENDOR:
            return lss.address.select()
        case LssCommand.CONFIGURE_NODE_ID:
            return [wire.ConfigureNodeId(home.node_id)]
        case LssCommand.CONFIGURE_BIT_TIMING:
            index = index_of(home.bitrate)
            if index is None:
                raise SetupRefused("the node's own bit rate is not in the standard's table")
            return [wire.ConfigureBitTiming(0, index)]
        case LssCommand.STORE_CONFIGURATION:
            return [wire.StoreConfiguration()]
        case LssCommand.INQUIRE_NODE_ID:
            return [wire.InquireNodeId()]
        case _:
            return [wire.InquireIdentity(command)]


def _states(spec: DeviceSpec) -> Iterable[Case]:
    services = spec.services.lss
    if services is not None and "states" in services.model_fields_set:
        yield Case("nmt-states", None, services.source)


@requirement("LSS-11", level="manual", cases=_states)
def test_nmt_states_of_lss(lss: LssPort, spec: DeviceSpec, verdict: Verdict) -> None:
    """LSS works in the NMT states that the manual names, and in no other."""
    seen: set[StateName] = set()

    for state in NMT_STATES:
        lss.enter(state)
        lss.ask(*lss.address.select())
        if lss.configuring:
            seen.add(state)

    readings = [it.lss.states for it, _ in spec.services_readings if it.lss is not None]
    words = {" and ".join(s for s in NMT_STATES if s in states): None for states in readings}
    shown = " and ".join(s for s in NMT_STATES if s in seen) or "none"
    verdict.holds(
        "NMT states in which LSS works",
        expected=" or ".join(words),
        actual=shown,
        ok=shown in words,
    )
    follow(verdict, spec, lambda it: it.lss is not None and set(it.lss.states) == seen)


def _zeros(spec: DeviceSpec) -> Iterable[Case]:
    readings = [it.lss for it, _ in spec.services_readings]
    judged = spec.services.lss
    if judged is not None and all(it is not None and it.unused == "zero" for it in readings):
        for command in (LssCommand.SWITCH_SELECTIVE_REPLY, *_BY_COMMAND):
            service = _BY_COMMAND.get(command)
            if service is None or service in services_in(judged, "configuration"):
                stores = command is LssCommand.STORE_CONFIGURATION
                effects: tuple[Effect, ...] = ("resets", "non-volatile") if stores else ()
                yield Case(f"{command:02X}h", command, judged.source, effects)


@requirement("LSS-12", level="manual", cases=("command", _zeros))
def test_unused_octets_are_zero(lss: LssPort, command: LssCommand, verdict: Verdict) -> None:
    """An answer has eight octets, and those that carry nothing are 00h."""
    _prepare(lss, command)
    lss.enter()
    selected = command is LssCommand.SWITCH_SELECTIVE_REPLY
    if not selected:
        lss.configure()

    answer = lss.ask(*(lss.address.select() if selected else _harmless(lss, command)))

    if answer.received is None:
        raise SetupRefused(f"there is no answer to {command:02X}h to be judged")
    silent_mode = wire.SwitchSelectiveReply(0)
    message = silent_mode if selected and not lss.service.tells_mode else answer.message
    data = answer.received.frame.data
    expected = wire.encode(message) if message is not None else command.to_bytes() + bytes(7)
    verdict.equal("answer", data, expected, show=lambda octets: octets.hex(" ").upper())
