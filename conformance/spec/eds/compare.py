"""A device spec against an EDS, row by row: what the two say differently of each object."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from conformance.spec.eds.model import EdsEntry, EdsFile
from conformance.spec.eds.values import Number, Relative
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.wire.datatypes import DataType

Attribute: TypeAlias = Literal["existence", "type", "access", "default", "limits", "mappable"]
ATTRIBUTES: Final[tuple[Attribute, ...]] = (
    "existence",
    "type",
    "access",
    "default",
    "limits",
    "mappable",
)
_REALS: Final = (DataType.REAL32, DataType.REAL64)


@dataclass(frozen=True, slots=True)
class Row:
    """One attribute of one entry as the manual and the EDS have it.

    Args:
        object: Address as printed.
        attribute: One of `ATTRIBUTES`, or ``name``.
        manual: In words; empty where the manual says nothing.
        section: Of the manual.
        eds: In words; empty where the EDS says nothing.
        line: Of the EDS, 0 where it has none.
        differs: Both say something, and not the same.
    """

    object: str
    attribute: str
    manual: str
    section: str
    eds: str
    line: int
    differs: bool


def compare(spec: DeviceSpec, eds: EdsFile) -> list[Row]:
    """Return every attribute that manual and EDS do not say in the same words, by address.

    An entry that a manual leaves open, or that any reading of an ambiguity has as the EDS has it,
    does not differ.
    """
    keys = sorted(spec.entries.keys() | eds.entries.keys())
    return [
        row for key in keys for row in _rows(spec.entries.get(key), eds.entries.get(key), eds, spec)
    ]


def _rows(
    entry: Entry | None, said: EdsEntry | None, eds: EdsFile, spec: DeviceSpec
) -> Iterator[Row]:
    if entry is None:
        assert said is not None  # it is in one of both
        place = eds.objects[said.index].address(said.sub)
        yield Row(
            place, "existence", "not documented", "", f"listed as {said.name}", said.line, True
        )
        return
    if said is None:
        documented = "reserved" if entry.reserved else f"documented as {entry.name}"
        differs = not (entry.optional or entry.reserved)
        yield Row(entry.address, "existence", documented, entry.source, "not listed", 0, differs)
        return
    if entry.reserved:
        yield Row(entry.address, "existence", "reserved", entry.source, "listed", said.line, True)
        return
    for attribute in ATTRIBUTES[1:]:
        yield from _attribute(entry, said, attribute, spec.node_id)
    if entry.name != said.name:
        line = said.line_of("name")
        yield Row(entry.address, "name", entry.name, entry.source, said.name, line, False)


def _attribute(entry: Entry, said: EdsEntry, attribute: Attribute, node_id: int) -> Iterator[Row]:
    theirs = eds_word(said, attribute)
    ours = list(dict.fromkeys(manual_word(e, attribute) for e in entry.readings))
    if any(agree(e, said, attribute, node_id) for e in entry.readings):
        return
    manual = " or ".join(word for word in ours if word)
    if not manual and not theirs:
        return
    line = said.line_of("low", "high") if attribute == "limits" else said.line_of(attribute)
    section = entry.source_of("ranges" if attribute == "limits" else attribute)
    differs = bool(theirs) and all(ours)
    yield Row(entry.address, attribute, manual, section, theirs, line, differs)


def manual_word(entry: Entry, attribute: Attribute) -> str:
    """Return what the manual says of an attribute, empty when nothing."""
    match attribute:
        case "existence":
            return "reserved" if entry.reserved else "documented"
        case "type":
            return entry.type.name
        case "access":
            return entry.access
        case "default":
            return "" if entry.default is None else _value(entry.default)
        case "limits":
            hull = _hull(entry)
            return "" if hull is None else f"{hull[0]} to {hull[1]}"
        case "mappable":
            return {True: "yes", False: "no", None: ""}[entry.mappable]


def eds_word(said: EdsEntry, attribute: Attribute) -> str:
    """Return what the EDS says of an attribute, empty when nothing."""
    match attribute:
        case "existence":
            return "listed"
        case "type":
            return "" if said.type is None else said.type.name
        case "access":
            return said.access or ""
        case "default":
            return "" if said.default is None else _value(said.default)
        case "limits":
            return _limits(said.low, said.high)
        case "mappable":
            return {True: "yes", False: "no", None: ""}[said.mappable]


def agree(entry: Entry, said: EdsEntry, attribute: Attribute, node_id: int) -> bool:
    """Tell whether manual and EDS say the same of an attribute."""
    if attribute == "limits":
        hull = _hull(entry)
        ends = tuple(evaluated(end, node_id) for end in (said.low, said.high))
        if hull is None or ends == (None, None):
            return hull is None and ends == (None, None)
        return all(end in (None, ours) for end, ours in zip(ends, hull, strict=True))
    if attribute != "default":
        return manual_word(entry, attribute) == eds_word(said, attribute)
    ours, theirs = entry.default, evaluated(said.default, node_id)
    if ours is not None and theirs is not None and entry.type in _REALS:
        return _same_real(str(ours), str(theirs))
    if entry.type is DataType.BOOLEAN and isinstance(ours, str):
        ours = str(int(bool(entry.default_value)))
    return ours == theirs


def evaluated(value: Number | str | None, node_id: int) -> int | str | None:
    """Return a value of an EDS for one node-ID."""
    return value.at(node_id) if isinstance(value, Relative) else value


def describe(eds: EdsFile, said: EdsEntry) -> str:
    """Return all that an EDS says of an entry in one line, with the line of the file."""
    words = [f"{attribute} {eds_word(said, attribute)}" for attribute in ATTRIBUTES[1:]]
    told = ", ".join(word for word in words if not word.endswith(" "))
    return f"{told} ({eds.name}, line {said.line})"


def unlisted(eds: EdsFile, index: int, sub: int | None) -> str:
    """Return the sentence for an object that an EDS does not list."""
    return f"{eds.name} does not list {address(index, sub)}"


def _hull(entry: Entry) -> tuple[int, int] | None:
    legal = entry.legal
    return None if not legal else (min(low for low, _ in legal), max(high for _, high in legal))


def _limits(low: Number | None, high: Number | None) -> str:
    if low is None:
        return "" if high is None else f"at most {high}"
    return f"at least {low}" if high is None else f"{low} to {high}"


def _value(value: object) -> str:
    if isinstance(value, str):
        return repr(value)
    return f"{value} ({value:X}h)" if isinstance(value, int) and value > 9 else str(value)


def _same_real(one: str, other: str) -> bool:
    try:
        return float(one) == float(other)
    except ValueError:
        return one == other
