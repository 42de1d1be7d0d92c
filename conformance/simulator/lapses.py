"""Lapses: what a defective device does wrong once some things have happened to it in one order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from conformance.simulator.dictionary import ObjectDictionary
from conformance.simulator.lapse import Event, EventName, Lapse, Service
from conformance.spec.fields import key_of
from conformance.spec.model import Key
from conformance.wire import cob_id, sdo
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import decode_request

_COMMANDS: Final[Mapping[int, EventName]] = {
    1: "start",
    2: "stop",
    128: "enter-pre-operational",
    129: "reset-node",
    130: "reset-communication",
}
_SENDS: Final[Mapping[Service, Sequence[int]]] = {
    "emcy": (0x080,),
    "tpdo": (0x180, 0x280, 0x380, 0x480),
    "sdo": (0x580,),
    "heartbeat": (0x700,),
}


class Lapses:
    """Watches the requests to a node.

    Args:
        lapses: What a device does wrong.
    """

    def __init__(self, lapses: Sequence[Lapse]) -> None:
        self._lapses = lapses
        self._longest = max((len(lapse.after) for lapse in lapses), default=0)
        self._heard: list[Event] = []
        self._lost: set[Service] = set()
        self._waiting: list[Lapse] = []

    def hear(self, frame: Frame, node_id: int) -> None:
        """Note a request; what was waited for happens before it is handled."""
        event = _event(frame, node_id) if self._lapses else None
        if event is None:
            return
        self._heard = [*self._heard, event][-self._longest :]
        for lapse in self._lapses:
            if _ends_with(self._heard, lapse.after):
                if lapse.loses is not None:
                    self._lost.add(lapse.loses)
                self._waiting.append(lapse)

    def act(self, dictionary: ObjectDictionary) -> None:
        """Do what is waiting to an object dictionary, after the request or the restart it made."""
        waiting, self._waiting = self._waiting, []
        for lapse in waiting:
            for place, number in lapse.acts_as.items():
                dictionary.pretend(key_of(place), number)
            for place, other in lapse.copies.items():
                dictionary.set(key_of(place), dictionary.number(*key_of(other)))

    def loses(self, frame: Frame, node_id: int) -> bool:
        """Tell whether a frame is lost that the node is about to send."""
        for service in self._lost:
            if frame.can_id - node_id in _SENDS[service] and frame.data != b"\0":
                self._lost.remove(service)
                return True
        return False


def _ends_with(heard: Sequence[Event], wanted: Sequence[Event]) -> bool:
    latest = heard[-len(wanted) :]
    return len(latest) == len(wanted) and all(map(_is, latest, wanted))


def _is(heard: Event, wanted: Event) -> bool:
    return (
        heard.does == wanted.does
        and (wanted.object is None or _key(heard) == _key(wanted))
        and wanted.value in (None, heard.value)
    )


def _key(event: Event) -> Key | None:
    return None if event.object is None else key_of(event.object)


def _event(frame: Frame, node_id: int) -> Event | None:
    """Return what a frame asks of the node, None for all else."""
    try:
        if frame.can_id == cob_id.NMT:
            request = decode_request(frame)
            name = _COMMANDS.get(request.command)
            return Event(does=name) if name and request.node_id in (0, node_id) else None
        if frame.can_id == cob_id.SYNC and not frame.remote and not frame.extended:
            return Event(does="sync")
        if frame.can_id == cob_id.sdo_request(node_id) and not frame.remote:
            return _transfer(sdo.decode_request(frame.data))
    except WireError:
        return None
    return None


def _transfer(request: sdo.Request) -> Event | None:
    match request:
        case sdo.InitiateUpload(index=index, sub=sub):
            return Event(does="upload", object=f"0x{index:04X}:{sub}")
        case sdo.InitiateDownload(index=index, sub=sub, data=data):
            value = int.from_bytes(data, "little")
            return Event(does="download", object=f"0x{index:04X}:{sub}", value=value)
        case _:
            return None
