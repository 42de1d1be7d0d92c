"""The node's emergency messages: provoked by tilting it beyond its limits and observed on the bus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager

from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.provocations import (
    AnyProvocation,
    BusProvocation,
    Provocation,
    provocations,
)
from conformance.errors import NodeTimeout, SetupRefused
from conformance.spec.document import EmcyProducer
from conformance.spec.model import DeviceSpec, Entry
from conformance.wire import emcy
from conformance.wire.cob_id import is_restricted
from conformance.wire.datatypes import DataType
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand

BEFORE_S = 0.02
"""How long frames sent before the node is tilted have to reach it."""

WINDOW_S = 0.2
"""How long an EMCY is waited for once the node has settled."""

NOT_VALID = 1 << 31
_EXTENDED = 1 << 29
_CAN_ID = 0x7FF


class EmcyPort:
    """EMCY producer of a node.

    Args:
        node: The node under test.
        producer: The spec's EMCY service.
        stimulus: What tilts the node.
    """

    def __init__(self, node: Node, producer: EmcyProducer | None, stimulus: Stimulus) -> None:
        if producer is None:
            raise SetupRefused("the manual documents no EMCY")
        self._node = node
        self.producer = producer
        self._stimulus = stimulus
        self._can_id = 0
        self._was_empty = False
        self._tilts = bool(provocations(node.spec, producer))
        self._disturbed = False
        self._provoked = False
        self._resets = False
        self._destroying = ExitStack()

    @property
    def can_id(self) -> int:
        """The CAN-ID on which EMCY is observed."""
        return self._can_id

    def matches(self, frame: Frame) -> bool:
        """Tell whether a frame is on the identifier of EMCY."""
        return frame.can_id == self._can_id and not frame.remote and not frame.extended

    # COB-ID

    def watch(self) -> int:
        """Observe the CAN-ID that the node's COB-ID object holds, and return the whole COB-ID.

        Raises:
            SetupRefused: It holds none that could be used.
        """
        word = self._node.number(self.producer.object)
        if word & _EXTENDED or is_restricted(word & _CAN_ID):
            raise SetupRefused(f"the COB-ID of EMCY is {word:08X}h, see OD-10")
        self._can_id = word & _CAN_ID
        return word

    @property
    def movable(self) -> bool:
        """The manual lets the COB-ID be written."""
        entry = self._node.spec.entry(self.producer.object)
        return entry is not None and entry.writable

    def disable(self) -> None:
        """Set bit 31 of the COB-ID; for set-up."""
        self._node.download(self.producer.object, 0, self.watch() | NOT_VALID)

    def enable(self) -> None:
        """Clear bit 31 of the COB-ID; for set-up."""
        self._node.download(self.producer.object, 0, self.watch() & ~NOT_VALID)

    def move(self, can_id: int) -> None:
        """Give EMCY another CAN-ID by the procedure of CiA 301 v4.2.0, 7.5.2.17; for set-up."""
        word = self.watch() & ~_CAN_ID | can_id
        self.disable()
        self._node.download(self.producer.object, 0, word | NOT_VALID)
        self.enable()

    def give_bit(self, bit: int, value: int) -> bool:
        """Give a bit of the COB-ID a value, EMCY valid afterwards; tell whether the node takes it."""
        word = self.watch() & ~(1 << bit | NOT_VALID) | value << bit
        self.disable()
        taken = _is_taken(
            self._node.try_download(
                self.producer.object, 0, DataType.UNSIGNED32.encode(word | NOT_VALID)
            )
        )
        self.enable()
        return taken

    def accepted(self, can_ids: range) -> list[int]:
        """Return those of some CAN-IDs that the node takes for EMCY; it is left disabled."""
        word = self.watch() & ~_CAN_ID
        self.disable()
        taken = []
        for can_id in can_ids:
            encoded = DataType.UNSIGNED32.encode(word & ~NOT_VALID | can_id)
            if _is_taken(self._node.sdo.download(self.producer.object, 0, encoded)):
                taken.append(can_id)
                self._node.sdo.download(
                    self.producer.object,
                    0,
                    DataType.UNSIGNED32.encode(word | NOT_VALID | can_id),
                )
        return taken

    # Errors

    def calm(self) -> None:
        """Let the node have no error, and its EMCY valid; it is level where tilting brings one about.

        Raises:
            SetupRefused: It still shows one.
        """
        self._was_empty = self.count() == 0
        self._disturbed = self._provoked = True
        self.watch()
        self.end()
        if self.present():
            raise SetupRefused("the node shows an error without one to be seen")
        if self.watch() & NOT_VALID:
            self.enable()

    def begin(self, *, reset: bool = False) -> None:
        """Be ready for errors that tilting has nothing to do with.

        Args:
            reset: What is still an error afterwards is ended by a reset.

        Raises:
            SetupRefused: There is one already.
        """
        self._was_empty = self.count() == 0
        self._disturbed, self._resets = True, reset
        if self.watch() & NOT_VALID:
            self.enable()
        if self.present():
            raise SetupRefused("the node shows an error already")

    def provoke(self, *errors: AnyProvocation) -> list[Stamped]:
        """Let exactly these errors be present, and return the EMCYs that come."""
        if any(isinstance(error, BusProvocation) for error in errors):
            self._node.link.listen(BEFORE_S, self.matches)
            mark = self._node.link.mark()
            self._destroying.enter_context(self._stimulus.bus_error("error-passive"))
            self._node.link.listen(WINDOW_S, self.matches)
            return self._node.link.since(mark, self.matches)
        tilts = [error for error in errors if isinstance(error, Provocation)]
        return self.tilt(
            {error.axis: error.beyond_deg(self._stimulus.tolerance_deg) for error in tilts}
        )

    def tilt(self, angles: Mapping[str, float]) -> list[Stamped]:
        """Tilt the node, level where no angle is given, and return the EMCYs that come."""
        self._node.link.listen(BEFORE_S, self.matches)
        mark = self._node.link.mark()
        self._stimulus.tilt(angles.get("tilt-x", 0.0), angles.get("tilt-y", 0.0))
        self._node.link.listen(WINDOW_S, self.matches)
        return self._node.link.since(mark, self.matches)

    def relieve(self) -> list[Stamped]:
        """Let no error be present any more, and return the EMCYs that come."""
        mark = self._node.link.mark()
        self._destroying.close()
        if self._tilts:
            return self.provoke()
        self._node.link.listen(WINDOW_S, self.matches)
        return self._node.link.since(mark, self.matches)

    def end(self) -> None:
        """Relieve the node; where an error may last until a reset, reset a node that has one."""
        self.relieve()
        if self.may_last and self.present():
            self._node.reset()

    @property
    def may_last(self) -> bool:
        """The manual also reads as if an error lasted until a reset, or says nothing of it."""
        return may_last(self._node.spec) or not self._tilts

    def present(self) -> bool:
        """Tell whether the error register or the manufacturer's code shows an error."""
        place = self.producer.manufacturer_code
        code = 0 if place is None else self._node.number(place.object)
        return bool(self.register()) or any(code >> bit & 1 for bit in self._bits())

    def _bits(self) -> set[int]:
        """Return the bits that errors of the angle have in the manufacturer's code."""
        return {
            cause.bit
            for services, _ in self._node.spec.services_readings
            if services.emcy_producer is not None
            for cause in services.emcy_producer.causes
            if cause.bit is not None
        }

    def listen(self, duration_s: float) -> list[Stamped]:
        """Receive for a while and return the EMCYs."""
        return self._node.link.listen(duration_s, self.matches)

    def register(self) -> int:
        """Return the error register; 0 where the manual has none."""
        index = self.producer.error_register
        return 0 if index is None else self._node.number(index)

    def leave(self) -> None:
        """Bring everything back; a history that was empty is emptied again."""
        if not self._disturbed:
            return
        self._destroying.close()
        self._node.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
        self._disturbed = False
        try:
            if self._provoked:
                self.end()
                self._stimulus.rest()
            elif self._resets:
                self._stimulus.rest()
                if self.present():
                    self._node.reset()
            history = self._place(0)
            if self._was_empty and history is not None and self.count():
                if history.writable:
                    self._node.sdo.download(history.index, 0, history.type.encode(0))
                elif cleared_by_reset(self._node.spec):
                    self._node.reset()
        except (SetupRefused, NodeTimeout):
            self._stimulus.rest()

    # History

    def _place(self, sub: int) -> Entry | None:
        index = self.producer.history
        return None if index is None else self._node.spec.entry(index, sub)

    def count(self) -> int:
        """Return the number of errors in the history; 0 where the manual has none."""
        index = self.producer.history
        return 0 if index is None else self._node.number(index, 0)

    def past(self, most: int) -> list[int]:
        """Return the error codes in the history, from sub-index 1 on; for set-up."""
        index = self.producer.history
        if index is None:
            return []
        return [
            self._node.number(index, sub) & 0xFFFF for sub in range(1, min(self.count(), most) + 1)
        ]


@contextmanager
def errors_to_come(
    node: Node, stimulus: Stimulus, *, reset: bool = False
) -> Iterator[EmcyPort | None]:
    """Let errors come; a history that was empty is emptied again.

    Args:
        node: The node under test.
        stimulus: What is around it.
        reset: What is still an error afterwards is ended by a reset.

    Yields:
        The EMCY producer, where the manual has one.
    """
    producer = node.spec.services.emcy_producer
    if producer is None:
        yield None
        return
    port = EmcyPort(node, producer, stimulus)
    port.begin(reset=reset)
    try:
        yield port
    finally:
        port.leave()


def may_last(spec: DeviceSpec) -> bool:
    """Tell whether a reading has an error last until a reset."""
    return any(
        services.emcy_producer is not None and services.emcy_producer.lasts == "until-reset"
        for services, _ in spec.services_readings
    )


def decoded(seen: Stamped) -> emcy.Emergency:
    """Return an EMCY's content; for set-up.

    Raises:
        SetupRefused: It has not the octets of one.
    """
    try:
        return emcy.decode(seen.frame)
    except WireError as error:
        raise SetupRefused(f"{error}, see EMCY-04") from error


def cleared_by_reset(spec: DeviceSpec) -> bool:
    """Tell whether a reset is all that empties the history."""
    producer = spec.services.emcy_producer
    count, *places = spec.subs(producer.history) if producer and producer.history else (None,)
    return count is not None and not count.writable and not any(it.persistent for it in places)


def depths(spec: DeviceSpec, index: int) -> set[int]:
    """Return how many errors the history may keep: its sub-indices under each reading."""
    places = [entry for entry in spec.subs(index) if entry.sub]
    counts = {sum(not entry.optional for entry in places)}
    others = {(a.ambiguity, a.reading) for entry in places for a in entry.alternatives}
    for reading in others:
        optional = 0
        for entry in places:
            read = next(
                (a.entry for a in entry.alternatives if (a.ambiguity, a.reading) == reading), entry
            )
            optional += read.optional
        counts.add(len(places) - optional)
    return counts


def _is_taken(transfer: Transfer) -> bool:
    """Tell whether the node took a COB-ID.

    Raises:
        NodeTimeout: It did not answer, which is no refusal.
    """
    if not transfer.answered:
        raise NodeTimeout(f"download of a COB-ID: {transfer}")
    return transfer.confirmed
