"""What a recorded frame says, in words (CiA 301 v4.2.0, CiA 305 v3.0).

The record does not tell which CAN-IDs were in use at each moment: those that can be configured are
named by the predefined connection set (CiA 301 v4.2.0, 7.3.3), with the words *by default*.
"""

from __future__ import annotations

import re
from dataclasses import fields
from typing import Final

from conformance.report.scanned import as_text
from conformance.spec.model import address
from conformance.wire import abort, cob_id, emcy, lss, nmt, sdo
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.notation import hex_bytes

LONGEST_NUMBER: Final = 8
_NODE_ID: Final = 0x7F
_FUNCTION: Final = 0x780
_EMCY: Final = 0x080
_SDO_RESPONSE: Final = 0x580
_SDO_REQUEST: Final = 0x600
_ERROR_CONTROL: Final = 0x700
_PDOS: Final = range(0x180, 0x580)
_COMMANDS: Final = {
    nmt.NmtCommand.START: "start",
    nmt.NmtCommand.STOP: "stop",
    nmt.NmtCommand.ENTER_PRE_OPERATIONAL: "enter Pre-operational",
    nmt.NmtCommand.RESET_NODE: "reset node",
    nmt.NmtCommand.RESET_COMMUNICATION: "reset communication",
}
_STATES: Final = {
    nmt.NmtState.STOPPED: "Stopped",
    nmt.NmtState.OPERATIONAL: "Operational",
    nmt.NmtState.PRE_OPERATIONAL: "Pre-operational",
}


class WireWords:
    """Puts the frames of a trace into words, one after the other: a block has no mark of its own."""

    def __init__(self) -> None:
        self._sends_block: dict[int, str] = {}

    def of(self, frame: Frame) -> str:
        """Return what a frame says, empty if nothing gives its identifier a meaning."""
        try:
            return self._meaning(frame)
        except WireError as error:
            return str(error)

    def _meaning(self, frame: Frame) -> str:
        if frame.extended:
            return ""
        if not frame.can_id & _NODE_ID or frame.can_id in (cob_id.LSS_MASTER, cob_id.LSS_SLAVE):
            return _of_all(frame)
        function, node_id = frame.can_id & _FUNCTION, frame.can_id & _NODE_ID
        if function == _ERROR_CONTROL:
            return _error_control(frame)
        if function == _SDO_REQUEST:
            return f"to node {node_id}: {self._request(node_id, frame)}"
        if function == _SDO_RESPONSE:
            return f"node {node_id}: {self._response(node_id, frame)}"
        return _by_default(frame, function, node_id)

    def _request(self, node_id: int, frame: Frame) -> str:
        if self._sends_block.get(node_id) == "client" and frame.data[:1] != b"\x80":
            return self._block_segment(node_id, frame)
        message = sdo.decode_request(frame.data)
        if isinstance(message, sdo.BlockUploadStart):
            self._sends_block[node_id] = "server"
        return _said(message, "SDO request")

    def _response(self, node_id: int, frame: Frame) -> str:
        if self._sends_block.get(node_id) == "server" and frame.data[:1] != b"\x80":
            return self._block_segment(node_id, frame)
        message = sdo.decode_response(frame.data)
        if isinstance(message, sdo.BlockDownloadInitiateAck):
            self._sends_block[node_id] = "client"
        return _said(message, "SDO response")

    def _block_segment(self, node_id: int, frame: Frame) -> str:
        segment = sdo.decode_block_segment(frame.data)
        if segment.last:
            del self._sends_block[node_id]
        last = ", the last" if segment.last else ""
        return f"segment {segment.sequence} of a block{last}: {hex_bytes(segment.data7)}"


def _of_all(frame: Frame) -> str:
    """Return what a frame says whose identifier is no node's."""
    match frame.can_id:
        case cob_id.NMT:
            return _nmt(nmt.decode_request(frame))
        case cob_id.SYNC:
            return "SYNC" + (f", counter {frame.data[0]}" if frame.data else "")
        case cob_id.TIME:
            return "TIME"
        case cob_id.LSS_MASTER | cob_id.LSS_SLAVE:
            return _lss(frame)
    return ""


def _said(message: sdo.Request | sdo.Response, what: str) -> str:  # noqa: PLR0911 - one per message
    match message:
        case sdo.InitiateUpload():
            return f"{what}: read {address(message.index, message.sub)}"
        case sdo.InitiateUploadReply():
            return f"{what}: {address(message.index, message.sub)} holds {_content(message)}"
        case sdo.InitiateDownload():
            return f"{what}: write {address(message.index, message.sub)}: {_content(message)}"
        case sdo.InitiateDownloadAck():
            return f"{what}: {address(message.index, message.sub)} written"
        case sdo.Abort():
            place = address(message.index, message.sub)
            return f"{what}: abort of {place}: {abort.describe(message.code)}"
        case sdo.UploadSegment():
            return f"{what}: next segment, please"
        case sdo.DownloadSegmentAck():
            return f"{what}: segment received"
        case sdo.UploadSegmentReply() | sdo.DownloadSegment():
            last = ", the last" if message.last else ""
            return f"{what}: segment{last}: {_octets(message.data)}"
    return f"{what}: {_fields(message)}"


def _content(message: sdo.InitiateUploadReply | sdo.InitiateDownload) -> str:
    if message.expedited:
        return _octets(message.data)
    size = "some" if message.size is None else str(message.size)
    return f"{size} octets, in segments"


def _octets(data: bytes) -> str:
    """Return octets, the number they may stand for, and the text."""
    number = f" ({int.from_bytes(data, 'little')})" if 0 < len(data) <= LONGEST_NUMBER else ""
    text = as_text(data)
    return f"{hex_bytes(data)}{f' ({text!r})' if text else number}"


def _nmt(request: nmt.NmtRequest) -> str:
    try:
        command = _COMMANDS[nmt.NmtCommand(request.command)]
    except ValueError:
        command = f"reserved command {request.command:02X}h"
    to = f"node {request.node_id}" if request.node_id else "all nodes"
    return f"NMT to {to}: {command}"


def _error_control(frame: Frame) -> str:
    node_id = frame.can_id & _NODE_ID
    if frame.remote:
        return f"node guarding: asks node {node_id} for its state"
    state = nmt.decode_heartbeat(frame).state
    if state is nmt.NmtState.BOOT_UP:
        return f"node {node_id}: boot-up"
    return f"node {node_id}: heartbeat, {_STATES[state]}"


def _lss(frame: Frame) -> str:
    if frame.can_id == cob_id.LSS_MASTER:
        return f"LSS master: {_fields(lss.decode_master(frame.data))}"
    return f"LSS slave: {_fields(lss.decode_slave(frame.data))}"


def _by_default(frame: Frame, function: int, node_id: int) -> str:
    """Return whose a CAN-ID of the predefined connection set is that can be configured."""
    if function == _EMCY:
        if frame.remote or len(frame.data) != LONGEST_NUMBER:
            return f"CAN-ID of the EMCY of node {node_id} by default"
        said = emcy.decode(frame)
        return (
            f"CAN-ID of the EMCY of node {node_id} by default: error {said.error_code:04X}h, error "
            f"register {said.error_register:02X}h, {hex_bytes(said.manufacturer)}"
        )
    if function not in _PDOS:
        return ""
    kind, number = ("TPDO", function >> 8) if function & 0x80 else ("RPDO", (function >> 8) - 1)
    asks = "asks for what has the " if frame.remote else ""
    return f"{asks}CAN-ID of {kind}{number} of node {node_id} by default"


def _fields(message: object) -> str:
    """Return the kind of a message and its fields: ``inquire reply, value 5``."""
    kind = re.sub(r"(?<!^)(?=[A-Z])", " ", type(message).__name__).lower()
    named = {it.name: getattr(message, it.name) for it in fields(message)}  # type: ignore[arg-type]  # each message is a dataclass
    if "index" in named and "sub" in named:
        kind = f"{kind} {address(named.pop('index'), named.pop('sub'))}"
    words = [f"{name.replace('_', ' ')} {_shown(value)}" for name, value in named.items()]
    return ", ".join((kind, *words))


def _shown(value: object) -> str:
    if isinstance(value, lss.LssCommand):
        return f"{value:02X}h ({value.name.replace('_', ' ').lower()})"
    return hex_bytes(value) if isinstance(value, bytes) else str(value)
