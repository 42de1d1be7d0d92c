"""LSS slave of a node that has a node-ID (CiA 305 v3.0, 6.3 to 6.7)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from conformance.simulator.identity import rate_values
from conformance.simulator.node import Node
from conformance.simulator.sdo_server import ANSWER_NS
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
        self._rates = rate_values(spec)
        self._configuring = False
        self._node_id: int | None = None
        self._bitrate: int | None = None
        self._selected = 0
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

    def receive(self, data: bytes) -> None:
        """Handle the data of a frame from the LSS master; a service not allowed is ignored."""
        if self._node.dictionary.state not in self._service.states:
            return
        try:
            message = lss.decode_master(data)
        except WireError:
            return
        allowed = self._service.configuration if self._configuring else self._service.waiting
        if _SERVICES.get(type(message)) in allowed:
            self._handlers[type(message)](message)

    def _answer(self, message: lss.SlaveMessage) -> None:
        if not self._node.faults.lss_silent:
            frame = Frame(LSS_SLAVE, lss.encode(message))
            self._node.agenda.after(ANSWER_NS, lambda: self._node.send(frame))

    def _identity(self, place: int) -> int:
        return self._node.dictionary.number(_IDENTITY, place + 1)

    def _switch_global(self, message: lss.SwitchStateGlobal) -> None:
        self._configuring = message.mode == _CONFIGURATION

    def _switch_selective(self, message: lss.SwitchSelective) -> None:
        place = message.command - LssCommand.SWITCH_SELECTIVE_VENDOR
        fits = place in (0, self._selected) and message.value == self._identity(place)
        self._selected = place + 1 if fits else 0
        if self._selected == 4:
            self._selected = 0
            self._configuring = True
            self._answer(lss.SwitchSelectiveReply(int(self._service.tells_mode)))

    def _identify(self, message: lss.IdentifyRemoteSlave) -> None:
        place = message.command - LssCommand.IDENTIFY_VENDOR
        number = self._identity((0, 1, 2, 2, 3, 3)[place])
        if message.command in (LssCommand.IDENTIFY_REVISION_LOW, LssCommand.IDENTIFY_SERIAL_LOW):
            inside = number >= message.value
        elif place >= 3:
            inside = number <= message.value
        else:
            inside = number == message.value
        self._identified = place + 1 if inside and place in (0, self._identified) else 0
        if self._identified == 6:
            self._identified = 0
            self._answer(lss.IdentifySlave())

    def _configure_node_id(self, message: lss.ConfigureNodeId) -> None:
        known = 1 <= message.node_id <= 127
        if known:
            self._node_id = message.node_id
            self._target.lss_node_id(message.node_id)
        self._confirm(message.command, known=known)

    def _configure_bit_timing(self, message: lss.ConfigureBitTiming) -> None:
        rate = lss.BIT_RATES.get(message.table_index) if message.table_selector == 0 else None
        known = rate is not None and (not self._rates or rate in self._rates)
        if known:
            self._bitrate = rate
        self._confirm(message.command, known=known)

    def _confirm(self, command: LssCommand, *, known: bool) -> None:
        self._answer(lss.ConfigureReply(command, _DONE if known else _OUT_OF_RANGE))

    def _activate(self, message: lss.ActivateBitTiming) -> None:
        rate = self._bitrate
        if rate is not None:
            delay_ns = message.switch_delay_ms * _MS
            self._node.agenda.after(delay_ns, lambda: self._target.lss_bitrate(rate))

    def _store(self, message: lss.StoreConfiguration) -> None:
        self._target.lss_store(self._node_id, self._bitrate)
        self._answer(lss.ConfigureReply(message.command, _DONE))

    def _inquire_identity(self, message: lss.InquireIdentity) -> None:
        value = self._identity(message.command - LssCommand.INQUIRE_VENDOR)
        if self._node.faults.lss_wrong_identity and message.command is LssCommand.INQUIRE_SERIAL:
            value = (value + 1) & 0xFFFF_FFFF
        self._answer(lss.InquireReply(message.command, value))

    def _inquire_node_id(self, message: lss.InquireNodeId) -> None:
        self._answer(lss.InquireReply(message.command, self._node.node_id))
