"""Data types both ways."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.wire.datatypes import DataType, Value
from conformance.wire.errors import WireError

INTEGERS = [kind for kind in DataType if kind.name.startswith(("INTEGER", "UNSIGNED"))]

BOTH_WAYS: list[tuple[DataType, Value, str]] = [
    (DataType.BOOLEAN, False, "00"),
    (DataType.BOOLEAN, True, "01"),
    # Danfoss DST X730, PDO mapping example: 94h 11h is 4500.
    (DataType.INTEGER16, 4500, "94 11"),
    (DataType.INTEGER16, -4500, "6C EE"),
    # Baumer GIM140R, 7.3: 84h 03h is 900.
    (DataType.UNSIGNED16, 900, "84 03"),
    # SIKO IMS360, 5.1.4.2: exponent -3 is FDh.
    (DataType.INTEGER8, -3, "FD"),
    (DataType.INTEGER24, -2, "FE FF FF"),
    (DataType.INTEGER32, -(2**31), "00 00 00 80"),
    (DataType.INTEGER40, 2**39 - 1, "FF FF FF FF 7F"),
    (DataType.INTEGER48, -1, "FF FF FF FF FF FF"),
    (DataType.INTEGER56, 1, "01 00 00 00 00 00 00"),
    (DataType.INTEGER64, -(2**63), "00 00 00 00 00 00 00 80"),
    (DataType.UNSIGNED8, 0xFE, "FE"),
    (DataType.UNSIGNED24, 0x123456, "56 34 12"),
    # 1010h: the signature "save" is 6576 6173h.
    (DataType.UNSIGNED32, 0x6576_6173, "73 61 76 65"),
    (DataType.UNSIGNED40, 2**40 - 1, "FF FF FF FF FF"),
    (DataType.UNSIGNED48, 1, "01 00 00 00 00 00"),
    (DataType.UNSIGNED56, 1, "01 00 00 00 00 00 00"),
    (DataType.UNSIGNED64, 2**64 - 1, "FF FF FF FF FF FF FF FF"),
    # IEEE 754: 1.5 is 3FC0 0000h.
    (DataType.REAL32, 1.5, "00 00 C0 3F"),
    (DataType.REAL64, -2.0, "00 00 00 00 00 00 00 C0"),
    # SIKO IMS360, 1008h.
    (DataType.VISIBLE_STRING, "IMS360", "49 4D 53 33 36 30"),
    (DataType.VISIBLE_STRING, "IMS360\0", "49 4D 53 33 36 30 00"),
    (DataType.VISIBLE_STRING, " ~", "20 7E"),
    (DataType.VISIBLE_STRING, "", ""),
    (DataType.OCTET_STRING, b"\x00\xff", "00 FF"),
    (DataType.UNICODE_STRING, "Aß", "41 00 DF 00"),
    (DataType.TIME_OF_DAY, b"\x01\x02\x03\x04\x05\x06", "01 02 03 04 05 06"),
    (DataType.TIME_DIFFERENCE, bytes(6), "00 00 00 00 00 00"),
    (DataType.DOMAIN, b"abc", "61 62 63"),
]


@pytest.mark.parametrize(("kind", "value", "data"), BOTH_WAYS)
def test_a_value_encodes_and_decodes(kind: DataType, value: Value, data: str) -> None:
    assert kind.encode(value) == bytes.fromhex(data)
    decoded = kind.decode(bytes.fromhex(data))
    assert decoded == value
    assert type(decoded) is type(value)


def test_each_data_type_is_in_the_table() -> None:
    assert {kind for kind, _, _ in BOTH_WAYS} == set(DataType)


@pytest.mark.parametrize("kind", [kind for kind in DataType if kind.size is not None])
def test_data_of_another_length_are_refused(kind: DataType) -> None:
    for length in set(range(10)) - {kind.size}:
        with pytest.raises(WireError, match=f"{kind.name}: expected {kind.size} bytes"):
            kind.decode(bytes(length))


@pytest.mark.parametrize(
    ("kind", "bits", "size"),
    [
        (DataType.BOOLEAN, 1, 1),
        (DataType.UNSIGNED24, 24, 3),
        (DataType.REAL64, 64, 8),
        (DataType.TIME_OF_DAY, 48, 6),
        (DataType.VISIBLE_STRING, None, None),
        (DataType.DOMAIN, None, None),
    ],
)
def test_bits_and_size_follow_the_type(kind: DataType, bits: int | None, size: int | None) -> None:
    assert (kind.bits, kind.size) == (bits, size)


def test_the_codes_are_those_of_the_object_dictionary() -> None:
    # CiA 301 v4.2.0, 7.4.7; 0Eh and 17h are reserved.
    names = (
        "BOOLEAN INTEGER8 INTEGER16 INTEGER32 UNSIGNED8 UNSIGNED16 UNSIGNED32 REAL32 "
        "VISIBLE_STRING OCTET_STRING UNICODE_STRING TIME_OF_DAY TIME_DIFFERENCE - DOMAIN INTEGER24 "
        "REAL64 INTEGER40 INTEGER48 INTEGER56 INTEGER64 UNSIGNED24 - UNSIGNED40 UNSIGNED48 "
        "UNSIGNED56 UNSIGNED64"
    )
    codes = {name: code for code, name in enumerate(names.split(), 1) if name != "-"}
    assert {kind.name: int(kind) for kind in DataType} == codes


def test_only_integers_have_limits() -> None:
    assert [kind for kind in DataType if kind.is_integer] == INTEGERS
    assert (DataType.INTEGER24.minimum, DataType.INTEGER24.maximum) == (-(2**23), 2**23 - 1)
    assert (DataType.UNSIGNED56.minimum, DataType.UNSIGNED56.maximum) == (0, 2**56 - 1)
    for kind in set(DataType) - set(INTEGERS):
        with pytest.raises(WireError, match=f"{kind.name}: expected an integer type"):
            _ = kind.minimum
        with pytest.raises(WireError, match=f"{kind.name}: expected an integer type"):
            _ = kind.maximum


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [
        (DataType.BOOLEAN, 2, "BOOLEAN: expected 0 or 1, got 2"),
        (DataType.UNSIGNED8, 256, "UNSIGNED8: expected an integer 0 to 255, got 256"),
        (DataType.UNSIGNED8, -1, "got -1"),
        (DataType.INTEGER8, 128, "expected an integer -128 to 127, got 128"),
        (DataType.INTEGER8, -129, "got -129"),
        (DataType.UNSIGNED8, 1.0, "got 1.0"),
        (DataType.UNSIGNED8, True, "got True"),
        (DataType.UNSIGNED8, "1", "got '1'"),
        (DataType.REAL32, 1e39, "expected 32 bits to suffice, got 1e"),
        pytest.param(DataType.REAL64, 10**309, "expected 64 bits to suffice", id="REAL64-10**309"),
        (DataType.REAL32, "1", "expected a number, got '1'"),
        (DataType.REAL32, True, "expected a number, got True"),
        (DataType.VISIBLE_STRING, "Grüße", "expected text of characters 00h and 20h to 7Eh"),
        (DataType.VISIBLE_STRING, b"ab", "expected text of characters 00h and 20h to 7Eh"),
        (DataType.UNICODE_STRING, b"ab", "expected text, got b'ab'"),
        (DataType.UNICODE_STRING, "\ud800", "expected Unicode text"),
        (DataType.OCTET_STRING, "ab", "expected bytes, got 'ab'"),
        (DataType.TIME_OF_DAY, bytes(5), "TIME_OF_DAY: expected 6 bytes, got 5"),
    ],
)
def test_a_value_that_does_not_fit_is_refused(kind: DataType, value: Value, message: str) -> None:
    with pytest.raises(WireError, match=message):
        kind.encode(value)


@pytest.mark.parametrize(
    ("kind", "data", "message"),
    [
        (DataType.BOOLEAN, "02", "expected 00 or 01, got 02"),
        (DataType.VISIBLE_STRING, "49 0A", "expected bytes 00h and 20h to 7Eh, got 49 0A"),
        (DataType.VISIBLE_STRING, "7F", "got 7F"),
        (DataType.UNICODE_STRING, "41", "expected UTF-16, got 41"),
        (DataType.UNICODE_STRING, "00 D8", "expected UTF-16, got 00 D8"),
    ],
)
def test_data_the_type_excludes_are_refused(kind: DataType, data: str, message: str) -> None:
    with pytest.raises(WireError, match=message):
        kind.decode(bytes.fromhex(data))


@given(st.sampled_from(INTEGERS), st.data())
def test_an_integer_survives_the_wire(kind: DataType, data: st.DataObject) -> None:
    value = data.draw(st.integers(kind.minimum, kind.maximum))
    assert kind.decode(kind.encode(value)) == value


@given(st.floats(width=32))
def test_a_real_survives_the_wire(value: float) -> None:
    decoded = DataType.REAL32.decode(DataType.REAL32.encode(value))
    assert decoded == value or math.isnan(value)


@given(st.sampled_from(DataType), st.binary(max_size=12))
def test_any_data_decode_to_what_encodes_to_them_or_are_refused(
    kind: DataType, data: bytes
) -> None:
    try:
        value = kind.decode(data)
    except WireError:
        return
    if not (isinstance(value, float) and math.isnan(value)):
        assert kind.encode(value) == data
