"""COB-IDs: predefined connection set and restricted CAN-IDs (CiA 301 v4.2.0, 7.3.3 and 7.3.5).

The layout of a PDO's COB-ID entry is in 7.5.2.35 and 7.5.2.37, the LSS CAN-IDs in CiA 305 v3.0.
"""

from dataclasses import dataclass
from typing import Final, Self

from conformance.wire.errors import WireError
from conformance.wire.guard import check_range
from conformance.wire.notation import hex32

NMT: Final = 0x000
SYNC: Final = 0x080
TIME: Final = 0x100
LSS_SLAVE: Final = 0x7E4
"""CAN-ID of LSS replies, slave to master."""
LSS_MASTER: Final = 0x7E5
"""CAN-ID of LSS requests, master to slave."""

RESTRICTED: Final = (
    range(0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x700),
    range(0x701, 0x800),
)
"""CAN-IDs that no configurable object may use."""

_NOT_VALID: Final = 1 << 31
_NO_RTR: Final = 1 << 30
_EXTENDED: Final = 1 << 29


def emcy(node_id: int) -> int:
    """Return 080h + node-ID."""
    return _of_node(0x080, node_id)


def tpdo(number: int, node_id: int) -> int:
    """Return the default CAN-ID of TPDO 1 to 4: 180h, 280h, 380h, 480h + node-ID."""
    check_range("TPDO number", number, 1, 4)
    return _of_node(0x080 + 0x100 * number, node_id)


def rpdo(number: int, node_id: int) -> int:
    """Return the default CAN-ID of RPDO 1 to 4: 200h, 300h, 400h, 500h + node-ID."""
    check_range("RPDO number", number, 1, 4)
    return _of_node(0x100 + 0x100 * number, node_id)


def sdo_response(node_id: int) -> int:
    """Return 580h + node-ID, SDO server to client."""
    return _of_node(0x580, node_id)


def sdo_request(node_id: int) -> int:
    """Return 600h + node-ID, SDO client to server."""
    return _of_node(0x600, node_id)


def heartbeat(node_id: int) -> int:
    """Return 700h + node-ID."""
    return _of_node(0x700, node_id)


def _of_node(base: int, node_id: int) -> int:
    check_range("node-ID", node_id, 1, 127)
    return base + node_id


def is_restricted(can_id: int) -> bool:
    """Return whether no configurable object may use this 11-bit CAN-ID (7.3.5)."""
    return any(can_id in restricted for restricted in RESTRICTED)


@dataclass(frozen=True, slots=True)
class CobId:
    """The COB-ID entry of a PDO, sub-index 01h of 1400h and 1800h onwards.

    Attributes:
        can_id: 11-bit CAN-ID, or 29-bit if `extended`.
        valid: Bit 31 clear: the PDO exists.
        rtr_allowed: Bit 30 clear: the PDO may be asked for by remote frame.
        extended: Bit 29 set: 29-bit CAN-ID.
    """

    can_id: int
    valid: bool = True
    rtr_allowed: bool = True
    extended: bool = False

    def __post_init__(self) -> None:
        check_range("CAN-ID", self.can_id, 0, 0x1FFF_FFFF if self.extended else 0x7FF)

    @classmethod
    def from_word(cls, word: int) -> Self:
        """Decode an UNSIGNED32.

        Raises:
            WireError: Bits 28 to 11 are set although bit 29 says 11-bit CAN-ID.
        """
        check_range("COB-ID", word, 0, 0xFFFF_FFFF)
        can_id, extended = word & 0x1FFF_FFFF, bool(word & _EXTENDED)
        if can_id > 0x7FF and not extended:
            raise WireError(f"COB-ID: expected bits 28 to 11 clear, got {hex32(word)}")
        return cls(can_id, not word & _NOT_VALID, not word & _NO_RTR, extended)

    def to_word(self) -> int:
        """Encode as UNSIGNED32."""
        return (
            self.can_id
            | (0 if self.valid else _NOT_VALID)
            | (0 if self.rtr_allowed else _NO_RTR)
            | (_EXTENDED if self.extended else 0)
        )
