"""Synchronization object (CiA 301 v4.2.0, 7.2.5)."""

from dataclasses import dataclass

from conformance.wire import cob_id as predefined
from conformance.wire.frame import Frame, data_of
from conformance.wire.guard import check_range


@dataclass(frozen=True, slots=True)
class Sync:
    """SYNC; `counter` is 1 to 240, or None where 1019h is 0."""

    counter: int | None = None

    def __post_init__(self) -> None:
        if self.counter is not None:
            check_range("SYNC counter", self.counter, 1, 240)


def encode(sync: Sync, cob_id: int = predefined.SYNC) -> Frame:
    """Return the frame of `sync`: no data, or the counter."""
    return Frame(cob_id, b"" if sync.counter is None else bytes((sync.counter,)))


def decode(frame: Frame) -> Sync:
    """Return the SYNC in `frame`, whose CAN-ID is configurable and not looked at.

    Raises:
        WireError: Not 0 or 1 bytes, or the counter is not 1 to 240.
    """
    data = data_of("SYNC", frame, 0, 1)
    return Sync(data[0] if data else None)
