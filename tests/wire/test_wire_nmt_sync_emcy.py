"""NMT, heartbeat, SYNC and EMCY both ways."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.wire import emcy, nmt, sync
from conformance.wire.emcy import Emergency
from conformance.wire.errors import WireError
from conformance.wire.frame import Frame
from conformance.wire.nmt import Heartbeat, NmtCommand, NmtRequest, NmtState
from conformance.wire.sync import Sync

Message = NmtRequest | Heartbeat | Sync | Emergency
DECODERS: dict[type[Message], Callable[[Frame], Message]] = {
    NmtRequest: nmt.decode_request,
    Heartbeat: nmt.decode_heartbeat,
    Sync: sync.decode,
    Emergency: emcy.decode,
}
# CiA 301 v4.2.0, 7.2.8.3.1 and figures of 7.2.8.3.2.2, 7.2.5.3, 7.2.7.3.
BOTH_WAYS: list[tuple[Message, Frame]] = [
    (NmtRequest(NmtCommand.START, 0), Frame(0x000, b"\x01\x00")),
    (NmtRequest(NmtCommand.STOP, 5), Frame(0x000, b"\x02\x05")),
    (NmtRequest(NmtCommand.ENTER_PRE_OPERATIONAL, 5), Frame(0x000, b"\x80\x05")),
    (NmtRequest(NmtCommand.RESET_NODE, 127), Frame(0x000, b"\x81\x7f")),
    (NmtRequest(NmtCommand.RESET_COMMUNICATION, 1), Frame(0x000, b"\x82\x01")),
    (NmtRequest(0x55, 1), Frame(0x000, b"\x55\x01")),
    (Heartbeat(1, NmtState.BOOT_UP), Frame(0x701, b"\x00")),
    (Heartbeat(5, NmtState.STOPPED), Frame(0x705, b"\x04")),
    (Heartbeat(5, NmtState.OPERATIONAL), Frame(0x705, b"\x05")),
    (Heartbeat(127, NmtState.PRE_OPERATIONAL), Frame(0x77F, b"\x7f")),
    (Sync(), Frame(0x080)),
    (Sync(1), Frame(0x080, b"\x01")),
    (Sync(240), Frame(0x080, b"\xf0")),
    # CiA 301 v4.2.0, table 26: 8210h, PDO not processed due to length error.
    (
        Emergency(0x8210, 0x11, b"\1\2\3\4\5"),
        Frame(0x085, bytes.fromhex("10 82 11 01 02 03 04 05")),
    ),
    (Emergency(0, 0), Frame(0x085, bytes(8))),
]


def encode(message: Message, can_id: int) -> Frame:
    match message:
        case NmtRequest():
            return nmt.encode_request(message)
        case Heartbeat():
            return nmt.encode_heartbeat(message)
        case Sync():
            return sync.encode(message, can_id)
        case Emergency():
            return emcy.encode(message, can_id)


@pytest.mark.parametrize(("message", "frame"), BOTH_WAYS, ids=str)
def test_a_message_encodes_and_decodes(message: Message, frame: Frame) -> None:
    assert encode(message, frame.can_id) == frame
    assert DECODERS[type(message)](frame) == message


@pytest.mark.parametrize(("message", "frame"), BOTH_WAYS, ids=str)
def test_a_frame_of_another_length_is_refused(message: Message, frame: Frame) -> None:
    allowed = {0, 1} if isinstance(message, Sync) else {len(frame.data)}
    for length in set(range(9)) - allowed:
        with pytest.raises(WireError, match="bytes, got"):
            DECODERS[type(message)](Frame(frame.can_id, (frame.data + bytes(8))[:length]))


@pytest.mark.parametrize("kind", DECODERS)
def test_a_remote_or_extended_frame_is_refused(kind: type[Message]) -> None:
    for frame in (Frame(0x705, remote=True, dlc=1), Frame(0x705, b"\x05", extended=True)):
        with pytest.raises(WireError, match="expected a data frame with 11-bit CAN-ID"):
            DECODERS[kind](frame)


@pytest.mark.parametrize(
    ("decode", "frame", "message"),
    [
        (nmt.decode_request, Frame(0x001, b"\x01\x05"), "CAN-ID of NMT request"),
        (nmt.decode_request, Frame(0x000, b"\x01\x80"), "node-ID in NMT request: .* got 80h"),
        (nmt.decode_heartbeat, Frame(0x700, b"\x05"), "CAN-ID of heartbeat: .* got 700h"),
        (nmt.decode_heartbeat, Frame(0x780, b"\x05"), "CAN-ID of heartbeat: .* got 780h"),
        (nmt.decode_heartbeat, Frame(0x705, b"\x85"), "expected state 00, 04, 05 or 7F, got 85"),
        (nmt.decode_heartbeat, Frame(0x705, b"\x06"), "expected state 00, 04, 05 or 7F, got 06"),
        (sync.decode, Frame(0x080, b"\x00"), "SYNC counter: expected 1h to F0h, got 0h"),
        (sync.decode, Frame(0x080, b"\xf1"), "SYNC counter: expected 1h to F0h, got F1h"),
    ],
)
def test_content_the_standard_excludes_is_refused(
    decode: Callable[[Frame], Message], frame: Frame, message: str
) -> None:
    with pytest.raises(WireError, match=message):
        decode(frame)


@pytest.mark.parametrize(
    "build",
    [
        lambda: NmtRequest(256, 1),
        lambda: NmtRequest(1, 128),
        lambda: nmt.encode_heartbeat(Heartbeat(0, NmtState.STOPPED)),
        lambda: Sync(0),
        lambda: Emergency(0x10000, 0),
        lambda: Emergency(0, 0x100),
        lambda: Emergency(0, 0, bytes(4)),
    ],
)
def test_a_message_that_does_not_fit_its_fields_is_refused(build: Callable[[], object]) -> None:
    with pytest.raises(WireError, match="expected"):
        build()


def test_sync_and_emcy_keep_a_configured_cob_id() -> None:
    assert sync.encode(Sync(7), 0x0A0) == Frame(0x0A0, b"\x07")
    assert sync.encode(Sync()) == Frame(0x080)
    assert emcy.encode(Emergency(0x1000, 1), 0x123).can_id == 0x123


@given(st.sampled_from(list(DECODERS)), st.integers(0, 0x7FF), st.binary(max_size=8))
def test_any_frame_decodes_to_what_encodes_to_it_or_is_refused(
    kind: type[Message], can_id: int, data: bytes
) -> None:
    frame = Frame(can_id, data)
    try:
        message = DECODERS[kind](frame)
    except WireError:
        return
    assert encode(message, can_id) == frame
