"""PDO mapping and bit packing both ways."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.wire.errors import WireError
from conformance.wire.pdo import MappingEntry, pack, unpack

ENTRIES = [
    (MappingEntry(0x3010, 0x01, 16), 0x3010_0110, "3010 0110h"),
    (MappingEntry(0x6010, 0x00, 16), 0x6010_0010, "6010 0010h"),
    (MappingEntry(0x0005, 0x00, 8), 0x0005_0008, "0005 0008h"),
    (MappingEntry(0xFFFF, 0xFF, 255), 0xFFFF_FFFF, "FFFF FFFFh"),
]

PDOS: list[tuple[list[tuple[int, int]], str]] = [
    ([], ""),
    # Danfoss DST X730, PDO mapping example: +45.00 degrees and 0.00 degrees.
    ([(4500, 16), (0, 16), (0, 32)], "94 11 00 00 00 00 00 00"),
    # The same manual's -45.00 degrees.
    ([(0xEE6B, 16), (0, 48)], "6B EE 00 00 00 00 00 00"),
    # Fields of less than a byte begin with bit 0 of byte 0.
    ([(1, 1)], "01"),
    ([(0, 1), (1, 1), (0, 6)], "02"),
    ([(1, 1), (0b101, 3), (0xF, 4)], "FB"),
    ([(1, 1), (0x1234, 16)], "69 24 00"),
    ([(0x5, 4), (0xABC, 12), (0xFFFF_FFFF_FFFF, 48)], "C5 AB FF FF FF FF FF FF"),
    ([(0x8877_6655_4433_2211, 64)], "11 22 33 44 55 66 77 88"),
]


@pytest.mark.parametrize(("entry", "word", "text"), ENTRIES)
def test_a_mapping_entry_encodes_and_decodes(entry: MappingEntry, word: int, text: str) -> None:
    assert entry.to_word() == word
    assert MappingEntry.from_word(word) == entry
    assert str(entry) == text


@pytest.mark.parametrize("word", [-1, 2**32])
def test_a_word_beyond_unsigned32_is_no_mapping_entry(word: int) -> None:
    with pytest.raises(WireError, match="mapping entry: expected 0h to FFFFFFFFh"):
        MappingEntry.from_word(word)


@pytest.mark.parametrize(
    ("index", "sub", "bits"), [(0x10000, 0, 8), (0x2000, 0x100, 8), (0x2000, 0, 256)]
)
def test_a_mapping_entry_that_does_not_fit_is_refused(index: int, sub: int, bits: int) -> None:
    with pytest.raises(WireError, match="mapped"):
        MappingEntry(index, sub, bits)


@pytest.mark.parametrize(("fields", "data"), PDOS)
def test_a_pdo_packs_and_unpacks(fields: list[tuple[int, int]], data: str) -> None:
    assert pack(fields) == bytes.fromhex(data)
    bits = [bits for _, bits in fields]
    assert unpack(bytes.fromhex(data), bits) == tuple(value for value, _ in fields)


@pytest.mark.parametrize(("fields", "data"), PDOS[1:])
def test_a_pdo_cut_short_is_refused(fields: list[tuple[int, int]], data: str) -> None:
    whole = bytes.fromhex(data)
    for length in range(len(whole)):
        with pytest.raises(WireError, match=f"PDO: expected at most {8 * length} bits"):
            unpack(whole[:length], [bits for _, bits in fields])


def test_bytes_behind_the_last_field_are_ignored() -> None:
    assert unpack(bytes.fromhex("94 11 FF FF FF FF FF FF"), [16]) == (4500,)


def test_more_than_eight_bytes_are_no_pdo() -> None:
    with pytest.raises(WireError, match=r"expected at most 8 bytes, got 9 \(00 "):
        unpack(bytes(9), [8])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ([(256, 8)], "PDO field of 8 bits: expected 0h to FFh, got 100h"),
        ([(-1, 8)], "got -1h"),
        ([(0, 64), (0, 1)], "expected at most 64 bits, got 65"),
        ([(0, 0)], "length of a PDO field: expected 1h to 40h, got 0h"),
        ([(0, 65)], "length of a PDO field: expected 1h to 40h, got 41h"),
    ],
)
def test_fields_that_do_not_fit_are_refused(fields: list[tuple[int, int]], message: str) -> None:
    with pytest.raises(WireError, match=message):
        pack(fields)


@given(st.lists(st.integers(1, 16), max_size=4), st.data())
def test_fields_survive_the_wire(bits: list[int], data: st.DataObject) -> None:
    values = tuple(data.draw(st.integers(0, 2**width - 1)) for width in bits)
    packed = pack(list(zip(values, bits, strict=True)))
    assert len(packed) == (sum(bits) + 7) // 8
    assert unpack(packed, bits) == values


@given(st.binary(max_size=10), st.lists(st.integers(-1, 70), max_size=8))
def test_any_data_unpack_or_are_refused(data: bytes, bits: list[int]) -> None:
    try:
        values = unpack(data, bits)
    except WireError:
        return
    assert len(values) == len(bits)


@given(st.integers(0, 0xFFFF_FFFF))
def test_any_word_is_a_mapping_entry(word: int) -> None:
    assert MappingEntry.from_word(word).to_word() == word
