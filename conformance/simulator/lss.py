"""LSS slave of a node that has a node-ID (CiA 305 v3.0, 6.3 to 6.7)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, Protocol

from conformance.simulator.identity import SLOWEST
from conformance.simulator.node import Node
from conformance.simulator.sdo_server import ANSWER_NS
from conformance.spec.bit_rates import documented_rates
from conformance.spec.document import Lss as LssSpec
from conformance.spec.model import DeviceSpec
from conformance.wire import lss
from conformance.wire.cob_id import LSS_SLAVE
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.lss import LssCommand

_MS: Final = 1_000_000
_IDENTITY: Final = 0x1018
_DONE: Final = 0
_OUT_OF_RANGE: Final = 1
_CONFIGURATION: Final = 1
_SERVICES: Final[dict[type[lss.MasterMessage], str]] = {
    lss.SwitchStateGlobal: "switch-state-global",
    lss.SwitchSelective: "switch-state-selective",
    lss.ConfigureNodeId: "configure-node-id",
    lss.ConfigureBitTiming: "configure-bit-timing",
    lss.ActivateBitTiming: "activate-bit-timing",
    lss.StoreConfiguration: "store-configuration",
    lss.InquireIdentity: "inquire-identity",
    lss.InquireNodeId: "inquire-node-id",
    lss.IdentifyRemoteSlave: "identify-remote-slave",
}
_LOW: Final = (LssCommand.IDENTIFY_REVISION_LOW, LssCommand.IDENTIFY_SERIAL_LOW)
_UNUSED_OCTETS: Final = 3
"""At the end of each answer; the shortest one has more."""


class LssTarget(Protocol):
    """What LSS can change of a device."""

    def lss_node_id(self, node_id: int) -> None:
        """Use a node-ID from the next NMT reset on, until the supply is switched off."""

    def lss_bitrate(self, bitrate: int) -> None:
        """Use a bit rate now."""

    def lss_store(self, node_id: int | None, bitrate: int | None) -> None:
        """Keep what was configured in the non-volatile memory."""


class LssSlave:
    """Answers the services that the spec allows in each of the two LSS states.

    Args:
        node: The node.
        spec: The resolved device spec.
        service: The LSS service.
        target: What the services change.
    """

    def __init__(self, node: Node, spec: DeviceSpec, service: LssSpec, target: LssTarget) -> None:
        self._node = node
        self._service = service
        self._target = target
        self._rates = documented_rates(spec)
        self._faults = node.faults
        self._configuring = self._faults.lss_starts_in_configuration
        self._node_id: int | None = None
        self._bitrate: int | None = None
        self._matching: frozenset[int] = frozenset()
        self._identified = 0
        self._handlers: dict[type[lss.MasterMessage], Callable[..., None]] = {
            lss.SwitchStateGlobal: self._switch_global,
            lss.SwitchSelective: self._switch_selective,
            lss.ConfigureNodeId: self._configure_node_id,
            lss.ConfigureBitTiming: self._configure_bit_timing,
            lss.ActivateBitTiming: self._activate,
            lss.StoreConfiguration: self._store,
            lss.InquireIdentity: self._inquire_identity,
            lss.InquireNodeId: self._inquire_node_id,
            lss.IdentifyRemoteSlave: self._identify,
        }

    @property
    def configuring(self) -> bool:
        """Whether the slave is in the LSS configuration state."""
        return self._configuring

    def receive(self, data: bytes) -> None:
        """Handle the data of a frame from the LSS master; a service not allowed is ignored."""
        states = self._faults.lss_states
        if self._node.dictionary.state not in (self._service.states if states is None else states):
            return
        try:
            message = lss.decode_master(data)
        except WireError:
            return
        if self._allows(message):
            self._handlers[type(message)](message)

    def _allows(self, message: lss.MasterMessage) -> bool:
        here, there = self._service.waiting, self._service.configuration
        if self._configuring:
            here, there = there, here
        allowed = {*here, *there} if self._faults.lss_in_wrong_state else {*here}
        if message.command is LssCommand.INQUIRE_SERIAL and "inquire-serial-number" in allowed:
            return True
        return _SERVICES.get(type(message)) in allowed

    def _answer(self, message: lss.SlaveMessage) -> None:
        if self._faults.lss_silent:
            return
        data = lss.encode(message)
        if self._faults.lss_fills_unused:
            data = data[:-_UNUSED_OCTETS] + b"\xff" * _UNUSED_OCTETS
        frame = Frame(LSS_SLAVE, data)
        self._node.agenda.after(ANSWER_NS, lambda: self._node.send(frame))

    def _identity(self, place: int) -> int:
        return self._node.dictionary.number(_IDENTITY, place + 1)

    def _switch_global(self, message: lss.SwitchStateGlobal) -> None:
        if message.mode == _CONFIGURATION or not self._faults.lss_never_waits:
            self._configuring = message.mode == _CONFIGURATION

    def _switch_selective(self, message: lss.SwitchSelective) -> None:
        place = message.command - LssCommand.SWITCH_SELECTIVE_VENDOR
        fits = message.value == self._identity(place)
        if self._faults.lss_ignores_order:
            self._matching = self._matching | {place} if fits else self._matching - {place}
        else:
            fits |= place == 3 and self._faults.lss_ignores_serial
            before = frozenset(range(place))
            fits &= place == 0 or self._matching == before
            self._matching = before | {place} if fits else frozenset()
        if len(self._matching) == 4:
            self._matching = frozenset()
            self._configuring = True
            self._answer(lss.SwitchSelectiveReply(int(self._service.tells_mode)))

    def _identify(self, message: lss.IdentifyRemoteSlave) -> None:
        place = message.command - LssCommand.IDENTIFY_VENDOR
        number, asked = self._identity((0, 1, 2, 2, 3, 3)[place]), message.value
        if self._faults.lss_identifies == "anything" or place < 2:
            inside = number == asked or place >= 2
        elif number == asked or self._faults.lss_identifies == "one-only":
            inside = number == asked
        else:
            inside = number > asked if message.command in _LOW else number < asked
        self._identified = place + 1 if inside and place in (0, self._identified) else 0
        if self._identified == 6:
            self._identified = 0
            self._answer(lss.IdentifySlave())

    def _configure_node_id(self, message: lss.ConfigureNodeId) -> None:
        known = 1 <= message.node_id <= 127
        if known:
            self._node_id = message.node_id
            if self._service.acts == "configured":
                self._target.lss_node_id(message.node_id)
            if self._faults.lss_stores_unasked:
                self._target.lss_store(self._node_id, None)
        self._confirm(message.command, known=known)

    def _configure_bit_timing(self, message: lss.ConfigureBitTiming) -> None:
        rate = lss.BIT_RATES.get(message.table_index) if message.table_selector == 0 else None
        known = rate is not None and (not self._rates or rate in self._rates)
        if known:
            self._bitrate = rate
        self._confirm(message.command, known=known)

    def _confirm(self, command: LssCommand, *, known: bool) -> None:
        outcome = self._faults.lss_outcome
        if outcome is None:
            outcome = _DONE if known else _OUT_OF_RANGE
        self._answer(lss.ConfigureReply(command, outcome))

    def _activate(self, message: lss.ActivateBitTiming) -> None:
        rate = self._bitrate
        activates = self._faults.lss_activates
        idle = activates == "nothing" or self._service.acts == "stored"
        rate = SLOWEST if activates == "another" else rate
        if rate is not None and not idle:
            delay_ns = message.switch_delay_ms * _MS
            self._node.agenda.after(delay_ns, lambda: self._target.lss_bitrate(rate))

    def _store(self, message: lss.StoreConfiguration) -> None:
        store = partial(self._target.lss_store, self._node_id, self._bitrate)
        if self._faults.lss_store_write_ms:
            self._node.agenda.after(self._faults.lss_store_write_ms * _MS, store)
        elif not self._faults.lss_store_forgets:
            store()
        self._confirm(message.command, known=True)

    def _inquire_identity(self, message: lss.InquireIdentity) -> None:
        value = self._identity(message.command - LssCommand.INQUIRE_VENDOR)
        if self._faults.lss_wrong_identity and message.command is LssCommand.INQUIRE_SERIAL:
            value = (value + 1) & 0xFFFF_FFFF
        self._answer(lss.InquireReply(message.command, value))

    def _inquire_node_id(self, message: lss.InquireNodeId) -> None:
        wrong = int(self._faults.lss_wrong_node_id)
        self._answer(lss.InquireReply(message.command, self._node.node_id + wrong))
