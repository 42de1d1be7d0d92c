"""The node under test as a check sees it: set-up, judged SDO, NMT, heartbeats; undone afterwards."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from conformance.bench.bus.link import Link, Stamped
from conformance.bench.node.channel import SdoChannel
from conformance.bench.node.keeping import memory_keys, store_words
from conformance.bench.node.offsets import offset_steps
from conformance.bench.node.sdo import SdoPort, Transfer
from conformance.bench.node.setup_client import SetupClient
from conformance.bench.surroundings.power import Supply
from conformance.errors import NodeTimeout, SetupRefused
from conformance.interrupts import uninterrupted
from conformance.spec.model import DeviceSpec, Entry, Key, address
from conformance.wire import cob_id
from conformance.wire.datatypes import Value
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtRequest, encode_request
from conformance.wire.sdo import InitiateUpload

PROBE = (0x1000, 0)
_PROBES_AFTER_RESET = 10


class Node:
    """The device under test during one check.

    Every download remembers what it overwrites; `restore` writes it back in reverse order, so that
    each step back is as legal as the step it undoes.

    Args:
        link: The link to the bus.
        spec: What the node is held against.
        channel: The node's SDO server.
        boot_up_timeout_s: Longest wait for a boot-up message.
        alone: No other node is on the bus, or all may be disturbed.
        supply: The node's supply; None where nobody may switch it.
    """

    def __init__(
        self,
        link: Link,
        spec: DeviceSpec,
        channel: SdoChannel,
        boot_up_timeout_s: float,
        *,
        alone: bool,
        supply: Supply | None = None,
    ) -> None:
        self.link = link
        self._supply = supply
        self.spec = spec
        self.boot_up_timeout_s = boot_up_timeout_s
        self._alone = alone
        self.channel = channel
        self.sdo = SdoPort(channel, spec)
        self._setup = SetupClient(channel)
        self._undo: list[Callable[[], None]] = []
        self._commanded = False
        self._settled_s = 0.0
        self.was_reset = False
        self.non_volatile_writes = 0
        self._memory_keys = memory_keys(spec)

    @property
    def node_id(self) -> int:
        """The node-ID at which the node is spoken to."""
        return self.channel.node_id

    @property
    def switchable(self) -> bool:
        """The bench can switch the node's supply."""
        return self._supply is not None

    # Set-up: what fails here makes the check inconclusive.

    def upload(self, index: int, sub: int = 0) -> bytes:
        """Return what the node holds; for set-up, judges nothing.

        Octets beyond the documented type are dropped where the node does not say how many count.

        Raises:
            SetupRefused: The node aborted the upload, or its answer is no proper one.
            NodeTimeout: It did not answer.
        """
        transfer = self.sdo.upload(index, sub)
        entry = self.spec.entry(index, sub)
        if transfer.data is None:
            name = entry.address if entry is not None else address(index, sub)
            what = f"node {self.node_id}: upload of {name}: {transfer}"
            if transfer.answered:
                raise SetupRefused(what)
            self.channel.unanswered += 1
            raise NodeTimeout(what)
        if not transfer.sized and entry is not None and entry.type.size is not None:
            return transfer.data[: entry.type.size]
        return transfer.data

    def value(self, index: int, sub: int = 0) -> Value:
        """Return what the node holds as a value of the documented type; for set-up."""
        try:
            return self._entry(index, sub).type.decode(self.upload(index, sub))
        except WireError as error:
            raise SetupRefused(f"{address(index, sub)}: {error}, see OD-03") from error

    def number(self, index: int, sub: int = 0) -> int:
        """Return what the node holds as an integer; for set-up."""
        value = self.value(index, sub)
        if not isinstance(value, int):
            raise TypeError(f"{index:04X}h:{sub:02X} holds no integer")
        return value

    def download(self, index: int, sub: int, value: Value) -> None:
        """Write a value of the documented type; for set-up, undone after the check."""
        data = self._entry(index, sub).type.encode(value)
        before = len(self._undo)
        self._remember(index, sub)
        try:
            self._setup.download(index, sub, data)
        except SetupRefused:
            del self._undo[before:]
            raise
        self._note_write(index, sub)

    def try_download(self, index: int, sub: int, data: bytes) -> Transfer:
        """Download and return what the node made of it, to be judged; undone after the check."""
        before = len(self._undo)
        self._remember(index, sub)
        transfer = self.sdo.download(index, sub, data)
        if transfer.refused:
            del self._undo[before:]
        self._note_write(index, sub)
        return transfer

    def will_change(self, index: int, sub: int) -> None:
        """Note that a download step by step begins, so that what it does is undone after the check."""
        self._remember(index, sub)
        self._note_write(index, sub)

    def write(self, index: int, sub: int, data: bytes) -> Transfer:
        """Download and return what the node made of it; whoever calls undoes it."""
        transfer = self.sdo.download(index, sub, data)
        self._note_write(index, sub)
        return transfer

    def save(self, indices: set[int]) -> None:
        """Store the settings at some indices, where by any reading there is a command for it.

        Raises:
            SetupRefused: The node refuses.
        """
        for (index, sub), word in store_words(self.spec, frozenset(indices)).items():
            self.download(index, sub, word)

    def put_back(self, key: Key, data: bytes) -> None:
        """Write what a check is to leave behind; a step of its undoing.

        Raises:
            SetupRefused: The node refuses.
            NodeTimeout: It does not answer.
        """
        self._setup.download(*key, data)

    def _note_write(self, index: int, sub: int) -> None:
        """Count writes of the non-volatile memory; note until when the node must not be reset."""
        self.non_volatile_writes += (index, sub) in self._memory_keys
        for service in (self.spec.services.store, self.spec.services.restore):
            if service is not None and service.object == index:
                self._settled_s = self.link.now() + service.settle_ms / 1000

    def _settle(self) -> None:
        """Wait until the node may be reset."""
        if (left_s := self._settled_s - self.link.now()) > 0:
            self.link.listen(left_s, lambda _: False)

    def _entry(self, index: int, sub: int) -> Entry:
        entry = self.spec.entry(index, sub)
        if entry is None:
            raise SetupRefused(f"the spec documents no object {index:04X}h:{sub:02X}")
        return entry

    def _remember(self, index: int, sub: int) -> None:
        """Note what a download overwrites; what it affects is written back after it."""
        self._undo += offset_steps(self, (index, sub))
        entry = self.spec.entry(index, sub)
        affected = (self.spec.entry(other) for other in (entry.affects if entry else ()))
        keys = [
            other.key
            for other in affected
            if other is not None and other.writable and other.kind == "config"
            if not other.optional
        ]
        if entry is not None and entry.readable and entry.kind not in ("command", "counter"):
            keys.append((index, sub))
        for key in keys:
            self._undo.append(partial(self.put_back, key, self.upload(*key)))

    # NMT

    def nmt(self, command: int, *, node_id: int | None = None) -> Stamped:
        """Send an NMT command to the node under test, or to another node-ID (0 for all)."""
        target = self.node_id if node_id is None else node_id
        return self.send(encode_request(NmtRequest(command, target)))

    def send(self, frame: Frame) -> Stamped:
        """Send any frame; NMT frames mark the node's state as changed."""
        if frame.can_id == cob_id.NMT:
            self._commanded = True
        return self.link.send(frame)

    def reset(
        self, command: NmtCommand = NmtCommand.RESET_NODE, *, node_id: int | None = None
    ) -> None:
        """Reset the node and wait until it answers again, with or without a boot-up message."""
        mark = self.begin_reset(command, node_id=node_id)
        self.await_boot_up(mark)
        self.hold_back()

    def begin_reset(
        self, command: NmtCommand = NmtCommand.RESET_NODE, *, node_id: int | None = None
    ) -> int:
        """Reset the node without waiting for it; return the mark since which it may be back."""
        self._settle()
        mark = self.link.mark()
        self.nmt(command, node_id=node_id)
        self.was_reset = True
        return mark

    def power_cycle(self) -> None:
        """Take the supply away and give it back, then wait until the node answers."""
        mark = self.begin_power_cycle()
        self.await_boot_up(mark)
        self.hold_back()

    def begin_power_cycle(self) -> int:
        """Take the supply away and give it back; return the mark since which it may be back."""
        supply = self._require_supply()
        self._settle()
        mark = self.link.mark()
        self._switch_off(supply)
        supply.on()
        self.was_reset = True
        return mark

    @contextmanager
    def without_supply(self) -> Iterator[None]:
        """Take the supply away for a while, then wait until the node answers."""
        supply = self._require_supply()
        self._settle()
        self._switch_off(supply)
        try:
            yield
        finally:
            mark = self.link.mark()
            supply.on()
            self.was_reset = True
            self.await_boot_up(mark)
            self.hold_back()

    def _switch_off(self, supply: Supply) -> None:
        """Take the supply away, and make sure that it is gone.

        Raises:
            SetupRefused: The node answers all the same.
        """
        supply.off()
        if not supply.certain and self.answers():
            supply.on()
            raise SetupRefused(
                f"the supply was switched off, and node {self.node_id} still answers: look at what "
                "switches it, and how long it stays off"
            )

    def _require_supply(self) -> Supply:
        if self._supply is None:
            raise SetupRefused("the bench cannot switch the supply")
        return self._supply

    def hold_back(self) -> None:
        """Bring a node that may have started by itself to Pre-operational."""
        for services, _ in self.spec.services_readings:
            if services.nmt.automatic_start or services.nmt.start_by is not None:
                self.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
                return

    def await_boot_up(self, mark: int) -> None:
        """Wait for a boot-up message since a mark; without one, until the node answers.

        Raises:
            NodeTimeout: It does neither.
        """
        if self.link.wait(self.is_boot_up, self.boot_up_timeout_s, mark) is not None:
            return
        for _ in range(_PROBES_AFTER_RESET):
            if self.answers():
                return
        raise NodeTimeout(
            f"node {self.node_id}: neither boot-up nor SDO response within "
            f"{self.boot_up_timeout_s:g} s after a reset"
        )

    def is_boot_up(self, frame: Frame) -> bool:
        """Tell whether a frame is the node's boot-up message (CiA 301 v4.2.0, 7.2.8.3.3)."""
        return self.is_error_control(frame) and frame.data == b"\0"

    def is_error_control(self, frame: Frame) -> bool:
        """Tell whether a frame is on the node's heartbeat identifier."""
        return (
            frame.can_id == cob_id.heartbeat(self.node_id)
            and not frame.remote
            and not frame.extended
        )

    # Being there

    def answers(self) -> bool:
        """Tell whether the node answers an SDO request at all: the sentinel after silence."""
        return self.sdo.ask(InitiateUpload(*PROBE)).received is not None

    @uninterrupted()
    def restore(self) -> None:
        """Undo what the check did to the node.

        Raises:
            NodeTimeout: The node does not answer any more, not even after a reset.
        """
        if self._commanded:
            self.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
            self._commanded = False
        undo, self._undo = self._undo, []
        try:
            for step in reversed(undo):
                step()
        except (SetupRefused, NodeTimeout):
            self.recover()
        self._settle()

    def recover(self) -> None:
        """Bring the node back by resets, then by its supply where the bench can switch it.

        Raises:
            NodeTimeout: It does not answer.
        """
        steps: list[Callable[[], None]] = [self.reset]
        if self._alone:
            steps.append(lambda: self.reset(node_id=0))
        if self.switchable:
            steps.append(self.power_cycle)
        for step in steps:
            try:
                step()
            except (NodeTimeout, SetupRefused):
                continue
            if self.answers():
                return
        late = self.channel.unsolicited
        more = f"; {late} SDO responses came late or unasked" if late else ""
        raise NodeTimeout(
            f"node {self.node_id} does not answer any more within {self.channel.timeout_s:g} s, "
            f"not even after a reset{more}"
        )
