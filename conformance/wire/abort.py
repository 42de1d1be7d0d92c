"""SDO abort codes (CiA 301 v4.2.0, 7.2.4.3.17, table 22)."""

from enum import IntEnum
from typing import Self

from conformance.wire.notation import hex32


class AbortCode(IntEnum):
    """An SDO abort code and, as `text`, what it means."""

    text: str

    def __new__(cls, code: int, text: str = "") -> Self:
        """Make a member whose value is `code` alone."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member

    TOGGLE_BIT_NOT_ALTERNATED = 0x0503_0000, "toggle bit not alternated"
    SDO_PROTOCOL_TIMED_OUT = 0x0504_0000, "SDO protocol timed out"
    UNKNOWN_COMMAND_SPECIFIER = 0x0504_0001, "command specifier not valid or unknown"
    INVALID_BLOCK_SIZE = 0x0504_0002, "invalid block size"
    INVALID_SEQUENCE_NUMBER = 0x0504_0003, "invalid sequence number"
    CRC_ERROR = 0x0504_0004, "CRC error"
    OUT_OF_MEMORY = 0x0504_0005, "out of memory"
    UNSUPPORTED_ACCESS = 0x0601_0000, "unsupported access to an object"
    READ_OF_WRITE_ONLY = 0x0601_0001, "attempt to read a write-only object"
    WRITE_OF_READ_ONLY = 0x0601_0002, "attempt to write a read-only object"
    OBJECT_DOES_NOT_EXIST = 0x0602_0000, "object does not exist"
    OBJECT_NOT_MAPPABLE = 0x0604_0041, "object cannot be mapped to the PDO"
    PDO_LENGTH_EXCEEDED = 0x0604_0042, "mapped objects would exceed the PDO length"
    PARAMETER_INCOMPATIBLE = 0x0604_0043, "general parameter incompatibility"
    INTERNAL_INCOMPATIBILITY = 0x0604_0047, "general internal incompatibility in the device"
    HARDWARE_ERROR = 0x0606_0000, "access failed due to a hardware error"
    LENGTH_MISMATCH = 0x0607_0010, "data type does not match, length does not match"
    LENGTH_TOO_HIGH = 0x0607_0012, "data type does not match, length too high"
    LENGTH_TOO_LOW = 0x0607_0013, "data type does not match, length too low"
    SUB_INDEX_DOES_NOT_EXIST = 0x0609_0011, "sub-index does not exist"
    INVALID_VALUE = 0x0609_0030, "invalid value for parameter"
    VALUE_TOO_HIGH = 0x0609_0031, "value of parameter written too high"
    VALUE_TOO_LOW = 0x0609_0032, "value of parameter written too low"
    MAXIMUM_LESS_THAN_MINIMUM = 0x0609_0036, "maximum value is less than minimum value"
    SDO_CONNECTION_NOT_AVAILABLE = 0x060A_0023, "resource not available: SDO connection"
    GENERAL_ERROR = 0x0800_0000, "general error"
    DATA_NOT_STORED = 0x0800_0020, "data cannot be transferred or stored"
    LOCAL_CONTROL = 0x0800_0021, "data cannot be stored because of local control"
    DEVICE_STATE = 0x0800_0022, "data cannot be stored because of the device state"
    NO_OBJECT_DICTIONARY = 0x0800_0023, "no object dictionary is present"
    NO_DATA_AVAILABLE = 0x0800_0024, "no data available"


def describe(code: int) -> str:
    """Return the code and its meaning: `0602 0000h object does not exist`."""
    try:
        text = AbortCode(code).text
    except ValueError:
        text = "unknown abort code"
    return f"{hex32(code)} {text}"
