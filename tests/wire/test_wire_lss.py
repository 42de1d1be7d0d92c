"""LSS messages both ways."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.wire.errors import WireError
from conformance.wire.lss import (
    BIT_RATES,
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
    decode_master,
    decode_slave,
    encode,
)

Message = MasterMessage | SlaveMessage

# Command specifiers and layouts as drawn in the LSS chapters of the TR-Electronic CM-36, Festo
# CPX-FB14 and Gefran RK-5-C manuals; fastscan as CANopenNode sends it.
MASTER: list[tuple[MasterMessage, str]] = [
    (SwitchStateGlobal(0), "04 00 00 00 00 00 00 00"),
    (SwitchStateGlobal(1), "04 01 00 00 00 00 00 00"),
    (ConfigureNodeId(0x32), "11 32 00 00 00 00 00 00"),
    (ConfigureNodeId(0xFF), "11 FF 00 00 00 00 00 00"),
    (ConfigureBitTiming(0, 4), "13 00 04 00 00 00 00 00"),
    (ActivateBitTiming(1000), "15 E8 03 00 00 00 00 00"),
    (StoreConfiguration(), "17 00 00 00 00 00 00 00"),
    (SwitchSelective(LssCommand.SWITCH_SELECTIVE_VENDOR, 0x195), "40 95 01 00 00 00 00 00"),
    (SwitchSelective(LssCommand.SWITCH_SELECTIVE_PRODUCT, 1), "41 01 00 00 00 00 00 00"),
    (SwitchSelective(LssCommand.SWITCH_SELECTIVE_REVISION, 0x10002), "42 02 00 01 00 00 00 00"),
    (SwitchSelective(LssCommand.SWITCH_SELECTIVE_SERIAL, 0x12345678), "43 78 56 34 12 00 00 00"),
    (IdentifyRemoteSlave(LssCommand.IDENTIFY_VENDOR, 0x195), "46 95 01 00 00 00 00 00"),
    (IdentifyRemoteSlave(LssCommand.IDENTIFY_PRODUCT, 1), "47 01 00 00 00 00 00 00"),
    (IdentifyRemoteSlave(LssCommand.IDENTIFY_REVISION_LOW, 0), "48 00 00 00 00 00 00 00"),
    (IdentifyRemoteSlave(LssCommand.IDENTIFY_REVISION_HIGH, 0xFFFF), "49 FF FF 00 00 00 00 00"),
    (IdentifyRemoteSlave(LssCommand.IDENTIFY_SERIAL_LOW, 0), "4A 00 00 00 00 00 00 00"),
    (IdentifyRemoteSlave(LssCommand.IDENTIFY_SERIAL_HIGH, 2**32 - 1), "4B FF FF FF FF 00 00 00"),
    (IdentifyNonConfigured(), "4C 00 00 00 00 00 00 00"),
    (Fastscan(0, 128, 0, 0), "51 00 00 00 00 80 00 00"),
    (Fastscan(0x12345678, 31, 2, 3), "51 78 56 34 12 1F 02 03"),
    (InquireIdentity(LssCommand.INQUIRE_VENDOR), "5A 00 00 00 00 00 00 00"),
    (InquireIdentity(LssCommand.INQUIRE_PRODUCT), "5B 00 00 00 00 00 00 00"),
    (InquireIdentity(LssCommand.INQUIRE_REVISION), "5C 00 00 00 00 00 00 00"),
    (InquireIdentity(LssCommand.INQUIRE_SERIAL), "5D 00 00 00 00 00 00 00"),
    (InquireNodeId(), "5E 00 00 00 00 00 00 00"),
]

SLAVE: list[tuple[SlaveMessage, str]] = [
    (ConfigureReply(LssCommand.CONFIGURE_NODE_ID, 0), "11 00 00 00 00 00 00 00"),
    (ConfigureReply(LssCommand.CONFIGURE_BIT_TIMING, 1), "13 01 00 00 00 00 00 00"),
    (ConfigureReply(LssCommand.STORE_CONFIGURATION, 0xFF, 7), "17 FF 07 00 00 00 00 00"),
    (SwitchSelectiveReply(), "44 00 00 00 00 00 00 00"),
    (SwitchSelectiveReply(mode=1), "44 01 00 00 00 00 00 00"),
    (IdentifySlave(), "4F 00 00 00 00 00 00 00"),
    (IdentifyNonConfiguredSlave(), "50 00 00 00 00 00 00 00"),
    (InquireReply(LssCommand.INQUIRE_VENDOR, 0x195), "5A 95 01 00 00 00 00 00"),
    (InquireReply(LssCommand.INQUIRE_PRODUCT, 1), "5B 01 00 00 00 00 00 00"),
    (InquireReply(LssCommand.INQUIRE_REVISION, 0x10002), "5C 02 00 01 00 00 00 00"),
    (InquireReply(LssCommand.INQUIRE_SERIAL, 0x12345678), "5D 78 56 34 12 00 00 00"),
    (InquireReply(LssCommand.INQUIRE_NODE_ID, 0x32), "5E 32 00 00 00 00 00 00"),
]

BOTH_WAYS: list[tuple[Message, str, Callable[[bytes], Message]]] = [
    *((message, data, decode_master) for message, data in MASTER),
    *((message, data, decode_slave) for message, data in SLAVE),
]


@pytest.mark.parametrize(("message", "data", "decode"), BOTH_WAYS)
def test_a_message_encodes_and_decodes(
    message: Message, data: str, decode: Callable[[bytes], Message]
) -> None:
    assert encode(message).hex(" ").upper() == data
    decoded = decode(bytes.fromhex(data))
    assert decoded == message
    assert isinstance(decoded.command, LssCommand)


@pytest.mark.parametrize(("message", "data", "decode"), BOTH_WAYS)
def test_a_message_of_another_length_is_refused(
    message: Message, data: str, decode: Callable[[bytes], Message]
) -> None:
    whole = bytes.fromhex(data)
    for wrong in (*(whole[:length] for length in range(8)), whole + b"\0"):
        with pytest.raises(WireError, match=f"expected 8 bytes, got {len(wrong)}"):
            decode(wrong)
    assert decode(whole) == message


def test_the_table_holds_each_command() -> None:
    assert {message.command for message, _, _ in BOTH_WAYS} == set(LssCommand)
    assert len({type(message) for message, _, _ in BOTH_WAYS}) == 16


def test_a_command_of_one_direction_is_unknown_in_the_other() -> None:
    only_master = {*range(0x40, 0x44), *range(0x46, 0x4D), 0x04, 0x15, 0x51}
    only_slave = {0x44, 0x4F, 0x50}
    for command in set(range(256)) - {message.command for message, _ in MASTER}:
        with pytest.raises(WireError, match=f"LSS master message: .* got {command:02X} 00"):
            decode_master(bytes([command]) + bytes(7))
    for command in set(range(256)) - {message.command for message, _ in SLAVE}:
        with pytest.raises(WireError, match=f"LSS slave message: .* got {command:02X} 00"):
            decode_slave(bytes([command]) + bytes(7))
    assert {m.command for m, _ in MASTER} - {m.command for m, _ in SLAVE} == only_master
    assert {m.command for m, _ in SLAVE} - {m.command for m, _ in MASTER} == only_slave


def test_reserved_bytes_are_ignored() -> None:
    assert decode_slave(b"\x5e\x32" + b"\xff" * 6) == InquireReply(LssCommand.INQUIRE_NODE_ID, 0x32)
    assert decode_master(b"\x17" + b"\xff" * 7) == StoreConfiguration()


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (ConfigureNodeId(256), "expected values that fit, got .*node_id=256"),
        (ActivateBitTiming(0x10000), "switch_delay_ms=65536"),
        (SwitchSelective(LssCommand.SWITCH_SELECTIVE_VENDOR, 2**32), "value=4294967296"),
        (InquireReply(LssCommand.INQUIRE_NODE_ID, 256), "value=256"),
        (SwitchSelective(LssCommand.IDENTIFY_VENDOR, 1), "expected a command of this message"),
        (ConfigureReply(LssCommand.ACTIVATE_BIT_TIMING, 0), "expected a command of this message"),
        (InquireIdentity(LssCommand.INQUIRE_NODE_ID), "expected a command of this message"),
    ],
)
def test_a_message_that_does_not_fit_is_refused(message: Message, text: str) -> None:
    with pytest.raises(WireError, match=text):
        encode(message)


def test_bit_rates_are_those_of_the_standard_table() -> None:
    assert BIT_RATES == {
        0: 1_000_000,
        1: 800_000,
        2: 500_000,
        3: 250_000,
        4: 125_000,
        6: 50_000,
        7: 20_000,
        8: 10_000,
    }


@given(
    st.sampled_from([decode_master, decode_slave]),
    st.binary(max_size=9)
    | st.builds(
        lambda command, body: bytes([command]) + body,
        st.sampled_from(LssCommand),
        st.binary(min_size=7, max_size=7),
    ),
)
def test_any_data_decode_to_a_message_that_survives_or_are_refused(
    decode: Callable[[bytes], Message], data: bytes
) -> None:
    try:
        message = decode(data)
    except WireError:
        return
    assert decode(encode(message)) == message
