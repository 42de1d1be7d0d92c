"""A simulated CANopen device, sans-IO: frames and time in, frames out."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from conformance.errors import SpecError
from conformance.simulator import identity
from conformance.simulator.agenda import Agenda
from conformance.simulator.defaults import unstated_values
from conformance.simulator.dictionary import ObjectDictionary
from conformance.simulator.faults import Faults
from conformance.simulator.firmware import Firmware
from conformance.simulator.lapses import Lapses
from conformance.simulator.lights import is_lit
from conformance.simulator.live import World
from conformance.simulator.memory import NonVolatileMemory
from conformance.simulator.node import Node
from conformance.spec.bit_rates import documented_rates
from conformance.spec.error_services import BusError
from conformance.spec.load import SpecFile
from conformance.spec.model import Key, address
from conformance.spec.resolve import chosen_readings
from conformance.wire import cob_id
from conformance.wire.datatypes import Value
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand

BOOT_NS = 200_000_000
"""From power-on or NMT reset node to the boot-up message."""

RESET_COMMUNICATION_NS = 20_000_000
"""From NMT reset communication to the boot-up message."""

COMMUNICATION = range(0x1000, 0x2000)
"""The indices that NMT reset communication sets back (CiA 301 v4.2.0, 7.3.2.2.1)."""

EVERYTHING = range(0x10000)


class SimulatedDevice:
    """A device that behaves as its spec says, apart from its faults.

    Args:
        spec_file: The device spec.
        variant: The file's first one when None.
        node_id: 1..127; the factory's when None.
        readings: Ambiguity id to reading number.
        faults: Defects to show.
        seed: Of everything random.
        serial_number: UNSIGNED32.
        bitrate: That somebody has set it to, in bit/s; the factory's when None.

    Raises:
        SpecError: There is no such variant, node-ID or reading, or no CAN controller has this bit rate.
    """

    def __init__(
        self,
        spec_file: SpecFile,
        *,
        variant: str | None = None,
        node_id: int | None = None,
        readings: Mapping[str, int] | None = None,
        faults: Faults | None = None,
        seed: int = 0,
        serial_number: int = 1,
        bitrate: int | None = None,
    ) -> None:
        if bitrate is not None and not identity.usable_bitrate(bitrate):
            raise SpecError(f"bit rate: expected 10000..1000000 bit/s, got {bitrate}")
        # every reading named, so that no alternatives have to be worked out
        self._readings = chosen_readings(spec_file.document.ambiguities, readings)
        self.faults = faults or Faults()
        self._made = spec_file
        self._file = spec_file.changed(self.faults.changes)
        self.spec = self._file.resolve(variant, node_id, self._readings)
        self.bitrate = bitrate or self.spec.bitrate
        self.memory = NonVolatileMemory(serial_number, self.spec.node_id, self.bitrate)
        identity.remember_node_id(self.spec, self.memory, self.spec.node_id)
        if bitrate is not None or self.bitrate in documented_rates(self.spec):
            identity.remember_bitrate(self.spec, self.memory, self.bitrate)
        self.world = World()
        self.powered = False
        self._random = random.Random(seed)  # noqa: S311 - repeatable defects, no secrets
        self._agenda = Agenda()
        self._firmware: Firmware | None = None
        self._lapses = Lapses(self.faults.lapses)
        self._pending_node_id: int | None = None
        self._bus_error: BusError | None = None
        self._outbox: list[Frame] = []
        self._sent = 0

    @property
    def node_id(self) -> int:
        """The node-ID in force."""
        return self.spec.node_id

    @property
    def deadline_ns(self) -> int | None:
        """When the device next wants to be stepped, None when only a frame can wake it."""
        return self._agenda.deadline_ns

    def twin(self, serial_number: int) -> SimulatedDevice:
        """Return another device like this one as it left the factory, with its node-ID and bit rate."""
        return SimulatedDevice(
            self._file,
            variant=self.spec.variant,
            node_id=self.node_id,
            readings=self._readings,
            faults=self.faults,
            serial_number=serial_number,
            bitrate=self.bitrate,
        )

    def use_faults(self, faults: Faults) -> None:
        """Show other defects from the next start on, as another firmware would; to be switched off."""
        self.faults = faults
        self._file = self._made.changed(faults.changes)
        self._lapses = Lapses(faults.lapses)
        self.spec = self._file.resolve(self.spec.variant, self.node_id, self._readings)

    def held(self) -> dict[str, Any]:
        """Return what the device holds: node-ID, bit rate, non-volatile memory, changed values.

        Of what is stored, what differs from the defaults.
        """
        running = {} if self._firmware is None else self._firmware.node.dictionary.changed()
        stored = asdict(self.memory)
        for name in ("values", "agreed"):
            stored[name] = self._unlike_default(stored[name])
        stored["node_id"] = identity.configured_node_id(self.spec, self.memory)
        stored["bitrate"] = identity.configured_bitrate(self.spec, self.memory)
        stored["defaults_once"] = sorted(address(*key) for key in stored["defaults_once"])
        return {
            "node_id": self.node_id,
            "bitrate": self.bitrate,
            "memory": stored,
            "changed": self._unlike_default(running),
        }

    def _unlike_default(self, values: Mapping[Key, Value | None]) -> dict[str, object]:
        entries = self.spec.entries
        return {
            address(*key): value.hex() if isinstance(value, bytes) else value
            for key, value in sorted(values.items())
            if value is not None and value != entries[key].default
        }

    def power_on(self, now_ns: int) -> None:
        """Switch the supply on."""
        if not self.powered:
            self.powered = True
            self._sent = 0
            self._agenda.now_ns = now_ns
            self._start(EVERYTHING, {}, power_on=True)

    def power_off(self) -> None:
        """Switch the supply off; only the non-volatile memory remains."""
        self.powered = False
        self._pending_node_id = None
        self._bus_error = None
        self._halt()
        self._forget()

    def step(self, now_ns: int, frames: Sequence[Frame] = ()) -> list[Frame]:
        """Let time pass up to ``now_ns`` and then take in frames.

        Args:
            now_ns: Never earlier than in the call before.
            frames: Received at ``now_ns``, in order.

        Returns:
            The frames to send now, in order.
        """
        if not self.powered:
            return []
        self._agenda.run(now_ns)
        if self._bus_error == "bus-off":
            self._outbox.clear()
            return []
        for frame in frames:
            if self._firmware is not None:
                self._lapses.hear(frame, self.node_id)
                self._firmware.receive(frame)
                self._lapse()
                if self.faults.garbage:
                    self._babble()
        if not self._outbox:
            return []
        sent, self._outbox = self._outbox, []
        return sent

    def tilt(self, x_deg: float, y_deg: float) -> None:
        """Be tilted."""
        self.world.tilt(x_deg, y_deg, self._agenda.now_ns)
        self.world_changed()

    def rest(self) -> None:
        """Be brought back to where everything was at first."""
        self.world.rest(self._agenda.now_ns)
        self.world_changed()

    def world_changed(self) -> None:
        """Take note of new physical values; the next step sends what follows from them."""
        if self._firmware is not None:
            self._firmware.world_changed()

    def lit(self, light: str, now_ns: int) -> bool:
        """Tell whether a light is lit; during the initialisation none is."""
        holding = self._firmware.light_conditions() if self._firmware is not None else set()
        if self._bus_error is not None:
            holding.add("bus-off" if self._bus_error == "bus-off" else "warning-limit")
        if not self.powered:
            holding = {"supply-off"}
        return is_lit(self.spec.services.leds, self.faults, light, holding, now_ns)

    def disturb(self, error: BusError) -> None:
        """Count errors on the bus until the counters have come so far."""
        self._bus_error = error
        if self._firmware is not None and error == "error-passive":
            self._firmware.bus_errors.passive()

    def end_disturbance(self) -> None:
        """Count no more errors; a node in bus-off stays there unless it leaves by itself."""
        error = self._bus_error
        stays = self._firmware is not None and not self._firmware.bus_errors.recovers
        if error == "bus-off" and stays:
            return
        self._bus_error = None
        if self._firmware is not None and error is not None:
            self._firmware.bus_errors.over(error)

    def raise_error(self, code: int, bit: int | None = None) -> None:
        """Let an error occur: its emergency error code, its bit of the manufacturer code."""
        if self._firmware is not None:
            self._firmware.emcy.raise_error(code, bit)

    def clear_error(self, code: int, bit: int | None = None) -> None:
        """Let an error go."""
        if self._firmware is not None:
            self._firmware.emcy.clear_error(code, bit)

    def lss_node_id(self, node_id: int) -> None:
        """Use a node-ID from the next NMT reset on, until the supply is switched off."""
        self._pending_node_id = node_id
        if self.faults.lss_node_id_at_once:
            self._agenda.after(identity.SWITCH_DELAY_NS, lambda: self._use_node_id(node_id))

    def lss_bitrate(self, bitrate: int) -> None:
        """Use a bit rate now."""
        if identity.usable_bitrate(bitrate):
            self.bitrate = bitrate

    def lss_store(self, node_id: int | None, bitrate: int | None) -> None:
        """Keep what was configured in the non-volatile memory."""
        if node_id is not None:
            identity.remember_node_id(self.spec, self.memory, node_id)
        if bitrate is not None:
            identity.remember_bitrate(self.spec, self.memory, bitrate)

    def _send(self, frame: Frame) -> None:
        limit = self.faults.dies_after_frames
        if self.faults.silent or (limit is not None and self._sent >= limit):
            return
        if self.faults.garbage and frame.can_id == cob_id.sdo_response(self.node_id):
            return
        if self._lapses.loses(frame, self.node_id):
            return
        self._sent += 1
        self._outbox.append(frame)

    def _lapse(self) -> None:
        if self._firmware is not None:
            self._lapses.act(self._firmware.node.dictionary)

    def _babble(self) -> None:
        for _ in range(self._random.randint(1, 3)):
            data = self._random.randbytes(self._random.randint(0, 8))
            self._outbox.append(Frame(cob_id.sdo_response(self.node_id), data))

    def _halt(self) -> None:
        self._firmware = None
        self._outbox.clear()
        self._agenda.clear()

    def _forget(self) -> None:
        """Lose what only a defective device loses with its supply."""
        if self.faults.store_lost_at_power_off:
            self.memory.values.clear()
            identity.remember_node_id(self.spec, self.memory, self.node_id)
        if self.faults.restore_lost_at_power_off:
            self.memory.defaults_once.clear()

    def _reset(self, command: NmtCommand) -> None:
        assert self._firmware is not None  # it asked for the reset
        partial_reset = (
            command is NmtCommand.RESET_COMMUNICATION
            and self.spec.services.nmt.reset_communication == "communication"
            and not self.faults.reset_communication_resets_all
        )
        scope = COMMUNICATION if partial_reset else EVERYTHING
        values = self._firmware.node.dictionary.changed()
        if not self.faults.reset_keeps_values:
            values = {key: value for key, value in values.items() if key[0] not in scope}
        self._halt()
        self._start(scope, values)

    def _start(self, scope: range, kept: Mapping[Key, Value], *, power_on: bool = False) -> None:
        """Initialise.

        Args:
            scope: Indices that are set back to what is stored.
            kept: Values that outlive the reset.
            power_on: The supply was switched on.
        """
        everything = scope is EVERYTHING
        settled = identity.settle_pairs(
            self.spec, self.memory, one_is_enough=self.faults.pair_needs_one
        )
        kept = {key: value for key, value in kept.items() if key not in settled}
        node_id, bitrate = self.node_id, self.bitrate
        if power_on or identity.changes_at_reset(self.spec.services.node_id):
            node_id = identity.configured_node_id(self.spec, self.memory)
        if power_on or (everything and identity.changes_at_reset(self.spec.services.bitrate)):
            bitrate = identity.configured_bitrate(self.spec, self.memory)
        if self.faults.node_id_change != "never":
            self._use_spec(self._pending_node_id or node_id)
        if self.node_id == identity.configured_node_id(self.spec, self.memory):
            self._pending_node_id = None
        if self.faults.bitrate_change != "never":
            self.bitrate = bitrate
        delay_ns = BOOT_NS if everything else RESET_COMMUNICATION_NS
        delay_ns = round(delay_ns * self.faults.boot_time_factor)
        self._agenda.after(delay_ns, lambda: self._boot(scope, kept, power_on=power_on))

    def _boot(self, scope: range, kept: Mapping[Key, Value], *, power_on: bool) -> None:
        firmware = self._run({**self.memory.start_values(scope), **kept})
        dictionary = firmware.node.dictionary
        for key, entry in dictionary.entries.items():
            if entry.leaves_canopen and dictionary.number(*key) in entry.leaves_canopen:
                self._halt()
                return
        self._lapse()
        firmware.boot(power_on=power_on)

    def _run(self, values: Mapping[Key, Value]) -> Firmware:
        dictionary = ObjectDictionary(
            self.spec.entries, self.memory.serial_number, self.faults, unstated_values(self.spec)
        )
        dictionary.load(values)
        node = Node(self.node_id, dictionary, self._agenda, self.faults, self._send, self._random)
        self._firmware = Firmware(self.spec, node, self, self._reset)
        identity.observe_identity(node, self.spec, self.memory, self._use_node_id, self.lss_bitrate)
        return self._firmware

    def _use_spec(self, node_id: int) -> None:
        if node_id != self.spec.node_id:
            before = self.spec
            self.spec = self._file.resolve(before.variant, node_id, self._readings)
            if not self.faults.own_cob_ids_stay:
                self.memory.values = identity.moved(self.memory.values, before, self.spec)

    def _use_node_id(self, node_id: int) -> None:
        """Change the node-ID of the running node."""
        if node_id == self.node_id or not identity.usable_node_id(node_id):
            return
        assert self._firmware is not None  # its download asked for the change
        node, before = self._firmware.node, self.spec
        self._halt()
        self._use_spec(node_id)
        values = identity.moved(node.dictionary.changed(), before, self.spec)
        self._run(values).resume(node.state)
