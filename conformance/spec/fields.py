"""Kinds of values in a device spec file, with what a person is told about a wrong one."""

from __future__ import annotations

import re
from datetime import date
from typing import Annotated, Literal, TypeAlias, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    WithJsonSchema,
)

from conformance.spec.yaml_reader import shown
from conformance.wire.datatypes import DataType

T = TypeVar("T")

State: TypeAlias = Literal["pre-operational", "operational", "stopped"]
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")
_AMBIGUITY_ID = re.compile(r"[A-Z0-9]+-[0-9]{2,3}")
_MOST = (0xFFFF, 0xFF)
_FOUR_CHARACTERS = re.compile(r"[ -~]{4}")


def _known_type(name: str) -> str:
    if name not in DataType.__members__:
        raise ValueError(f"expected a CiA 301 data type such as UNSIGNED16, got {shown(name)}")
    return name


def _integer_or_text(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise ValueError(f"expected an integer or a text, got {shown(value)}")  # noqa: TRY004 - pydantic's protocol
    return value


def _number(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"expected a number, got {shown(value)}")  # noqa: TRY004 - pydantic's protocol
    return value


def _either_or_integer(value: object) -> object:
    if value != "either" and (isinstance(value, bool) or not isinstance(value, int)):
        raise ValueError(f"expected 'either' or the number of a reading, got {shown(value)}")
    return value


def _date(value: object) -> date:
    try:
        if isinstance(value, str) and _DATE.fullmatch(value):
            return date.fromisoformat(value)
    except ValueError:
        pass
    raise ValueError(f"expected a date such as 2025-05-15, got {shown(value)}")


def _interval(value: object) -> object:
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"expected two values, lowest and highest, got {shown(value)}")
    return value


def _ambiguity_id(value: str) -> str:
    if not _AMBIGUITY_ID.fullmatch(value):
        raise ValueError(f"expected an id such as X-07, got {shown(value)}")
    return value


def _address(value: object) -> object:
    index, _, sub = value.partition(":") if isinstance(value, str) else ("", "", "")
    numbers = [value] if isinstance(value, int) else [_integer(index), _integer(sub or "0")]
    fits = all(n is not None and 0 <= n <= most for n, most in zip(numbers, _MOST, strict=False))
    if isinstance(value, bool) or not fits:
        raise ValueError(f'expected an index or an address such as "0x3110:1", got {shown(value)}')
    return value


def _integer(text: str) -> int | None:
    try:
        return int(text, 0)
    except ValueError:
        return None


def _signature(value: str) -> str:
    if not _FOUR_CHARACTERS.fullmatch(value):
        raise ValueError(f"expected four characters such as save, got {shown(value)}")
    return value


def shape(value: object) -> str:
    """Tell a value from a mapping of variant names to values."""
    by_variant = isinstance(value, dict) and value and all(isinstance(k, str) for k in value)
    return "by_variant" if by_variant else "plain"


def key_of(address: int | str) -> tuple[int, int]:
    """Return index and sub-index of an address such as ``0x1017`` or ``"0x3110:1"``.

    Raises:
        ValueError: The text is no such address.
    """
    if isinstance(address, int):
        return address, 0
    index, _, sub = address.partition(":")
    return int(index, 0), int(sub or "0", 0)


def of_variant(value: T | dict[str, T] | None, variant: str) -> T | None:
    """Return a value that may differ per variant; None where the variant has none."""
    if isinstance(value, dict) and shape(value) == "by_variant":
        return value.get(variant)
    return value  # type: ignore[return-value]  # a mapping of integers is a value itself


TypeName = Annotated[
    str, AfterValidator(_known_type), WithJsonSchema({"enum": sorted(DataType.__members__)})
]
Number = Annotated[float | int, BeforeValidator(_number)]
IntegerOrText = Annotated[int | str, BeforeValidator(_integer_or_text)]
EitherOrInteger = Annotated[
    int | str,
    BeforeValidator(_either_or_integer),
    WithJsonSchema({"anyOf": [{"const": "either"}, {"type": "integer", "minimum": 1}]}),
]
_Pair = Field(min_length=2, max_length=2)
Range = Annotated[list[IntegerOrText], BeforeValidator(_interval), _Pair]
"""Lowest and highest value; expressions with NODEID allowed."""
Interval = Annotated[list[int], BeforeValidator(_interval), _Pair]
"""Lowest and highest value, plain integers."""
PerVariant = Annotated[
    Annotated[T, Tag("plain")] | Annotated[dict[str, T], Tag("by_variant")],
    Discriminator(shape),
]
Source: TypeAlias = Annotated[str, Field(min_length=1)]
NodeId = Annotated[int, Field(ge=1, le=127)]
Index = Annotated[int, Field(ge=0, le=0xFFFF)]
Sub = Annotated[int, Field(ge=0, le=0xFF)]
Address = Annotated[int | str, BeforeValidator(_address)]
"""Index, or index and sub-index as a text."""
Bit = Annotated[int, Field(ge=0, le=31)]
Date = Annotated[
    date, PlainValidator(_date), WithJsonSchema({"type": "string", "pattern": f"^{_DATE.pattern}$"})
]
AmbiguityId = Annotated[
    str,
    AfterValidator(_ambiguity_id),
    WithJsonSchema({"type": "string", "pattern": f"^{_AMBIGUITY_ID.pattern}$"}),
]
Signature = Annotated[
    str,
    AfterValidator(_signature),
    WithJsonSchema({"type": "string", "pattern": f"^{_FOUR_CHARACTERS.pattern}$"}),
]


class StrictModel(BaseModel):
    """A block of a device spec file: no other keys, no guessing of types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)
