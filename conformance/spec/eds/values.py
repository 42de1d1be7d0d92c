"""Values as EDS files write them (CiA 306-1, number formats): integers, node-ID, texts, octets.

A value that can be read but is not written as CiA 306 has it comes with a remark.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TypeAlias

from conformance.spec.yaml_reader import shown
from conformance.wire.datatypes import DataType
from conformance.wire.errors import WireError

_INTEGER = re.compile(r"([+-]?)(?:0x([0-9a-f]+)|([0-9]+))([ul]{0,3})", re.IGNORECASE)
_NODE_ID = re.compile(r"\$?NODE_?ID", re.IGNORECASE)
_COMMENT = re.compile(r"\s+;.*")
_MOST_BITS = 64
_HIGHEST_NODE_ID = 127
_TRUTH = {"0": "0", "1": "1", "false": "0", "true": "1", "0x0": "0", "0x1": "1"}


@dataclass(frozen=True, slots=True)
class Relative:
    """An integer that counts from the node-ID: ``$NODEID+0x180``."""

    offset: int

    def at(self, node_id: int) -> int:
        """Return the value for one node-ID."""
        return self.offset + node_id

    def __str__(self) -> str:
        return f"$NODEID+{self.offset:#x}"


Number: TypeAlias = int | Relative
EdsValue: TypeAlias = int | Relative | str


@dataclass(frozen=True, slots=True)
class Parsed:
    """A value and what is odd about the way it is written, empty if nothing is."""

    value: EdsValue
    remark: str = ""


def parse_value(text: str, kind: DataType) -> Parsed:
    """Return the value of a text for a data type; texts and octets as a device spec has them.

    Raises:
        ValueError: It is no such value; ``expected …, got …``.
    """
    if kind.is_integer:
        return parse_limit(text, kind)
    if kind in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return _text(text, kind)
    plain, remark = _without_comment(text)
    if kind is DataType.BOOLEAN:
        if plain.lower() not in _TRUTH:
            raise ValueError(f"expected 0 or 1, got {shown(text)}")
        return Parsed(_TRUTH[plain.lower()], remark)
    if kind in (DataType.REAL32, DataType.REAL64):
        return Parsed(_real(plain, kind), remark)
    return Parsed(_octets(plain, kind), remark)


def parse_limit(text: str, kind: DataType) -> Parsed:
    """Return an integer within the limits of its type; hexadecimal may be two's complement.

    Raises:
        ValueError: It is no such value.
    """
    number, remark = parse_number(text)
    low, high = kind.minimum, kind.maximum
    if isinstance(number, Relative):
        ends = (number.at(1), number.at(_HIGHEST_NODE_ID))
        if not low <= ends[0] <= ends[1] <= high:
            raise ValueError(f"expected {low} to {high} for {kind.name}, got {shown(text)}")
        return Parsed(number, remark)
    if high < number <= high - low and "x" in text.lower():
        number -= high - low + 1
    if not low <= number <= high:
        raise ValueError(f"expected {low} to {high} for {kind.name}, got {shown(text)}")
    return Parsed(number, remark)


def parse_number(text: str) -> tuple[Number, str]:
    """Return an integer or a node-ID formula, with what is odd about it.

    Raises:
        ValueError: It is neither.
    """
    plain, remark = _without_comment(text)
    if not _NODE_ID.search(plain):
        number, odd = _integer(plain)
        return number, remark or odd
    rest = _NODE_ID.sub("", plain, count=1).replace(" ", "")
    if not (plain.upper().lstrip().startswith("$NODEID")):
        remark = remark or f"expected $NODEID first, got {shown(text)}"
    if not rest:
        return Relative(0), remark
    if rest.startswith("+") == rest.endswith("+"):
        raise ValueError(f"expected a formula such as $NODEID+0x180, got {shown(text)}")
    offset, odd = _integer(rest.strip("+"))
    return Relative(offset), remark or odd


def _integer(text: str) -> tuple[int, str]:
    match = _INTEGER.fullmatch(text)
    if match is None or len(text) > _MOST_BITS + 4:
        raise ValueError(f"expected an integer, got {shown(text)}")
    sign, hexadecimal, decimal, suffix = match.groups()
    remark = f"expected a number without suffix, got {shown(text)}" if suffix else ""
    if hexadecimal is not None:
        value = int(hexadecimal, 16)
    elif decimal[0] == "0" and len(decimal) > 1:
        octal = not set(decimal) & {"8", "9"}
        value = int(decimal, 8 if octal else 10)
        if value != int(decimal) or not octal:
            how = f"octal, {value}" if octal else f"decimal, {value}"
            remark = f"expected a number without leading zeros, got {shown(text)} (read as {how})"
    else:
        value = int(decimal)
    if value.bit_length() > _MOST_BITS:
        raise ValueError(f"expected an integer of at most {_MOST_BITS} bits, got {shown(text)}")
    return (-value if sign == "-" else value), remark


def _without_comment(text: str) -> tuple[str, str]:
    plain = _COMMENT.sub("", text)
    return plain, "" if plain == text else f"expected a value alone, got {shown(text)}"


def _text(text: str, kind: DataType) -> Parsed:
    try:
        kind.encode(text)
    except WireError as error:
        wanted = "printable ASCII characters" if kind is DataType.VISIBLE_STRING else "Unicode text"
        raise ValueError(f"expected {wanted}, got {shown(text)}") from error
    return Parsed(text)


def _real(text: str, kind: DataType) -> str:
    try:
        value = float(text)
        kind.encode(value)
    except (ValueError, WireError) as error:
        raise ValueError(f"expected a {kind.name}, got {shown(text)}") from error
    if not math.isfinite(value):
        raise ValueError(f"expected a finite number, got {shown(text)}")
    return text


def _octets(text: str, kind: DataType) -> str:
    try:
        data = bytes.fromhex(text)
        kind.encode(data)
    except (ValueError, WireError) as error:
        raise ValueError(
            f"expected hexadecimal octets for {kind.name}, got {shown(text)}"
        ) from error
    return data.decode("latin-1")
