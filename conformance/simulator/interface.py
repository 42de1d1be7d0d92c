"""The simulated bus as a python-can interface: ``can.Bus(interface="canopen_simulator", …)``."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final

import can

from conformance.errors import SpecError
from conformance.messages import to_frame
from conformance.simulator.bus import SimulatedBus
from conformance.simulator.channel import build_bus, integer, parse_faults, parse_readings, share
from conformance.simulator.rig import SimulatorRig
from conformance.simulator.segment import SECOND
from conformance.simulator.sharing import SharedBus, join, leave
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame

POLITENESS_S: Final = 50e-6
"""On the virtual clock, how long a thread stands back so that another gets at the bus."""


class SimulatorBus(SimulatorRig, can.BusABC):
    """A CAN adapter at a simulated bus.

    Objects with the same channel in one process share one bus until the last is shut down; the
    first one's options build it. On the virtual clock time passes in ``recv`` alone: it goes on
    to the next frame for this object, or by the timeout when there is none.

    Args:
        channel: Nodes of the bus, separated by commas: ``NAME_OR_PATH[:VARIANT][@NODEID]``.
        can_filters: As in python-can.
        variant: Of the device; the spec's first one when None.
        node_id: Of the device; the factory's when None.
        bitrate: Of this adapter in bit/s; the first device's factory bit rate when None.
        readings: ``ID=NUMBER,…`` or a mapping, the readings the devices follow.
        faults: ``NAME,…`` or names and paths, the defects the devices show.
        clock: ``virtual`` or ``real``.
        seed: Of everything random.
        serial_number: Of the first device.
        device_bitrate: That somebody has set the devices to, in bit/s; the factory's when None.
        load: Share of the bus that other nodes take, 0.0 to less than 1.0.
        receive_own_messages: As in python-can.
        unknown: Refused.

    Raises:
        SpecError: An option is wrong.
    """

    def __init__(
        self,
        channel: str,
        can_filters: can.typechecking.CanFilters | None = None,
        *,
        variant: str | None = None,
        node_id: int | str | None = None,
        bitrate: int | str | None = None,
        readings: str | Mapping[str, int] | None = None,
        faults: str | Sequence[str] | None = None,
        clock: str = "virtual",
        seed: int | str = 0,
        serial_number: int | str = 1,
        device_bitrate: int | str | None = None,
        load: float | str = 0.0,
        receive_own_messages: bool | str = False,
        **unknown: Any,
    ) -> None:
        if unknown:
            names = ", ".join(unknown)
            raise SpecError(f"simulated bus: expected options it has, got {names}")
        if clock not in ("virtual", "real"):
            raise SpecError(f"clock: expected virtual or real, got {clock!r}")
        self.channel = channel
        self.channel_info = f"simulated bus {channel}"
        self._receive_own = str(receive_own_messages).lower() in ("true", "1", "yes")
        self._received: deque[tuple[int, Frame, bool]] = deque()

        def build() -> SharedBus:
            bus = build_bus(
                channel,
                variant=variant,
                node_id=None if node_id is None else integer(node_id, "node_id"),
                readings=parse_readings(readings),
                faults=parse_faults(faults),
                seed=integer(seed, "seed"),
                serial_number=integer(serial_number, "serial_number"),
                device_bitrate=None
                if device_bitrate is None
                else integer(device_bitrate, "device_bitrate"),
                load=share(load, "load"),
            )
            return SharedBus(bus, real_time=clock == "real")

        rate = None if bitrate is None else integer(bitrate, "bitrate")
        shared = join(channel, build)
        self._shared = shared
        self._bus = shared.bus
        with shared.lock:
            shared.catch_up()
            shared.note_user()
            self._client = self._bus.connect(self._deliver, rate)
        super().__init__(channel, can_filters)

    def _deliver(self, end_ns: int, frame: Frame, own: bool) -> None:
        if not own or self._receive_own:
            self._received.append((end_ns, frame, own))
            self._shared.wake_others()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 - never blocks
        """Hand a frame over to the bus; no simulated time passes."""
        if msg.is_fd or msg.is_error_frame:
            raise can.CanOperationError(
                "the simulated bus carries classical data and remote frames"
            )
        try:
            frame = to_frame(msg)
        except WireError as error:
            raise can.CanOperationError(str(error)) from error
        shared = self._shared
        with shared.lock:
            self._check_open()
            shared.catch_up()
            shared.note_user()
            self._bus.send(self._client, frame)
            shared.wake_others()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Return the next frame.

        Args:
            timeout: In seconds, simulated ones on the virtual clock; None to wait for ever.

        Returns:
            The frame, None after the timeout.
        """
        shared = self._shared
        with shared.lock:
            shared.note_user()
            message = self._recv_real(timeout) if shared.real_time else self._recv_virtual(timeout)
        if shared.crowded and not shared.real_time:
            time.sleep(POLITENESS_S)
        return message

    def _recv_virtual(self, timeout: float | None) -> can.Message | None:
        shared, bus = self._shared, self._bus
        limit_ns = None if timeout is None else bus.now_ns + round(max(timeout, 0.0) * SECOND)
        while True:
            self._check_open()
            if self._received and (message := self._next_message()) is not None:
                return message
            if shared.crowded and shared.others_busy(_earlier(bus.next_event_ns(), limit_ns)):
                continue
            if bus.advance(limit_ns):
                continue
            if limit_ns is not None:
                return None
            shared.wait(None)

    def _recv_real(self, timeout: float | None) -> can.Message | None:
        shared, bus = self._shared, self._bus
        limit_s = None if timeout is None else time.monotonic() + timeout
        while True:
            self._check_open()
            shared.catch_up()
            message = self._next_message()
            if message is not None:
                return message
            waits = []
            if limit_s is not None:
                waits.append(limit_s - time.monotonic())
                if waits[0] <= 0:
                    return None
            event_ns = bus.next_event_ns()
            if event_ns is not None:
                waits.append((event_ns - bus.now_ns) / SECOND)
            shared.wait(min(waits) if waits else None)

    def _next_message(self) -> can.Message | None:
        while self._received:
            end_ns, frame, own = self._received.popleft()
            message = to_simulated_message(end_ns, frame, self.channel, own=own)
            if self._filters is None or self._matches_filters(message):
                return message
        return None

    @property
    def real_time(self) -> bool:
        """Simulated time follows the clock of the computer."""
        return self._shared.real_time

    def now(self) -> float:
        """Return the simulated time in seconds; message timestamps are of the same clock."""
        if self._is_shutdown or self._shared.real_time:
            self._check_open()
            with self._shared.lock:
                self._shared.catch_up()
        return self._bus.now_ns / SECOND

    def use_bitrate(self, bitrate: int) -> None:
        """Send and receive at another bit rate from now on, in bit/s."""
        with self._shared.lock:
            self._client.bitrate = bitrate

    def flush_tx_buffer(self) -> None:
        """Discard the frames handed over and not yet begun."""
        with self._shared.lock:
            self._bus.flush(self._client)

    def shutdown(self) -> None:
        """Leave the bus; it ends with the last object of its channel."""
        if self._is_shutdown:
            return
        super().shutdown()
        with self._shared.lock:
            self._bus.disconnect(self._client)
            self._shared.changed.notify_all()
        leave(self.channel, self._shared)

    def _check_open(self) -> None:
        if self._is_shutdown:
            raise can.CanOperationError(f"{self.channel_info} is shut down")

    @contextmanager
    def present(self) -> Iterator[SimulatedBus]:
        """Hold the bus, caught up with its clock; the waiting threads are woken afterwards."""
        with self._shared.lock:
            self._check_open()
            self._shared.catch_up()
            self._shared.note_user()
            yield self._bus
            self._shared.wake_others()


def to_simulated_message(end_ns: int, frame: Frame, channel: str, *, own: bool) -> can.Message:
    """Return a frame of a simulated bus as python-can has it.

    Args:
        end_ns: Its end, on the bus' clock.
        frame: The frame.
        channel: Of the bus.
        own: The receiver sent it itself.
    """
    return can.Message(
        timestamp=end_ns / SECOND,
        arbitration_id=frame.can_id,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        channel=channel,
        dlc=frame.dlc,
        data=frame.data,
        is_rx=not own,
    )


def _earlier(first_ns: int | None, second_ns: int | None) -> int | None:
    if first_ns is None or second_ns is None:
        return second_ns if first_ns is None else first_ns
    return min(first_ns, second_ns)
