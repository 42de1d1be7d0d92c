"""Numbers printed as CiA 301 v4.2.0 prints them: `1017h`, `0602 0000h`, `40 18 10 01`."""


def hex_bytes(data: bytes) -> str:
    """Return the bytes in transmission order: `40 18 10 01`, or `no data`."""
    return data.hex(" ").upper() or "no data"


def hex_can_id(can_id: int, *, extended: bool = False) -> str:
    """Return a CAN-ID with 3 digits (`605h`), or 8 if extended (`18FF50E5h`)."""
    return f"{can_id:08X}h" if extended else f"{can_id:03X}h"


def hex32(word: int) -> str:
    """Return an UNSIGNED32 in two groups of four digits: `0602 0000h`."""
    return f"{word >> 16:04X} {word & 0xFFFF:04X}h"
