"""Frames as python-can has them, and back: for whoever is on a bus of it."""

from __future__ import annotations

import can

from conformance.wire.frame import Frame


def to_message(frame: Frame) -> can.Message:
    """Return a frame as a message to send."""
    return can.Message(
        arbitration_id=frame.can_id,
        data=frame.data if not frame.remote else None,
        dlc=frame.dlc,
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
    )


def to_frame(message: can.Message) -> Frame:
    """Return the frame of a message.

    Raises:
        WireError: It is no classical CAN frame.
    """
    return Frame(
        message.arbitration_id,
        b"" if message.is_remote_frame else bytes(message.data),
        remote=message.is_remote_frame,
        extended=message.is_extended_id,
        dlc=message.dlc,
    )
