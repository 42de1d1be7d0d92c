"""Layer setting services, 8 bytes each (CiA 305 v3.0, 6.3 to 6.7).

One table per direction gives each command specifier its message and the layout behind it.
Reserved bytes are sent as 0 and ignored on reception.
"""

import struct
from collections.abc import Callable, Mapping
from typing import Final, TypeAlias, TypeVar

from conformance.wire.errors import WireError
from conformance.wire.guard import check_length
from conformance.wire.lss_messages import (
    ActivateBitTiming,
    ConfigureBitTiming,
    ConfigureNodeId,
    ConfigureReply,
    Fastscan,
    IdentifyNonConfigured,
    IdentifyNonConfiguredSlave,
    IdentifyRemoteSlave,
    IdentifySlave,
    InquireIdentity,
    InquireNodeId,
    InquireReply,
    LssCommand,
    MasterMessage,
    SlaveMessage,
    StoreConfiguration,
    SwitchSelective,
    SwitchSelectiveReply,
    SwitchStateGlobal,
)
from conformance.wire.notation import hex_bytes

__all__ = [
    "BIT_RATES",
    "ActivateBitTiming",
    "ConfigureBitTiming",
    "ConfigureNodeId",
    "ConfigureReply",
    "Fastscan",
    "IdentifyNonConfigured",
    "IdentifyNonConfiguredSlave",
    "IdentifyRemoteSlave",
    "IdentifySlave",
    "InquireIdentity",
    "InquireNodeId",
    "InquireReply",
    "LssCommand",
    "MasterMessage",
    "SlaveMessage",
    "StoreConfiguration",
    "SwitchSelective",
    "SwitchSelectiveReply",
    "SwitchStateGlobal",
    "decode_master",
    "decode_slave",
    "encode",
]

BIT_RATES: Final[Mapping[int, int]] = {
    0: 1_000_000,
    1: 800_000,
    2: 500_000,
    3: 250_000,
    4: 125_000,
    6: 50_000,
    7: 20_000,
    8: 10_000,
}
"""Table selector 0: bit/s by table index; 5 is reserved, 9 asks for automatic detection."""


_Message = TypeVar("_Message")
_Table: TypeAlias = Mapping[int, tuple[Callable[..., _Message], struct.Struct]]

_NOTHING: Final = struct.Struct("")
_BYTE: Final = struct.Struct("<B")
_TWO_BYTES: Final = struct.Struct("<BB")
_UNSIGNED16: Final = struct.Struct("<H")
_UNSIGNED32: Final = struct.Struct("<I")

_IDENTITY: Final = range(LssCommand.INQUIRE_VENDOR, LssCommand.INQUIRE_NODE_ID)

_MASTER: Final[_Table[MasterMessage]] = {
    LssCommand.SWITCH_STATE_GLOBAL: (SwitchStateGlobal, _BYTE),
    LssCommand.CONFIGURE_NODE_ID: (ConfigureNodeId, _BYTE),
    LssCommand.CONFIGURE_BIT_TIMING: (ConfigureBitTiming, _TWO_BYTES),
    LssCommand.ACTIVATE_BIT_TIMING: (ActivateBitTiming, _UNSIGNED16),
    LssCommand.STORE_CONFIGURATION: (StoreConfiguration, _NOTHING),
    **dict.fromkeys(range(0x40, 0x44), (SwitchSelective, _UNSIGNED32)),
    **dict.fromkeys(range(0x46, 0x4C), (IdentifyRemoteSlave, _UNSIGNED32)),
    LssCommand.IDENTIFY_NON_CONFIGURED: (IdentifyNonConfigured, _NOTHING),
    LssCommand.FASTSCAN: (Fastscan, struct.Struct("<IBBB")),
    **dict.fromkeys(_IDENTITY, (InquireIdentity, _NOTHING)),
    LssCommand.INQUIRE_NODE_ID: (InquireNodeId, _NOTHING),
}
_SLAVE: Final[_Table[SlaveMessage]] = {
    LssCommand.CONFIGURE_NODE_ID: (ConfigureReply, _TWO_BYTES),
    LssCommand.CONFIGURE_BIT_TIMING: (ConfigureReply, _TWO_BYTES),
    LssCommand.STORE_CONFIGURATION: (ConfigureReply, _TWO_BYTES),
    LssCommand.SWITCH_SELECTIVE_REPLY: (SwitchSelectiveReply, _BYTE),
    LssCommand.IDENTIFY_SLAVE: (IdentifySlave, _NOTHING),
    LssCommand.IDENTIFY_NON_CONFIGURED_SLAVE: (IdentifyNonConfiguredSlave, _NOTHING),
    **dict.fromkeys(_IDENTITY, (InquireReply, _UNSIGNED32)),
    LssCommand.INQUIRE_NODE_ID: (InquireReply, _BYTE),
}
_LAYOUTS: Final[Mapping[tuple[object, int], struct.Struct]] = {
    (kind, command): layout
    for table in (_MASTER, _SLAVE)
    for command, (kind, layout) in table.items()
}
_NAMES_ITS_COMMAND: Final[frozenset[object]] = frozenset(
    (SwitchSelective, IdentifyRemoteSlave, InquireIdentity, ConfigureReply, InquireReply),
)


def encode(message: MasterMessage | SlaveMessage) -> bytes:
    """Return the 8 bytes of `message`.

    Raises:
        WireError: The message does not have this command, or a value does not fit its field.
    """
    layout = _LAYOUTS.get((type(message), message.command))
    if layout is None:
        raise WireError(f"LSS: expected a command of this message, got {message}")
    values = [getattr(message, name) for name in message.__match_args__ if name != "command"]
    try:
        body = layout.pack(*values)
    except struct.error as error:
        raise WireError(f"LSS: expected values that fit, got {message}: {error}") from error
    return bytes((message.command,)) + body.ljust(7, b"\0")


def decode_master(data: bytes) -> MasterMessage:
    """Return the message from LSS master to slave (7E5h) in `data`.

    Raises:
        WireError: Not 8 bytes, or an unknown command specifier.
    """
    return _decode("LSS master message", _MASTER, data)


def decode_slave(data: bytes) -> SlaveMessage:
    """Return the message from LSS slave to master (7E4h) in `data`.

    Raises:
        WireError: Not 8 bytes, or an unknown command specifier.
    """
    return _decode("LSS slave message", _SLAVE, data)


def _decode(what: str, table: _Table[_Message], data: bytes) -> _Message:
    check_length(what, data, 8)
    if data[0] not in table:
        raise WireError(f"{what}: expected a known command specifier, got {hex_bytes(data)}")
    kind, layout = table[data[0]]
    values = layout.unpack_from(data, 1)
    if kind in _NAMES_ITS_COMMAND:
        return kind(LssCommand(data[0]), *values)
    return kind(*values)
