"""Layer setting services in a recording: answers of a node that was selected (CiA 305 v3.0, 6.3 and 6.6)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from conformance.checks.lss.lss_cases import NUMBERS
from conformance.judging.recording import Seen
from conformance.judging.sightings import Sighting
from conformance.judging.states import LOSSY
from conformance.judging.timeline import Timeline
from conformance.spec.model import address
from conformance.verdict import Verdict
from conformance.wire import lss
from conformance.wire.cob_id import LSS_MASTER, LSS_SLAVE
from conformance.wire.errors import WireError
from conformance.wire.lss import LssCommand

IDENTITY = 0x1018
ANSWER_S = 1.0
"""An answer that comes later belongs to nothing."""

WAITING, CONFIGURATION = 0, 1
INQUIRIES = range(LssCommand.INQUIRE_VENDOR, LssCommand.INQUIRE_NODE_ID)
CONFIGURES = (
    LssCommand.CONFIGURE_NODE_ID,
    LssCommand.CONFIGURE_BIT_TIMING,
    LssCommand.STORE_CONFIGURATION,
)
UNSURE = "another node may have answered: this one was not selected by its own numbers"


def layer_settings(timeline: Timeline) -> Iterator[Sighting]:
    """Return what a recording shows of LSS."""
    service = timeline.spec.services.lss
    if service is None:
        return
    dialogue = _Dialogue(timeline, service.source)
    breaks = set(timeline.recording.breaks)
    starts = {it.line for it in timeline.boot_ups}
    for seen in timeline.recording.seen:
        if seen.line in breaks or seen.line in starts:
            dialogue.forget()
        if seen.frame.remote or seen.frame.extended:
            continue
        if seen.frame.can_id == LSS_MASTER:
            dialogue.ask(seen)
        elif seen.frame.can_id == LSS_SLAVE:
            yield from dialogue.answer(seen)


class _Dialogue:
    """An LSS master and the node.

    Args:
        timeline: The recording.
        section: Of the manual.
    """

    def __init__(self, timeline: Timeline, section: str) -> None:
        self._timeline = timeline
        self._section = section
        self._numbers = [self._number(sub) for sub in range(1, len(NUMBERS) + 1)]
        readings = [it.lss for it, _ in timeline.spec.services_readings]
        self._zeros = all(it is not None and it.unused == "zero" for it in readings)
        self._tells_mode = any(it is not None and it.tells_mode for it in readings)
        self.forget()

    def forget(self) -> None:
        """Know nothing of which node is selected, nor of a node-ID that may have been given."""
        self._asked: Seen | None = None
        self._matching = 0
        self._selected = False
        self._moved = False

    def _number(self, sub: int) -> int | None:
        """Return one of the node's numbers, as the recording tells it; None where it does not."""
        told = set(self._timeline.told((IDENTITY, sub)))
        return told.pop() if len(told) == 1 else None

    def ask(self, seen: Seen) -> None:
        """Take a frame of the master."""
        self._asked = seen
        try:
            request = lss.decode_master(seen.frame.data)
        except WireError:
            self.forget()
            return
        match request:
            case lss.SwitchStateGlobal():
                self._selected, self._matching = False, 0
            case lss.SwitchSelective(command, value):
                place = command - LssCommand.SWITCH_SELECTIVE_VENDOR
                follows = place in (0, self._matching) and value == self._numbers[place]
                self._matching, self._selected = (place + 1 if follows else 0), False
            case lss.ConfigureNodeId():
                self._moved = True

    def answer(self, seen: Seen) -> Iterator[Sighting]:
        """Return what a frame of a slave shows."""
        asked, self._asked = self._asked, None
        if asked is None or seen.time_s - asked.time_s > ANSWER_S or not seen.frame.data:
            return
        command, octets = asked.frame.data[0], seen.frame.data
        if command == LssCommand.SWITCH_SELECTIVE_SERIAL:
            own = self._matching == len(NUMBERS)
            self._selected = own and octets[0] == LssCommand.SWITCH_SELECTIVE_REPLY
            if self._selected:
                yield from self._form(asked, seen)
            return
        if octets[0] != command or command not in (
            *INQUIRIES,
            LssCommand.INQUIRE_NODE_ID,
            *CONFIGURES,
        ):
            return
        yield from self._form(asked, seen)
        try:
            reply = lss.decode_slave(octets)
        except WireError:
            return
        if isinstance(reply, lss.InquireReply):
            yield from self._inquiry(asked, seen, reply)

    def _inquiry(self, asked: Seen, seen: Seen, reply: lss.InquireReply) -> Iterator[Sighting]:
        if reply.command == LssCommand.INQUIRE_NODE_ID:
            if not self._moved:
                node_id = self._timeline.spec.node_id
                judge = partial(_judge_number, what="node-ID", told=reply.value, wanted=node_id)
                yield self._sighting("LSS-07", "5Eh", asked, seen, judge)
            return
        number = reply.command - LssCommand.INQUIRE_VENDOR
        wanted = self._numbers[number]
        if wanted is not None:
            judge = partial(_judge_number, what=NUMBERS[number], told=reply.value, wanted=wanted)
            yield self._sighting("LSS-06", address(IDENTITY, number + 1), asked, seen, judge)

    def _form(self, asked: Seen, seen: Seen) -> Iterator[Sighting]:
        if not self._zeros:
            return
        octets = seen.frame.data
        try:
            message = lss.decode_slave(octets)
            expected = lss.encode(message)
        except WireError:
            expected = octets[:1] + bytes(7)
        else:
            if isinstance(message, lss.SwitchSelectiveReply) and not self._tells_mode:
                expected = lss.encode(lss.SwitchSelectiveReply(0))
        judge = partial(_judge_form, octets=octets, expected=expected)
        yield self._sighting("LSS-12", f"{octets[0]:02X}h", asked, seen, judge)

    def _sighting(
        self, requirement: str, label: str, asked: Seen, seen: Seen, judge: partial[None]
    ) -> Sighting:
        doubt = "" if self._selected else UNSURE
        if self._timeline.recording.breaks:
            doubt = doubt or LOSSY
        return Sighting(requirement, label, self._section, asked, seen, judge, doubt)


def _judge_number(verdict: Verdict, what: str, told: int, wanted: int) -> None:
    verdict.equal(what, told, wanted, show=lambda it: f"{it:08X}h")


def _judge_form(verdict: Verdict, octets: bytes, expected: bytes) -> None:
    verdict.equal("answer", octets, expected, show=lambda it: it.hex(" ").upper())
