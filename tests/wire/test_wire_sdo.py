"""SDO messages both ways."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.wire.abort import AbortCode
from conformance.wire.errors import WireError
from conformance.wire.sdo import (
    Abort,
    BlockDownloadEnd,
    BlockDownloadEndAck,
    BlockDownloadInitiate,
    BlockDownloadInitiateAck,
    BlockDownloadSubAck,
    BlockSegment,
    BlockUploadAck,
    BlockUploadEnd,
    BlockUploadEndReply,
    BlockUploadInitiate,
    BlockUploadInitiateReply,
    BlockUploadStart,
    DownloadSegment,
    DownloadSegmentAck,
    InitiateDownload,
    InitiateDownloadAck,
    InitiateUpload,
    InitiateUploadReply,
    Request,
    Response,
    UploadSegment,
    UploadSegmentReply,
    crc16_ccitt,
    decode_block_segment,
    decode_request,
    decode_response,
    encode,
)

Message = Request | Response | BlockSegment

REQUESTS: list[tuple[Request, str]] = [
    # Baumer GIM140R, 6.3.1: save.
    (InitiateDownload(0x1010, 1, b"save"), "23 10 10 01 73 61 76 65"),
    # Danfoss DST X730, example 1: bit rate.
    (InitiateDownload(0x20F2, 0, b"\x02"), "2F F2 20 00 02 00 00 00"),
    # Baumer GIM140R, 6.3.6: zero of the x axis.
    (InitiateDownload(0x6012, 0, b"\0\0", expedited=True, size=2), "2B 12 60 00 00 00 00 00"),
    (InitiateDownload(0x2000, 3, b"\1\2\3"), "27 00 20 03 01 02 03 00"),
    (InitiateDownload(0x2000, 0, b"\1\0\0\0", size=None), "22 00 20 00 01 00 00 00"),
    # CiA's conformance test tool, case 2.15: 21h with size 2, then 0Bh.
    (InitiateDownload(0x1017, 0, expedited=False, size=2), "21 17 10 00 02 00 00 00"),
    (DownloadSegment(toggle=False, data=b"\0\0", last=True), "0B 00 00 00 00 00 00 00"),
    (InitiateDownload(0x1017, 0, expedited=False), "20 17 10 00 00 00 00 00"),
    (InitiateDownload(0x1017, 0, expedited=False, size=0), "21 17 10 00 00 00 00 00"),
    (DownloadSegment(toggle=True, data=b"CANopen", last=False), "10 43 41 4E 6F 70 65 6E"),
    (DownloadSegment(toggle=False, data=b"", last=True), "0F 00 00 00 00 00 00 00"),
    # Baumer GIM140R, 100Ah: 40 0A 10 00, then 60.
    (InitiateUpload(0x100A, 0), "40 0A 10 00 00 00 00 00"),
    (UploadSegment(toggle=False), "60 00 00 00 00 00 00 00"),
    (UploadSegment(toggle=True), "70 00 00 00 00 00 00 00"),
    (Abort(0x1017, 0, AbortCode.SDO_PROTOCOL_TIMED_OUT), "80 17 10 00 00 00 04 05"),
    # ICP DAS CAN-8x23 manual, block upload of CAN-8423's name and block download to 1400h:02.
    (BlockUploadStart(), "A3 00 00 00 00 00 00 00"),
    (BlockUploadEnd(), "A1 00 00 00 00 00 00 00"),
    (BlockDownloadInitiate(0x1400, 2, crc=False, size=None), "C0 00 14 02 00 00 00 00"),
    (BlockDownloadEnd(unused=6, crc=0), "D9 00 00 00 00 00 00 00"),
    (BlockDownloadInitiate(0x1017, 0, crc=True, size=2), "C6 17 10 00 02 00 00 00"),
    (BlockDownloadEnd(unused=0, crc=0x31C3), "C1 C3 31 00 00 00 00 00"),
    (BlockUploadInitiate(0x1008, 0, True, 20, 0), "A4 08 10 00 14 00 00 00"),
    # CiA's conformance test tool, case 2.26: a block size that the server refuses.
    (BlockUploadInitiate(0x1000, 0, False, 128, 8), "A0 00 10 00 80 08 00 00"),
    (BlockUploadAck(ack_sequence=2, block_size=127), "A2 02 7F 00 00 00 00 00"),
]

RESPONSES: list[tuple[Response, str]] = [
    # Danfoss DST X730, example 1.
    (InitiateDownloadAck(0x20F2, 0), "60 F2 20 00 00 00 00 00"),
    (DownloadSegmentAck(toggle=False), "20 00 00 00 00 00 00 00"),
    (DownloadSegmentAck(toggle=True), "30 00 00 00 00 00 00 00"),
    (InitiateUploadReply(0x1000, 0, b"\x9a\1\2\0"), "43 00 10 00 9A 01 02 00"),
    (InitiateUploadReply(0x1017, 0, b"\xe8\3"), "4B 17 10 00 E8 03 00 00"),
    (InitiateUploadReply(0x1001, 0, b"\0"), "4F 01 10 00 00 00 00 00"),
    (InitiateUploadReply(0x1001, 0, bytes(4), size=None), "42 01 10 00 00 00 00 00"),
    # Bonfiglioli CM-CAN manual, example 2: "CANopen device" in two segments.
    (InitiateUploadReply(0x200C, 0, expedited=False, size=9), "41 0C 20 00 09 00 00 00"),
    (UploadSegmentReply(False, b"CANopen", False), "00 43 41 4E 6F 70 65 6E"),
    (UploadSegmentReply(True, b" device", True), "11 20 64 65 76 69 63 65"),
    (InitiateUploadReply(0x1008, 0, expedited=False), "40 08 10 00 00 00 00 00"),
    (Abort(0x1000, 1, AbortCode.SUB_INDEX_DOES_NOT_EXIST), "80 00 10 01 11 00 09 06"),
    (Abort(0x1000, 0, 0xDEADBEEF), "80 00 10 00 EF BE AD DE"),
    # ICP DAS CAN-8x23 manual, as above.
    (BlockUploadEndReply(unused=5, crc=0), "D5 00 00 00 00 00 00 00"),
    (BlockDownloadInitiateAck(0x1400, 2, False, 127), "A0 00 14 02 7F 00 00 00"),
    (BlockDownloadEndAck(), "A1 00 00 00 00 00 00 00"),
    (BlockDownloadInitiateAck(0x1017, 0, True, 127), "A4 17 10 00 7F 00 00 00"),
    (BlockDownloadSubAck(ack_sequence=1, block_size=127), "A2 01 7F 00 00 00 00 00"),
    (BlockUploadInitiateReply(0x1008, 0, crc=True, size=16), "C6 08 10 00 10 00 00 00"),
    (BlockUploadInitiateReply(0x1008, 0, crc=False, size=None), "C0 08 10 00 00 00 00 00"),
    # CiA's conformance test tool, case 2.23: CRC 43F3h in the end frame.
    (BlockUploadEndReply(unused=5, crc=0x43F3), "D5 F3 43 00 00 00 00 00"),
]

SEGMENTS: list[tuple[BlockSegment, str]] = [
    # ICP DAS CAN-8x23 manual: the first segment of a block.
    (BlockSegment(1, last=False, data7=b"CAN-842"), "01 43 41 4E 2D 38 34 32"),
    (BlockSegment(127, last=True, data7=bytes(7)), "FF 00 00 00 00 00 00 00"),
]

BOTH_WAYS: list[tuple[Message, str, Callable[[bytes], Message]]] = [
    *((message, data, decode_request) for message, data in REQUESTS),
    *((message, data, decode_response) for message, data in RESPONSES),
    *((message, data, decode_block_segment) for message, data in SEGMENTS),
]


@pytest.mark.parametrize(("message", "data", "decode"), BOTH_WAYS)
def test_a_message_encodes_and_decodes(
    message: Message, data: str, decode: Callable[[bytes], Message]
) -> None:
    assert encode(message).hex(" ").upper() == data
    assert decode(bytes.fromhex(data)) == message


@pytest.mark.parametrize(("message", "data", "decode"), BOTH_WAYS)
def test_a_message_of_another_length_is_refused(
    message: Message, data: str, decode: Callable[[bytes], Message]
) -> None:
    whole = bytes.fromhex(data)
    for wrong in (*(whole[:length] for length in range(8)), whole + b"\0"):
        with pytest.raises(WireError, match=f"expected 8 bytes, got {len(wrong)}"):
            decode(wrong)
    assert decode(whole) == message


def test_the_table_holds_each_message() -> None:
    tried = {type(message) for message, _, _ in BOTH_WAYS}
    assert tried == {*Request.__args__, *Response.__args__, BlockSegment}


@pytest.mark.parametrize("command", range(0xE0, 0x100))
def test_command_specifier_7_is_unknown(command: int) -> None:
    data = bytes([command]) + bytes(7)
    with pytest.raises(WireError, match=f"SDO request: expected a known .*, got {command:02X} 00"):
        decode_request(data)
    with pytest.raises(WireError, match=f"SDO response: expected a known .*, got {command:02X} 00"):
        decode_response(data)


def test_subcommand_3_of_a_block_download_response_is_unknown() -> None:
    with pytest.raises(WireError, match="got A3 00"):
        decode_response(b"\xa3" + bytes(7))


@pytest.mark.parametrize(
    ("data", "decode", "message"),
    [
        # Reserved: bits 4 to 0 and bytes 4 to 7 of an upload, n unless e = s = 1, n with s = 0.
        ("5F 00 10 00 AA BB CC DD", decode_request, InitiateUpload(0x1000, 0)),
        ("3C 17 10 00 AA BB CC DD", decode_request, InitiateDownload(0x1017, 0, expedited=False)),
        (
            "2E 17 10 00 AA BB CC DD",
            decode_request,
            InitiateDownload(0x1017, 0, bytes.fromhex("AABBCCDD"), size=None),
        ),
        (
            "27 00 20 00 01 02 03 FF",
            decode_request,
            InitiateDownload(0x2000, 0, b"\x01\x02\x03"),
        ),
        ("9F 17 10 00 00 00 04 05", decode_request, Abort(0x1017, 0, 0x0504_0000)),
        ("0B 01 02 FF FF FF FF FF", decode_request, DownloadSegment(False, b"\1\2", True)),
        ("C4 00 10 00 01 00 00 00", decode_request, BlockDownloadInitiate(0x1000, 0, True, None)),
        ("BF FF FF FF FF FF FF FF", decode_request, BlockUploadStart()),
        ("7F 17 10 00 FF FF FF FF", decode_response, InitiateDownloadAck(0x1017, 0)),
        ("3F FF FF FF FF FF FF FF", decode_response, DownloadSegmentAck(True)),
        ("DF 34 12 FF FF FF FF FF", decode_response, BlockUploadEndReply(7, 0x1234)),
    ],
)
def test_reserved_bits_are_ignored(
    data: str, decode: Callable[[bytes], Message], message: Message
) -> None:
    assert decode(bytes.fromhex(data)) == message


@pytest.mark.parametrize(
    "data", ["80 00 10 00 02 00 04 05", "00 00 00 00 00 00 00 00"], ids=["abort", "sequence 0"]
)
def test_sequence_number_0_is_no_block_segment(data: str) -> None:
    with pytest.raises(WireError, match="sequence number of block segment: expected 1h to 7Fh"):
        decode_block_segment(bytes.fromhex(data))


def test_requests_and_responses_of_one_layout_differ() -> None:
    pairs: list[tuple[Message, Message]] = [
        (BlockUploadEnd(), BlockDownloadEndAck()),
        (DownloadSegment(False, b"", True), UploadSegmentReply(False, b"", True)),
    ]
    for request, response in pairs:
        assert request != response
        assert encode(request) == encode(response)


def test_expedited_data_without_size_fill_the_field() -> None:
    assert InitiateUploadReply(0x1017, 0, b"\xe8\3", size=None).data == b"\xe8\3\0\0"


def test_the_size_is_that_of_the_data_unless_said_otherwise() -> None:
    assert InitiateDownload(0x1017, 0, b"\1\2").size == 2
    assert InitiateDownload(0x1017, 0, expedited=False).size is None


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: InitiateDownload(0x2000, 0, b""), "expedited SDO: expected 1 or 2 or 3 or 4"),
        (lambda: InitiateDownload(0x2000, 0, bytes(5)), r"got 5 \(00 00 00 00 00\)"),
        (lambda: InitiateDownload(0x2000, 0, b"\1", size=2), "expected size 1, got 2"),
        (lambda: InitiateDownload(0x2000, 0, b"\1", expedited=False), "segmented SDO initiate"),
        (lambda: encode(DownloadSegment(False, bytes(8), True)), "SDO segment: .* got 8"),
        (lambda: encode(BlockDownloadEnd(8, 0)), "unused bytes .*: expected 0h to 7h, got 8h"),
        (lambda: encode(BlockUploadEndReply(0, 0x10000)), "crc=65536"),
        (lambda: BlockSegment(128, False, bytes(7)), "sequence number .* got 80h"),
        (lambda: BlockSegment(1, False, bytes(6)), "data of block segment: expected 7 bytes"),
        (lambda: encode(BlockUploadAck(256, 1)), "ack_sequence=256"),
        (lambda: encode(InitiateUpload(0x10000, 0)), "index=65536"),
        (lambda: encode(Abort(0x1000, 256, 0)), "sub=256"),
        (lambda: encode(InitiateDownload(0x1000, 0, expedited=False, size=2**32)), "4294967296"),
        (lambda: encode(BlockUploadInitiate(0x1000, 0, False, 1, 256)), "threshold=256"),
    ],
)
def test_a_message_that_does_not_fit_its_fields_is_refused(
    build: Callable[[], object], message: str
) -> None:
    with pytest.raises(WireError, match=message):
        build()


def test_the_crc_is_that_of_the_standard() -> None:
    # CiA 301 v4.2.0, 7.2.4.3.16, gives this check value.
    assert crc16_ccitt(b"123456789") == 0x31C3
    assert crc16_ccitt(b"") == 0


@given(
    st.sampled_from([decode_request, decode_response, decode_block_segment]),
    st.binary(max_size=9) | st.binary(min_size=8, max_size=8),
)
def test_any_data_decode_to_a_message_that_survives_or_are_refused(
    decode: Callable[[bytes], Message], data: bytes
) -> None:
    try:
        message = decode(data)
    except WireError:
        return
    assert decode(encode(message)) == message


u8, u16, u32 = st.integers(0, 0xFF), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF_FFFF)


@given(
    st.builds(InitiateDownload, u16, u8, st.binary(min_size=1, max_size=4))
    | st.builds(InitiateDownload, u16, u8, st.just(b""), st.just(False), st.none() | u32)
    | st.builds(DownloadSegment, st.booleans(), st.binary(max_size=7), st.booleans())
    | st.builds(BlockDownloadInitiate, u16, u8, st.booleans(), st.none() | u32)
    | st.builds(BlockDownloadEnd, st.integers(0, 7), u16)
    | st.builds(BlockUploadInitiate, u16, u8, st.booleans(), u8, u8)
    | st.builds(BlockUploadAck, u8, u8)
    | st.builds(Abort, u16, u8, u32),
)
def test_a_request_survives_the_wire(message: Request) -> None:
    assert decode_request(encode(message)) == message
