"""Arrays in short form (CiA 306-1, CompactSubObj): one section for all sub-indices."""

from __future__ import annotations

from dataclasses import replace

from conformance.spec.eds.entries import EntryReader
from conformance.spec.eds.ini import IniLine, IniSection
from conformance.spec.eds.model import EdsEntry, EdsFile, EdsObject
from conformance.spec.eds.values import parse_number
from conformance.spec.yaml_reader import shown
from conformance.wire.datatypes import DataType

_MOST = 254
_COUNT = "CompactSubObj"


def expand_compact(
    eds: EdsFile, reader: EntryReader, main: IniSection, item: EdsObject
) -> frozenset[int]:
    """Add the entries that a section stands for, and return the lines they hold.

    Args:
        eds: The file.
        reader: Reads an entry.
        main: The section.
        item: The object it describes.
    """
    line = main.get(_COUNT)
    count = 0 if line is None else _count(eds, main, line)
    if line is None or not count:
        return frozenset()
    model = reader.entry(main, item.index, 1)
    names = _names(eds, item.index)
    item.entries[0] = EdsEntry(
        item.index,
        0,
        main.line,
        name="Highest sub-index",
        type=DataType.UNSIGNED8,
        access="ro",
        default=count,
        said={"default": line},
    )
    for sub in range(1, count + 1):
        own = names.get(sub)
        said = {**model.said, "name": own} if own is not None else dict(model.said)
        name = f"{item.name} {sub}" if own is None else own.value
        item.entries[sub] = replace(model, sub=sub, name=name, said=said, left=[])
    return frozenset((line.number, *(told.number for told in model.said.values())))


def _count(eds: EdsFile, main: IniSection, line: IniLine) -> int:
    key = f"{main.name}.{_COUNT}"
    try:
        number, remark = parse_number(line.value)
    except ValueError as error:
        number, remark = 0, str(error)
    if remark:
        eds.ini.warn(line.number, key, remark)
    if not isinstance(number, int) or not 0 <= number <= _MOST:
        eds.ini.warn(line.number, key, f"expected 0 to {_MOST}, got {shown(line.value)}")
    return min(number, _MOST) if isinstance(number, int) else 0


def _names(eds: EdsFile, index: int) -> dict[int, IniLine]:
    """Return the names that a section such as ``[2000Name]`` gives, by sub-index."""
    section = eds.ini.section(f"{index:04X}Name")
    lines = () if section is None else section.lines
    return {int(line.key): line for line in lines if line.key.isascii() and line.key.isdecimal()}
