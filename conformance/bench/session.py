"""An open bench: the link, the node under test, and what is known about its state."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import can

from conformance.bench.bus.link import Link
from conformance.bench.bus.observations import Observations
from conformance.bench.bus.trace import Trace
from conformance.bench.definition import BenchDefinition
from conformance.bench.node.channel import SdoChannel
from conformance.bench.node.node import Node
from conformance.bench.node.reach import Place, Reach
from conformance.bench.node.sdo import MOST_IN_VAIN
from conformance.bench.opening import open_bus
from conformance.bench.services.illegal import Illegal
from conformance.bench.surroundings.exposing import exposings_of
from conformance.bench.surroundings.operator import Operator, operator_of
from conformance.bench.surroundings.power import supply_of
from conformance.bench.surroundings.remote_rig import RemoteRig
from conformance.bench.surroundings.tilting import tilting_of
from conformance.errors import BenchError, ConformanceError, NodeTimeout
from conformance.spec.model import DeviceSpec
from conformance.wire.errors import WireError
from conformance.wire.nmt import NmtCommand
from conformance.wire.sdo import InitiateUpload, InitiateUploadReply, decode_response

SERIAL_NUMBER = (0x1018, 4)
SECOND_ANSWER_S = 0.05
"""How much later another node may answer than the first."""


class Bench:
    """The rig around one device under test.

    Args:
        definition: What the bench is and allows.
        spec: What the device is held against.
        link: The open link to its bus.
    """

    def __init__(self, definition: BenchDefinition, spec: DeviceSpec, link: Link) -> None:
        self.definition = definition
        self.spec = spec
        self.link = link
        self.non_volatile_writes = 0
        self.was_stopped = False
        self.lost_node = False
        self.observations = Observations(link)
        self.illegal = Illegal()
        self._node: Node | None = None
        self.channel = SdoChannel(link, spec.node_id, definition.sdo_timeout_s)
        home = Place(spec.node_id, definition.bitrate or spec.bitrate)
        self.reach = Reach(link, self.channel, spec, home, definition.boot_up_timeout_s)
        self._supply = supply_of(definition, link, lambda: self.operator)
        self.tilting = tilting_of(definition, lambda: self.operator)
        self.exposings = exposings_of(definition, lambda: self.operator)

    @classmethod
    def open(
        cls,
        definition: BenchDefinition,
        spec: DeviceSpec,
        options: Mapping[str, Any],
        trace: Path | None,
    ) -> Bench:
        """Open the bus of a bench.

        Args:
            definition: The bench.
            spec: What the device is held against.
            options: Arguments of the interface beyond those in the bench's file.
            trace: File for the trace.

        Raises:
            BenchError: The interface cannot be opened.
        """
        open_at = partial(open_bus, definition, options=options)
        bitrate = definition.bitrate or spec.bitrate
        link = Link(
            open_at(bitrate),
            Trace(trace),
            bitrate,
            open_at if definition.sets_bitrate else None,
            definition.stamps(),
            RemoteRig(definition.control) if definition.control else None,
        )
        try:
            return cls(definition, spec, link)
        except BenchError:
            link.close()
            raise

    @cached_property
    def operator(self) -> Operator:
        """Who looks at the device."""
        return operator_of(self.definition, self.link)

    def node(self) -> Node:
        """Return the node for the next check."""
        self.look()
        self.link.forget()
        self.channel.begin()
        self._node = Node(
            self.link,
            self.spec,
            self.channel,
            self.definition.boot_up_timeout_s,
            alone="other-nodes" in self.definition.allow,
            supply=self._supply,
        )
        return self._node

    @property
    def worn(self) -> str:
        """Why no check may begin that writes the non-volatile memory, empty if one may."""
        most = self.definition.most_writes
        if most is None or self.non_volatile_writes < most:
            return ""
        return (
            f"{self.non_volatile_writes} writes of the non-volatile memory were made, and the bench "
            f"allows {most} in a run"
        )

    def look(self) -> None:
        """Look at what the node sent and did since the last time, whatever it was for."""
        if self._node is not None:
            self.illegal.look(self.link, self._node)
            self._node = None

    def done(self, node: Node, *, doubtful: bool) -> None:
        """End a check: undo what it did and make sure that the node is still there.

        Args:
            node: The node the check used.
            doubtful: The check did not pass, so the node may have stopped answering.

        Raises:
            NodeTimeout: The node does not answer any more.
        """
        try:
            self._end(node, doubtful=doubtful)
        finally:
            self.non_volatile_writes += node.non_volatile_writes

    def _end(self, node: Node, *, doubtful: bool) -> None:
        self.lost_node = False
        node.restore()
        if doubtful and not node.answers():
            self.lost_node = self.link.simulated is None
            node.recover()
            self.lost_node = not self.definition.tells_of_errors
        self.channel.settle()
        if self.channel.in_vain >= MOST_IN_VAIN:
            raise NodeTimeout(f"node {node.node_id} does not end its uploads")

    def find_node(self, *, several: bool = False) -> None:
        """Make sure that a node is there before anything is judged.

        Args:
            several: More than one may have its node-ID.

        Raises:
            BenchError: Nothing answers on the node's identifier, or two do that must not.
        """
        node = self.node()
        deadline = self.link.now() + self.definition.boot_up_timeout_s
        if node.answers() or node.answers():
            if not several:
                self._require_one(node)
            return
        booting = bool(self.link.since(0, node.is_boot_up))
        node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        while self.link.now() < deadline:
            if node.answers():
                self.was_stopped = not booting
                return
        heard = sorted({f"{f.frame.can_id:03X}h" for f in self.link.since(0, lambda _: True)})
        raise BenchError(
            f"node {self.spec.node_id} does not answer on {self.definition.interface} "
            f"within {self.definition.boot_up_timeout_s:g} s "
            f"(heard on the bus: {', '.join(heard[:8]) or 'nothing'}"
            f"{'; ' if str(self.link.trouble) else ''}{self.link.trouble}); "
            "check power, cable, termination, bit rate and node-ID"
        )

    def _require_one(self, node: Node) -> None:
        """Make sure that no other node has this node-ID, as far as serial numbers tell.

        Raises:
            BenchError: Two answer.
        """
        if self.spec.entry(*SERIAL_NUMBER) is None:
            return
        mark = self.link.mark()
        node.sdo.ask(InitiateUpload(*SERIAL_NUMBER))
        self.link.listen(SECOND_ANSWER_S, lambda _: False)
        heard = self.link.since(mark, self.channel.is_response)
        answers = {it.frame.data for it in heard if _tells_serial_number(it.frame.data)}
        self.channel.begin()
        if len(answers) > 1:
            words = " and ".join(sorted(answer.hex(" ").upper() for answer in answers))
            raise BenchError(
                f"two nodes answer as node {node.node_id}, one with another serial number than the "
                f"other ({words}): connect one at a time, or give them different node-IDs"
            )

    def close(self) -> None:
        """Close the bus; what was recorded is kept even when the adapter is gone."""
        try:
            self.link.close()
        except (can.CanError, OSError, ConformanceError) as error:
            raise BenchError(f"cannot close the bus: {error}") from error


def _tells_serial_number(data: bytes) -> bool:
    """Tell whether an SDO response is one to an upload of the serial number."""
    try:
        reply = decode_response(data)
    except WireError:
        return False
    return isinstance(reply, InitiateUploadReply) and (reply.index, reply.sub) == SERIAL_NUMBER
