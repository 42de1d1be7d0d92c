"""The ways in which EDS files write values."""

from __future__ import annotations

import pytest

from conformance.spec.eds.values import Relative, parse_number, parse_value
from conformance.wire.datatypes import DataType

GOOD = [
    ("10", "UNSIGNED8", 10),
    ("0x1F", "UNSIGNED8", 0x1F),
    ("0X1f", "UNSIGNED8", 0x1F),
    ("0x00016", "UNSIGNED8", 0x16),
    ("007", "UNSIGNED8", 7),
    ("-5", "INTEGER8", -5),
    ("-0x80", "INTEGER8", -128),
    ("0xFF", "INTEGER8", -1),
    ("0xFFFFFFFF", "INTEGER32", -1),
    ("-0", "UNSIGNED8", 0),
    ("0xFFFFFFFFFFFFFFFF", "UNSIGNED64", 2**64 - 1),
    ("$NODEID+0x180", "UNSIGNED32", Relative(0x180)),
    ("$NodeID + 0x180", "UNSIGNED32", Relative(0x180)),
    ("$NODEID+384", "UNSIGNED32", Relative(384)),
    ("$NODEID", "UNSIGNED8", Relative(0)),
    ("1", "BOOLEAN", "1"),
    ("false", "BOOLEAN", "0"),
    ("1.5", "REAL32", "1.5"),
    ("1e3", "REAL64", "1e3"),
    ("A ; b", "VISIBLE_STRING", "A ; b"),
    ("grün", "UNICODE_STRING", "grün"),
    ("00 41ff", "OCTET_STRING", "\0Aÿ"),
    ("01 02 03 04 05 06", "TIME_OF_DAY", "\1\2\3\4\5\6"),
]
ODD = [
    ("0x180+$NODEID", "UNSIGNED32", Relative(0x180), "expected $NODEID first"),
    ("NODEID+0x180", "UNSIGNED32", Relative(0x180), "expected $NODEID first"),
    ("010", "UNSIGNED8", 8, "(read as octal, 8)"),
    ("08", "UNSIGNED8", 8, "(read as decimal, 8)"),
    ("0x12LL", "UNSIGNED8", 0x12, "expected a number without suffix"),
    ("5 ; five", "UNSIGNED8", 5, "expected a value alone"),
]
BAD = [
    ("256", "UNSIGNED8", "expected 0 to 255 for UNSIGNED8, got '256'"),
    ("-1", "UNSIGNED8", "expected 0 to 255 for UNSIGNED8, got '-1'"),
    ("255", "INTEGER8", "expected -128 to 127 for INTEGER8, got '255'"),
    ("0x100", "INTEGER8", "expected -128 to 127 for INTEGER8, got '0x100'"),
    ("$NODEID+0xF0", "UNSIGNED8", "expected 0 to 255 for UNSIGNED8"),
    ("$NODEID-1", "UNSIGNED8", "expected a formula such as $NODEID+0x180"),
    ("$NODEID+$NODEID", "UNSIGNED8", "expected an integer, got"),
    ("\\+384", "UNSIGNED32", "expected an integer, got '\\\\+384'"),
    ("1.0", "UNSIGNED8", "expected an integer, got '1.0'"),
    ("٣", "UNSIGNED8", "expected an integer, got '٣'"),
    ("1" * 100, "UNSIGNED64", "expected an integer, got '111"),
    ("2", "BOOLEAN", "expected 0 or 1, got '2'"),
    ("0x3F800000", "REAL32", "expected a REAL32, got '0x3F800000'"),
    ("1e99", "REAL32", "expected a REAL32, got '1e99'"),
    ("inf", "REAL64", "expected a finite number, got 'inf'"),
    ("naïve", "VISIBLE_STRING", "expected printable ASCII characters, got 'naïve'"),
    ("0", "DOMAIN", "expected hexadecimal octets for DOMAIN, got '0'"),
    ("01", "TIME_OF_DAY", "expected hexadecimal octets for TIME_OF_DAY, got '01'"),
]


@pytest.mark.parametrize(("text", "kind", "value"), GOOD)
def test_a_value_is_read(text: str, kind: str, value: object) -> None:
    parsed = parse_value(text, DataType[kind])

    assert (parsed.value, parsed.remark) == (value, "")


@pytest.mark.parametrize(("text", "kind", "value", "remark"), ODD)
def test_an_odd_value_is_read_with_a_remark(
    text: str, kind: str, value: object, remark: str
) -> None:
    parsed = parse_value(text, DataType[kind])

    assert parsed.value == value
    assert remark in parsed.remark


@pytest.mark.parametrize(("text", "kind", "sentence"), BAD)
def test_what_is_no_value_of_the_type_is_refused(text: str, kind: str, sentence: str) -> None:
    with pytest.raises(ValueError) as caught:
        parse_value(text, DataType[kind])

    assert sentence in str(caught.value)


def test_a_number_longer_than_any_type_is_refused() -> None:
    with pytest.raises(ValueError, match="at most 64 bits"):
        parse_number("0x1" + "0" * 16)
