"""The firmware between two resets: all services of the node, and which frame goes to which."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, Protocol

from conformance.simulator.bus_errors import BusErrors
from conformance.simulator.cob_id_rules import CAN_ID, guard_cob_ids
from conformance.simulator.emcy import EmcyProducer
from conformance.simulator.filters import follow_filters
from conformance.simulator.heartbeat import HeartbeatProducer
from conformance.simulator.live import LiveValues, World
from conformance.simulator.lss import LssSlave, LssTarget
from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.nmt import NmtSlave
from conformance.simulator.node import Node
from conformance.simulator.overrun import ReceiveBuffer
from conformance.simulator.rules import follow_rules
from conformance.simulator.sdo_server import SdoServer
from conformance.simulator.slopes import follow_slopes
from conformance.simulator.store import ParameterStore
from conformance.simulator.supply import SupplyMonitor
from conformance.simulator.tpdo import TpdoProducer
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, StateName
from conformance.spec.services import LightCondition
from conformance.wire import cob_id, sync
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState, decode_heartbeat

_STATE_NAMES: Final[dict[NmtState, StateName]] = {
    NmtState.PRE_OPERATIONAL: "pre-operational",
    NmtState.OPERATIONAL: "operational",
    NmtState.STOPPED: "stopped",
}

_SYNC_PERIOD_NS: Final = 100_000_000
"""Of a device that generates SYNC by a defect."""

_MS: Final = 1_000_000


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
        self._nmt_spec = services.nmt
        live = LiveValues(hardware.world, node.dictionary, node.faults)
        follow_slopes(node, live, spec)
        follow_filters(node, live, hardware.world, spec)
        ParameterStore(node, hardware.memory, services)
        guard_cob_ids(node, services)
        self._sync = services.sync_consumer
        self._nmt = NmtSlave(node, self._enter, reset)
        self._sdo = SdoServer(node, services.sdo_server)
        self._heartbeat = HeartbeatProducer(node, services.heartbeat_producer)
        self._tpdos = TpdoProducer(node, services.tpdo)
        self.emcy = EmcyProducer(node, spec, live, hardware.memory, self._enter)
        self.bus_errors = BusErrors(node, services.bus_errors, self.emcy)
        self._buffer = ReceiveBuffer(node, services, spec.bitrate, self.emcy, reset)
        self._supply = SupplyMonitor(node, services, hardware.world, self.emcy, reset)
        follow_rules(node, spec, partial(reset, NmtCommand.RESET_NODE), self.emcy.has_error)
        self._lss = None if services.lss is None else LssSlave(node, spec, services.lss, hardware)

    def boot(self, *, power_on: bool) -> None:
        """Send the boot-up message and enter Pre-operational, or the state it starts in."""
        self._heartbeat.boot()
        if self.node.faults.sync_generated:
            self._generate_sync()
        self._enter(NmtState.PRE_OPERATIONAL)
        self.emcy.boot()
        if self._starts_by_itself(power_on=power_on):
            self._enter(NmtState.OPERATIONAL)

    def _starts_by_itself(self, *, power_on: bool) -> bool:
        rule = None if self.node.faults.start_object_ignored else self._nmt_spec.start_by
        if rule is not None and (power_on or rule.after == "every-start"):
            word = self.node.dictionary.number(*key_of(rule.object))
            if word & rule.mask == rule.value:
                return True
        return self._nmt_spec.automatic_start or self.node.faults.starts_operational

    def resume(self, state: NmtState) -> None:
        """Go on in a state, without a boot-up message."""
        self._heartbeat.resume()
        self._enter(state)

    def world_changed(self) -> None:
        """Find out what the physical values are now."""
        self.emcy.update()
        self._supply.update()

    def receive(self, frame: Frame) -> None:
        """Handle one frame."""
        if not self._buffer.takes():
            return
        if frame.extended or frame.remote:
            self._receive_unusual(frame)
        elif self._is_sdo_request(frame):
            self._sdo.receive(frame.data)
        elif frame.can_id == cob_id.NMT:
            self._nmt.receive(frame)
        elif frame.can_id == cob_id.LSS_MASTER:
            if self._lss is not None:
                self._lss.receive(frame.data)
        elif self._is_sync(frame):
            self._synchronise(frame)
        else:
            self._overhear(frame)

    def _overhear(self, frame: Frame) -> None:
        """Handle a frame for others, which means something to a defective device alone."""
        self._heartbeat.overheard()
        if self.node.faults.follows_other_heartbeats and _tells_stopped(frame):
            self._enter(NmtState.STOPPED)

    def _receive_unusual(self, frame: Frame) -> None:
        """Handle a remote frame, or one with a 29-bit identifier."""
        if "hears-any-frame" in self.node.faults.sdo_habits and self._is_sdo_request(frame):
            self._sdo.receive(frame.data.ljust(8, b"\0"))
        elif frame.extended:
            if self.node.faults.sync_takes_extended and frame.can_id == self._sync_id():
                self._tpdos.sync()
        elif frame.can_id == cob_id.heartbeat(self.node.node_id):
            self._heartbeat.requested()
        else:
            self._tpdos.requested(frame.can_id)

    def light_conditions(self) -> set[LightCondition]:
        """Return what of the conditions that lights show holds now."""
        holding: set[LightCondition] = {"no-error", self.node.dictionary.state}
        if self.emcy.beyond_limits:
            holding.add("angle-limit")
        if self._lss is not None and self._lss.configuring:
            holding.add("lss-configuration")
        return holding

    def _is_sdo_request(self, frame: Frame) -> bool:
        if self.node.faults.sdo_serves_other_nodes:
            return cob_id.sdo_request(1) <= frame.can_id <= cob_id.sdo_request(127)
        return frame.can_id == cob_id.sdo_request(self.node.node_id)

    def _is_sync(self, frame: Frame) -> bool:
        if self._sync is None or frame.can_id != self._sync_id():
            return False
        if self.node.faults.sync_ends_after_data:
            return True
        try:
            sync.decode(frame)
        except WireError:
            return False
        return True

    def _sync_id(self) -> int:
        index = None if self._sync is None else self._sync.object
        if index is None or self.node.faults.sync_keeps_cob_id:
            return cob_id.SYNC
        return self.node.dictionary.number(index) & CAN_ID

    def _synchronise(self, frame: Frame) -> None:
        if self.node.faults.sync_ends_after_data and frame.data:
            self._sync = None
        else:
            self._tpdos.sync()

    def _generate_sync(self) -> None:
        if self.node.state is not NmtState.STOPPED:
            self.node.send(sync.encode(sync.Sync(), self._sync_id()))
        self.node.agenda.after(_SYNC_PERIOD_NS, self._generate_sync)

    def _enter(self, state: NmtState) -> None:
        before = self.node.state
        self.node.state = state
        self.node.dictionary.state = _STATE_NAMES[state]
        if state is NmtState.STOPPED:
            self._sdo.silence()
        self._heartbeat.entered(before)
        self._tpdos.entered(before)
        self._leave_operational_later()

    def _leave_operational_later(self) -> None:
        """Leave Operational after a while, as only a defective device does."""
        lasts_ms = self.node.faults.leaves_operational_after_ms
        if lasts_ms is not None and self.node.state is NmtState.OPERATIONAL:
            enter = partial(self._enter, NmtState.PRE_OPERATIONAL)
            self.node.agenda.after(lasts_ms * _MS, enter)


def _tells_stopped(frame: Frame) -> bool:
    try:
        return decode_heartbeat(frame).state is NmtState.STOPPED
    except WireError:
        return False
