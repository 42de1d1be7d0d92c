"""NMT node control, heartbeat and boot-up (CiA 301 v4.2.0, 7.2.8.3)."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from conformance.wire import cob_id
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame, data_of
from conformance.wire.guard import check_range
from conformance.wire.notation import hex_bytes

NMT_COB_ID: Final = cob_id.NMT


class NmtCommand(IntEnum):
    """Command specifier of node control (7.2.8.3.1)."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


class NmtState(IntEnum):
    """State in the error control message (7.2.8.3.2.2); BOOT_UP ends the initialisation."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


@dataclass(frozen=True, slots=True)
class NmtRequest:
    """Node control request.

    Attributes:
        command: An NmtCommand, or another UNSIGNED8 that the standard reserves.
        node_id: 1 to 127, or 0 for all nodes.
    """

    command: int
    node_id: int

    def __post_init__(self) -> None:
        check_range("NMT command", self.command, 0, 0xFF)
        check_range("node-ID in NMT request", self.node_id, 0, 127)


def encode_request(request: NmtRequest) -> Frame:
    """Return the frame of a node control request."""
    return Frame(NMT_COB_ID, bytes((request.command, request.node_id)))


def decode_request(frame: Frame) -> NmtRequest:
    """Return the node control request in `frame`.

    Raises:
        WireError: Not CAN-ID 000h with 2 bytes, or the node-ID is above 127.
    """
    command, node_id = data_of("NMT request", frame, 2)
    check_range("CAN-ID of NMT request", frame.can_id, NMT_COB_ID, NMT_COB_ID)
    return NmtRequest(command, node_id)


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Heartbeat, or boot-up if `state` is BOOT_UP."""

    node_id: int
    state: NmtState


def encode_heartbeat(heartbeat: Heartbeat) -> Frame:
    """Return the frame of a heartbeat or boot-up message."""
    return Frame(cob_id.heartbeat(heartbeat.node_id), bytes((heartbeat.state,)))


def decode_heartbeat(frame: Frame) -> Heartbeat:
    """Return the heartbeat in `frame`.

    Raises:
        WireError: Not CAN-ID 701h to 77Fh with 1 byte, bit 7 is set, or the state is unknown.
    """
    data = data_of("heartbeat", frame, 1)
    check_range("CAN-ID of heartbeat", frame.can_id, cob_id.heartbeat(1), cob_id.heartbeat(127))
    try:
        state = NmtState(data[0])
    except ValueError as error:
        raise WireError(
            f"heartbeat: expected state 00, 04, 05 or 7F, got {hex_bytes(data)}",
        ) from error
    return Heartbeat(frame.can_id - cob_id.heartbeat(1) + 1, state)
