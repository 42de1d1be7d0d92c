"""An LSS master: what it sends, and what slaves answer (CiA 305 v3.0)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from conformance.bench.bus.link import Link, Stamped
from conformance.errors import SetupRefused
from conformance.spec.model import DeviceSpec, StateName
from conformance.wire import lss
from conformance.wire.cob_id import LSS_MASTER, LSS_SLAVE
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand

WAITING: Final = 0
CONFIGURATION: Final = 1
DONE: Final = 0
ENTER: Final[Mapping[StateName, NmtCommand]] = {
    "pre-operational": NmtCommand.ENTER_PRE_OPERATIONAL,
    "operational": NmtCommand.START,
    "stopped": NmtCommand.STOP,
}
"""The commands that lead to NMT states."""


@dataclass(frozen=True, slots=True)
class LssAnswer:
    """What came after a request.

    Args:
        received: The first frame on the identifier of LSS slaves, None for silence.
        message: The frame decoded, None when it is no LSS message.
    """

    received: Stamped | None
    message: lss.SlaveMessage | None

    @property
    def error_code(self) -> int | None:
        """The outcome of a configuring service, None when the answer has none."""
        return self.message.error_code if isinstance(self.message, lss.ConfigureReply) else None

    def __str__(self) -> str:
        return "no answer" if self.received is None else str(self.received.frame)


class LssMaster:
    """Talks to every LSS slave on the bus.

    Args:
        link: The link to the bus.
        timeout_s: Longest wait for an answer.
    """

    def __init__(self, link: Link, timeout_s: float) -> None:
        self._link = link
        self._timeout_s = timeout_s

    def tell(self, *messages: lss.MasterMessage) -> int:
        """Send messages; return the mark before them."""
        self._link.drain()
        mark = self._link.mark()
        for message in messages:
            self._link.send(Frame(LSS_MASTER, lss.encode(message)))
        return mark

    def ask(self, *messages: lss.MasterMessage) -> LssAnswer:
        """Send messages and wait for the first answer."""
        mark = self.tell(*messages)
        return _decoded(self._link.wait(is_answer, self._timeout_s, mark))

    def ask_all(self, *messages: lss.MasterMessage) -> list[LssAnswer]:
        """Send messages and collect every answer until the time for one is over."""
        mark = self.tell(*messages)
        self._link.listen(self._timeout_s, is_answer)
        return [_decoded(received) for received in self._link.since(mark, is_answer)]

    def wait(self) -> None:
        """Switch all slaves to LSS waiting."""
        self.tell(lss.SwitchStateGlobal(WAITING))


def usable_state(spec: DeviceSpec) -> StateName:
    """Return the first NMT state in which every reading of the manual has LSS.

    Raises:
        SetupRefused: There is none.
    """
    for state in ENTER:
        services = [services.lss for services, _ in spec.services_readings]
        if all(it is None or state in it.states for it in services):
            return state
    raise SetupRefused("there is no NMT state in which LSS works for certain")


def is_answer(frame: Frame) -> bool:
    """Tell whether a frame is on the identifier of LSS slaves."""
    return frame.can_id == LSS_SLAVE and not frame.extended and not frame.remote


def _decoded(received: Stamped | None) -> LssAnswer:
    if received is None:
        return LssAnswer(None, None)
    try:
        return LssAnswer(received, lss.decode_slave(received.frame.data))
    except WireError:
        return LssAnswer(received, None)
