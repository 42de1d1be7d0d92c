"""LSS command specifiers and messages (CiA 305 v3.0, 6.3 to 6.7).

A node-ID, mode or table index that the standard forbids but the field holds is carried: to judge it
is the peer's part.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar, TypeAlias


class LssCommand(IntEnum):
    """Command specifier, the first byte."""

    SWITCH_STATE_GLOBAL = 0x04
    CONFIGURE_NODE_ID = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE_CONFIGURATION = 0x17
    SWITCH_SELECTIVE_VENDOR = 0x40
    SWITCH_SELECTIVE_PRODUCT = 0x41
    SWITCH_SELECTIVE_REVISION = 0x42
    SWITCH_SELECTIVE_SERIAL = 0x43
    SWITCH_SELECTIVE_REPLY = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_PRODUCT = 0x47
    IDENTIFY_REVISION_LOW = 0x48
    IDENTIFY_REVISION_HIGH = 0x49
    IDENTIFY_SERIAL_LOW = 0x4A
    IDENTIFY_SERIAL_HIGH = 0x4B
    IDENTIFY_NON_CONFIGURED = 0x4C
    IDENTIFY_SLAVE = 0x4F
    IDENTIFY_NON_CONFIGURED_SLAVE = 0x50
    FASTSCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_PRODUCT = 0x5B
    INQUIRE_REVISION = 0x5C
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE_ID = 0x5E


@dataclass(frozen=True, slots=True)
class SwitchStateGlobal:
    """Master: all slaves to LSS waiting (`mode` 0) or LSS configuration (1)."""

    command: ClassVar = LssCommand.SWITCH_STATE_GLOBAL
    mode: int


@dataclass(frozen=True, slots=True)
class SwitchSelective:
    """Master: one number of the LSS address to configure, `command` 40h to 43h."""

    command: LssCommand
    value: int


@dataclass(frozen=True, slots=True)
class SwitchSelectiveReply:
    """Slave: in LSS configuration now; ``mode`` is reserved, 0, but some devices tell it: 1."""

    command: ClassVar = LssCommand.SWITCH_SELECTIVE_REPLY
    mode: int = 0


@dataclass(frozen=True, slots=True)
class ConfigureNodeId:
    """Master: pending node-ID, 1 to 127, or 255 for none."""

    command: ClassVar = LssCommand.CONFIGURE_NODE_ID
    node_id: int


@dataclass(frozen=True, slots=True)
class ConfigureBitTiming:
    """Master: pending bit rate; for `table_selector` 0 see BIT_RATES."""

    command: ClassVar = LssCommand.CONFIGURE_BIT_TIMING
    table_selector: int
    table_index: int


@dataclass(frozen=True, slots=True)
class ActivateBitTiming:
    """Master: switch to the pending bit rate, silent for this delay before and after."""

    command: ClassVar = LssCommand.ACTIVATE_BIT_TIMING
    switch_delay_ms: int


@dataclass(frozen=True, slots=True)
class StoreConfiguration:
    """Master: make the pending node-ID and bit rate persistent."""

    command: ClassVar = LssCommand.STORE_CONFIGURATION


@dataclass(frozen=True, slots=True)
class ConfigureReply:
    """Slave: outcome of `command` 11h, 13h or 17h.

    Attributes:
        command: The service answered.
        error_code: 0 for success; FFh says that `specific_error` tells.
        specific_error: Of the manufacturer.
    """

    command: LssCommand
    error_code: int
    specific_error: int = 0


@dataclass(frozen=True, slots=True)
class InquireIdentity:
    """Master: ask for one number of the LSS address, `command` 5Ah to 5Dh."""

    command: LssCommand


@dataclass(frozen=True, slots=True)
class InquireNodeId:
    """Master: ask for the active node-ID."""

    command: ClassVar = LssCommand.INQUIRE_NODE_ID


@dataclass(frozen=True, slots=True)
class InquireReply:
    """Slave: UNSIGNED32 for `command` 5Ah to 5Dh, node-ID for 5Eh."""

    command: LssCommand
    value: int


@dataclass(frozen=True, slots=True)
class IdentifyRemoteSlave:
    """Master: one number or limit of the LSS addresses looked for, `command` 46h to 4Bh."""

    command: LssCommand
    value: int


@dataclass(frozen=True, slots=True)
class IdentifyNonConfigured:
    """Master: slaves without node-ID, answer."""

    command: ClassVar = LssCommand.IDENTIFY_NON_CONFIGURED


@dataclass(frozen=True, slots=True)
class IdentifySlave:
    """Slave: its LSS address is among those looked for, or matches the fastscan."""

    command: ClassVar = LssCommand.IDENTIFY_SLAVE


@dataclass(frozen=True, slots=True)
class IdentifyNonConfiguredSlave:
    """Slave: it has no node-ID."""

    command: ClassVar = LssCommand.IDENTIFY_NON_CONFIGURED_SLAVE


@dataclass(frozen=True, slots=True)
class Fastscan:
    """Master: slaves without node-ID whose LSS address matches, answer.

    Attributes:
        id_number: UNSIGNED32 to compare.
        bit_checked: Lowest bit compared, 0 to 31; 128 starts over.
        lss_sub: Number compared: 0 vendor-ID, 1 product code, 2 revision, 3 serial number.
        lss_next: Number compared next, 0 to 3.
    """

    command: ClassVar = LssCommand.FASTSCAN
    id_number: int
    bit_checked: int
    lss_sub: int
    lss_next: int


MasterMessage: TypeAlias = (
    SwitchStateGlobal
    | SwitchSelective
    | ConfigureNodeId
    | ConfigureBitTiming
    | ActivateBitTiming
    | StoreConfiguration
    | InquireIdentity
    | InquireNodeId
    | IdentifyRemoteSlave
    | IdentifyNonConfigured
    | Fastscan
)
SlaveMessage: TypeAlias = (
    SwitchSelectiveReply
    | ConfigureReply
    | InquireReply
    | IdentifySlave
    | IdentifyNonConfiguredSlave
)
