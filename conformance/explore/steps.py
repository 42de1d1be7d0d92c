"""The steps of an exploration: what is done to a device, in words and as frames for other tools."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, TypeAlias

from conformance.spec.model import DeviceSpec, Key, address
from conformance.wire import cob_id, sdo
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand, NmtRequest, encode_request

_SEGMENT: Final = 7
_EXPEDITED: Final = 4
_RESETS: Final = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)


@dataclass(frozen=True, slots=True)
class Upload:
    """An SDO upload.

    Args:
        key: Index and sub-index.
    """

    key: Key


@dataclass(frozen=True, slots=True)
class Download:
    """An SDO download.

    Args:
        key: Index and sub-index.
        data: Octets, of any number.
        restarts: Confirmed, it restarts the node.
        settle_s: How long the node is then left alone, in seconds.
    """

    key: Key
    data: bytes
    restarts: bool = False
    settle_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Nmt:
    """An NMT command to the node, known or unknown."""

    command: int

    @property
    def restarts(self) -> bool:
        """The node restarts."""
        return self.command in _RESETS


@dataclass(frozen=True, slots=True)
class Sync:
    """A SYNC."""


@dataclass(frozen=True, slots=True)
class Remote:
    """A remote frame with the CAN-ID of a TPDO."""

    can_id: int


@dataclass(frozen=True, slots=True)
class Wait:
    """A while in which nothing is done, in milliseconds."""

    ms: int


@dataclass(frozen=True, slots=True)
class PowerCycle:
    """The supply is taken away and given back."""

    restarts: ClassVar[bool] = True


@dataclass(frozen=True, slots=True)
class Tilt:
    """The device is tilted to two angles, in degrees."""

    x_deg: float
    y_deg: float


Step: TypeAlias = Upload | Download | Nmt | Sync | Remote | Wait | PowerCycle | Tilt


def words(step: Step, spec: DeviceSpec) -> str:
    """Return a step in words."""
    match step:
        case Upload(key=key):
            text = f"upload {_named(key, spec)}"
        case Download(key=key, data=data):
            text = f"download {data.hex(' ').upper() or 'no data'} to {_named(key, spec)}"
        case Nmt(command=command):
            known = command in tuple(NmtCommand)
            name = NmtCommand(command).name.lower().replace("_", " ") if known else "unknown"
            text = f"NMT command {command}, {name}"
        case Sync():
            text = "SYNC"
        case Remote(can_id=can_id):
            text = f"remote frame {can_id:03X}h"
        case Wait(ms=ms):
            text = f"wait {ms} ms"
        case PowerCycle():
            text = "switch the supply off and on"
        case Tilt(x_deg=x_deg, y_deg=y_deg):
            text = f"tilt to {x_deg:g} deg and {y_deg:g} deg"
    return text


def shell(step: Step, node_id: int) -> list[str]:
    """Return a step as lines for a shell with can-utils; a comment where no frame does it."""
    match step:
        case Wait(ms=ms):
            return [f"sleep {ms / 1000:g}"]
        case PowerCycle():
            return ["# supply off and on"]
        case Tilt(x_deg=x_deg, y_deg=y_deg):
            return [f"# tilt to {x_deg:g} deg and {y_deg:g} deg"]
        case _:
            return [f"cansend can0 {_sent(frame)}" for frame in frames(step, node_id)]


def frames(step: Step, node_id: int) -> list[Frame]:
    """Return the frames that a step sends where every answer is a confirmation."""
    match step:
        case Upload(key=key):
            return [_request(sdo.InitiateUpload(*key), node_id)]
        case Download(key=key, data=data):
            return [_request(it, node_id) for it in _transfer(key, data)]
        case Nmt(command=command):
            return [encode_request(NmtRequest(command, node_id))]
        case Sync():
            return [Frame(cob_id.SYNC)]
        case Remote(can_id=can_id):
            return [Frame(can_id, remote=True)]
        case _:
            return []


def _request(request: sdo.Request, node_id: int) -> Frame:
    return Frame(cob_id.sdo_request(node_id), sdo.encode(request))


def _transfer(key: Key, data: bytes) -> Sequence[sdo.Request]:
    if 1 <= len(data) <= _EXPEDITED:
        return [sdo.InitiateDownload(*key, data)]
    starts = range(0, max(len(data), 1), _SEGMENT)
    segments = [
        sdo.DownloadSegment(
            bool(number % 2), data[start : start + _SEGMENT], start + _SEGMENT >= len(data)
        )
        for number, start in enumerate(starts)
    ]
    return [sdo.InitiateDownload(*key, expedited=False, size=len(data)), *segments]


def _named(key: Key, spec: DeviceSpec) -> str:
    entry = spec.entry(*key)
    return f"{address(*key)}, undocumented" if entry is None else f"{entry.address}, {entry.name}"


def _sent(frame: Frame) -> str:
    return f"{frame.can_id:03X}#{'R' if frame.remote else frame.data.hex().upper()}"
