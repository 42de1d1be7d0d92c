"""One of two devices that are taken through the same steps: its bench, its time, what it sent."""

from __future__ import annotations

from dataclasses import dataclass

from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.session import Bench
from conformance.bench.settings.settings import Settings, Values
from conformance.explore.steps import (
    Download,
    Nmt,
    PowerCycle,
    Remote,
    Step,
    Sync,
    Tilt,
    Upload,
    Wait,
    frames,
)
from conformance.spec.model import DeviceSpec
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a step led to.

    Args:
        transfer: Of an upload or download.
        booted: Whether a boot-up message came; None where nothing restarts the node.
    """

    transfer: Transfer | None = None
    booted: bool | None = None


class Side:
    """A device at its bench.

    Args:
        bench: The open bench.
        spec: What the manual says.
    """

    def __init__(self, bench: Bench, spec: DeviceSpec) -> None:
        self.bench = bench
        self._link = bench.link
        self._spec = spec
        self._node = bench.node()
        self._settings: Settings | None = None
        self._origin_s = self._link.time_s
        self._mark = self._link.mark()
        self._alone = bench.definition.allows(["other-nodes"])

    @property
    def elapsed_s(self) -> float:
        """Seconds since this device was started, as long ago as the other one."""
        return self._link.time_s - self._origin_s

    @property
    def surroundings(self) -> bool:
        """What is around the device is known: it is a simulated one."""
        return self._link.rig is not None

    @property
    def unsolicited(self) -> int:
        """SDO responses that nobody asked for."""
        self._node.channel.settle()
        return self._node.channel.unsolicited

    # Beginning and end

    def find(self) -> None:
        """Find a device that was just switched on, in Pre-operational.

        Raises:
            BenchError: There is none.
        """
        if self._link.wait(self._node.is_boot_up, self._node.boot_up_timeout_s) is None:
            self.bench.find_node()
        self._begin(self._link.mark())
        self.command(NmtCommand.ENTER_PRE_OPERATIONAL)

    def begin_with_settings(self) -> Values:
        """Reset a device that is not new and return its settings, which `give_back` gives back.

        Raises:
            SetupRefused: It holds what nothing could give back.
            NodeTimeout: It does not answer.
        """
        self._settings = Settings(self._node)
        self._settings.begin()
        self._begin(self._link.mark())
        return self._settings.found

    def give_back(self) -> None:
        """Give the device back the settings that it began with."""
        if self._settings is not None:
            self.command(NmtCommand.ENTER_PRE_OPERATIONAL)
            self._settings.put_back()
            self._settings = None

    def adopt(self, values: Values) -> None:
        """Take over another device's settings, for good."""
        settings = Settings(self._node)
        settings.begin()
        own = settings.found
        other = {key: data for key, data in values.items() if own.get(key, data) != data}
        if other:
            settings.write(other)
            if self._spec.services.store is not None:
                settings.save()
                self._node.reset()
        self._begin(self._link.mark())

    def close(self) -> None:
        """Close the bench."""
        self.bench.close()

    # Steps

    def do(self, step: Step) -> Outcome:
        """Take the device through a step."""
        match step:
            case Upload(key=key):
                return Outcome(self._node.sdo.upload(*key))
            case Download():
                return self._download(step)
            case Nmt(command=command):
                mark = self._link.mark()
                self.command(command)
                return self._restarted(mark) if step.restarts else Outcome()
            case Sync() | Remote():
                for frame in frames(step, self._node.node_id):
                    self._link.send(frame)
            case Wait(ms=ms):
                self._listen(ms / 1000)
            case PowerCycle():
                return self._restarted(self._node.begin_power_cycle())
            case Tilt(x_deg=x_deg, y_deg=y_deg):
                if self._link.rig is not None:
                    self._link.rig.set_tilt(x_deg, y_deg)
        return Outcome()

    def command(self, command: int) -> None:
        """Send an NMT command to the device."""
        for frame in frames(Nmt(command), self._node.node_id):
            self._node.send(frame)

    def _download(self, step: Download) -> Outcome:
        mark = self._link.mark()
        transfer = self._node.write(*step.key, step.data)
        if step.restarts and transfer.confirmed:
            return Outcome(transfer, self._restarted(mark).booted)
        self._listen(step.settle_s)
        return Outcome(transfer)

    def _restarted(self, mark: int) -> Outcome:
        """Wait for the boot-up message; time begins anew with it."""
        found = self._link.wait(self._node.is_boot_up, self._node.boot_up_timeout_s, mark)
        self._begin(self._link.mark() if found is None else found.place + 1)
        if found is not None:
            self._origin_s = found.time_s
        return Outcome(booted=found is not None)

    def _begin(self, mark: int) -> None:
        self._origin_s, self._mark = self._link.time_s, mark

    # What it sends by itself

    def listen_until(self, elapsed_s: float) -> None:
        """Let time pass until so many seconds after the start."""
        self._listen(elapsed_s - self.elapsed_s)

    def _listen(self, duration_s: float) -> None:
        if duration_s > 0:
            self._link.listen(duration_s, lambda _: False)

    def heard(self) -> list[tuple[Frame, float]]:
        """Return the frames that came since the last time, with the time since the start."""
        new = self._link.since(self._mark, self._is_own)
        self._mark = self._link.mark()
        return [(it.frame, self._since_start(it)) for it in new]

    def _since_start(self, stamped: Stamped) -> float:
        return stamped.time_s - self._origin_s

    def _is_own(self, frame: Frame) -> bool:
        """Tell whether a frame is the device's, and no answer to what it was asked."""
        node_id = self._node.node_id
        if frame.can_id == cob_id.sdo_response(node_id) and not (frame.extended or frame.remote):
            return False
        return self._alone or frame.can_id & 0x7F == node_id

    @property
    def node(self) -> Node:
        """The device's node."""
        return self._node
