"""Emergency object (CiA 301 v4.2.0, 7.2.7)."""

from dataclasses import dataclass

from conformance.wire.frame import Frame, data_of
from conformance.wire.guard import check_length, check_range


@dataclass(frozen=True, slots=True)
class Emergency:
    """EMCY write.

    Attributes:
        error_code: UNSIGNED16, 0000h for error reset.
        error_register: Object 1001h.
        manufacturer: 5 bytes of manufacturer-specific error code.
    """

    error_code: int
    error_register: int
    manufacturer: bytes = bytes(5)

    def __post_init__(self) -> None:
        check_range("emergency error code", self.error_code, 0, 0xFFFF)
        check_range("error register", self.error_register, 0, 0xFF)
        check_length("manufacturer-specific error code", self.manufacturer, 5)


def encode(emcy: Emergency, cob_id: int) -> Frame:
    """Return the frame of `emcy`, 8 bytes."""
    code = emcy.error_code.to_bytes(2, "little")
    return Frame(cob_id, code + bytes((emcy.error_register,)) + emcy.manufacturer)


def decode(frame: Frame) -> Emergency:
    """Return the EMCY in `frame`, whose CAN-ID is configurable and not looked at.

    Raises:
        WireError: Not 8 bytes.
    """
    data = data_of("EMCY", frame, 8)
    return Emergency(int.from_bytes(data[:2], "little"), data[2], data[3:])
