"""What a node sends that no node may, whatever is being judged meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

from conformance.bench.channel import SdoChannel
from conformance.bench.link import Link
from conformance.wire import cob_id
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtState

_STATES = frozenset(NmtState)
_TOGGLE = 0x80
"""Node guarding alternates this bit (CiA 301 v4.2.0, 7.2.8.3.2.1)."""


@dataclass(slots=True)
class Illegal:
    """Frames of the node that no check needs to have looked at.

    A run in which there were some does not conform, even if none of its items has to do with them.

    Attributes:
        error_control: Frames on the node's heartbeat identifier that show no NMT state.
        unsolicited: SDO responses that no request was waiting for.
        improper: SDO responses that answer another request, or have not 8 octets.
    """

    error_control: int = 0
    unsolicited: int = 0
    improper: int = 0

    def look(self, link: Link, channel: SdoChannel) -> None:
        """Look at the frames since the link last forgot, and at what the channel counted so far."""
        heartbeat = cob_id.heartbeat(channel.node_id)

        def shows_no_state(frame: Frame) -> bool:
            if frame.can_id != heartbeat or frame.remote or frame.extended:
                return False
            return len(frame.data) != 1 or frame.data[0] & ~_TOGGLE not in _STATES

        self.error_control += len(link.since(0, shows_no_state))
        self.unsolicited, self.improper = channel.unsolicited, channel.improper

    def __str__(self) -> str:
        words = (
            _many(self.unsolicited, "SDO response", "that nobody asked for"),
            _many(self.improper, "SDO response", "that cannot answer what was asked"),
            _many(self.error_control, "heartbeat", "that shows no NMT state"),
        )
        return ", ".join(word for word in words if word)


def _many(count: int, noun: str, what: str) -> str:
    return f"{count} {noun}{'s' * (count > 1)} {what}" if count else ""
