"""What a node does that keeps a run from conforming, whatever is being judged meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

from conformance.bench.bus.link import Link, Stamped
from conformance.bench.node.node import Node
from conformance.wire import cob_id, lss
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtState

_STATES = frozenset(NmtState)
_TOGGLE = 0x80
"""Node guarding alternates this bit (CiA 301 v4.2.0, 7.2.8.3.2.1)."""

_NO_RESETS = (NmtCommand.START, NmtCommand.STOP, NmtCommand.ENTER_PRE_OPERATIONAL)
_RESTARTS_NOTHING = (range(0x1000, 0x1F00), range(0x6000, 0xA000))
"""Where objects lie that a write changes and nothing more, but for some."""

_MAY_RESTART = (0x100B, 0x1010, 0x1011)
"""Node-ID, store and restore."""


@dataclass(slots=True)
class Illegal:
    """What no check needs to have looked at.

    A run in which there was some does not conform, even if none of its items has to do with it.

    Attributes:
        error_control: Frames on the node's heartbeat identifier that show no NMT state.
        unsolicited: SDO responses that no request was waiting for.
        improper: SDO responses that answer another request, or have not 8 octets.
        lss: LSS responses that have not 8 octets, or a command specifier of no slave.
        restarts: Boot-up messages that nothing the bench did had led to.
        unanswered: SDO requests of the set-up without a response.
    """

    error_control: int = 0
    unsolicited: int = 0
    improper: int = 0
    lss: int = 0
    restarts: int = 0
    unanswered: int = 0
    _interventions: int = 0
    _boot_up_due: bool = True

    def look(self, link: Link, node: Node) -> None:
        """Look at the frames since the link last forgot, and at what the node's channel counted so far."""
        error_control = link.since(0, node.is_error_control)
        self.error_control += sum(not shows_state(it.frame) for it in error_control)
        self._count_restarts(link, node, [it for it in error_control if node.is_boot_up(it.frame)])
        self.lss += len(link.since(0, _is_improper_lss))
        channel = node.channel
        self.unsolicited, self.improper = channel.unsolicited, channel.improper
        self.unanswered = channel.unanswered

    def _count_restarts(self, link: Link, node: Node, boot_ups: list[Stamped]) -> None:
        causes = [it.place for it in link.sent(_may_restart)]
        if node.was_reset or link.interventions != self._interventions:
            causes.insert(0, 0)
        self._interventions = link.interventions
        if not self._boot_up_due:
            first = causes[0] if causes else link.mark()
            self.restarts += sum(it.place < first for it in boot_ups)
        if boot_ups or causes:
            last = boot_ups[-1].place if boot_ups else -1
            self._boot_up_due = any(place > last for place in causes) or (
                self._boot_up_due and not boot_ups
            )

    def __str__(self) -> str:
        illegal = (
            _many(self.unsolicited, "SDO response", "that nobody asked for"),
            _many(self.improper, "SDO response", "that cannot answer what was asked"),
            _many(self.error_control, "heartbeat", "that shows no NMT state"),
            _many(self.lss, "LSS response", "that no slave gives"),
        )
        sent = ", ".join(word for word in illegal if word)
        words = (
            f"the node sent what no node may: {sent}" if sent else "",
            _times(self.restarts, "the node restarted by itself"),
            _times(self.unanswered, "the node left a request of the set-up unanswered"),
        )
        return "; ".join(word for word in words if word)


def shows_state(frame: Frame) -> bool:
    """Tell whether a frame on a heartbeat identifier shows an NMT state."""
    return len(frame.data) == 1 and frame.data[0] & ~_TOGGLE in _STATES


def _is_improper_lss(frame: Frame) -> bool:
    if frame.can_id != cob_id.LSS_SLAVE or frame.remote or frame.extended:
        return False
    try:
        lss.decode_slave(frame.data)
    except WireError:
        return True
    return False


def _may_restart(frame: Frame) -> bool:
    """Tell whether a node may restart because of what the bench sent."""
    if frame.can_id == cob_id.NMT:
        return not frame.data or frame.data[0] not in _NO_RESETS
    if frame.can_id == cob_id.LSS_MASTER:
        return True
    if len(frame.data) < 4 or frame.data[0] & 0xE0 not in (0x20, 0xC0):
        return False
    index = int.from_bytes(frame.data[1:3], "little")
    return index in _MAY_RESTART or not any(index in known for known in _RESTARTS_NOTHING)


def _times(count: int, what: str) -> str:
    return f"{what}, {count} times" if count > 1 else what * count


def _many(count: int, noun: str, what: str) -> str:
    return f"{count} {noun}{'s' * (count > 1)} {what}" if count else ""
