"""The firmware between two resets: all services of the node, and which frame goes to which."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, Protocol

from conformance.simulator.cob_id_rules import CAN_ID, guard_cob_ids
from conformance.simulator.commands import Commands
from conformance.simulator.emcy import EmcyProducer
from conformance.simulator.heartbeat import HeartbeatProducer
from conformance.simulator.live import LiveValues, World
from conformance.simulator.lss import LssSlave, LssTarget
from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.nmt import NmtSlave
from conformance.simulator.node import Node
from conformance.simulator.sdo_server import SdoServer
from conformance.simulator.store import ParameterStore
from conformance.simulator.tpdo import TpdoProducer
from conformance.spec.model import DeviceSpec, StateName
from conformance.wire import cob_id, sync
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState

_STATE_NAMES: Final[dict[NmtState, StateName]] = {
    NmtState.PRE_OPERATIONAL: "pre-operational",
    NmtState.OPERATIONAL: "operational",
    NmtState.STOPPED: "stopped",
}


class Hardware(LssTarget, Protocol):
    """What is around the firmware and outlives it."""

    memory: NonVolatileMemory
    world: World


class Firmware:
    """A running node; it exists from the end of the initialisation until the next reset.

    Args:
        spec: The device spec, resolved for the node's node-ID.
        node: What the services share.
        hardware: What is around the firmware.
        reset: Resets the node or its communication.
    """

    def __init__(
        self,
        spec: DeviceSpec,
        node: Node,
        hardware: Hardware,
        reset: Callable[[NmtCommand], None],
    ) -> None:
        services = spec.services
        self.node = node
        self._automatic_start = services.nmt.automatic_start or node.faults.starts_operational
        live = LiveValues(hardware.world, node.dictionary, node.faults)
        Commands(node, hardware.world, live, partial(reset, NmtCommand.RESET_NODE))
        ParameterStore(node, hardware.memory, services)
        guard_cob_ids(node, services)
        self._sync = None if services.sync_consumer is None else services.sync_consumer.object
        self._nmt = NmtSlave(node, self._enter, reset)
        self._sdo = SdoServer(node)
        self._heartbeat = HeartbeatProducer(node, services.heartbeat_producer)
        self._tpdos = TpdoProducer(node, services.tpdo)
        self.emcy = EmcyProducer(node, services.emcy_producer, live, hardware.memory)
        self._lss = None if services.lss is None else LssSlave(node, spec, services.lss, hardware)

    def boot(self) -> None:
        """Send the boot-up message and enter Pre-operational."""
        self._heartbeat.boot()
        self._enter(NmtState.PRE_OPERATIONAL)
        self.emcy.boot()
        if self._automatic_start:
            self._enter(NmtState.OPERATIONAL)

    def resume(self, state: NmtState) -> None:
        """Go on in a state, without a boot-up message."""
        self._heartbeat.resume()
        self._enter(state)

    def receive(self, frame: Frame) -> None:
        """Handle one frame."""
        if frame.extended:
            return
        if frame.remote:
            self._tpdos.requested(frame.can_id)
        elif self._is_sdo_request(frame):
            self._sdo.receive(frame.data)
        elif frame.can_id == cob_id.NMT:
            self._nmt.receive(frame)
        elif frame.can_id == cob_id.LSS_MASTER:
            if self._lss is not None:
                self._lss.receive(frame.data)
        elif self._is_sync(frame):
            self._tpdos.sync()

    def _is_sdo_request(self, frame: Frame) -> bool:
        if self.node.faults.sdo_serves_other_nodes:
            return cob_id.sdo_request(1) <= frame.can_id <= cob_id.sdo_request(127)
        return frame.can_id == cob_id.sdo_request(self.node.node_id)

    def _is_sync(self, frame: Frame) -> bool:
        if self._sync is None or frame.can_id != self.node.dictionary.number(self._sync) & CAN_ID:
            return False
        try:
            sync.decode(frame)
        except WireError:
            return False
        return True

    def _enter(self, state: NmtState) -> None:
        before = self.node.state
        self.node.state = state
        self.node.dictionary.state = _STATE_NAMES[state]
        if state is NmtState.STOPPED:
            self._sdo.silence()
        self._heartbeat.entered(before)
        self._tpdos.entered(before)
