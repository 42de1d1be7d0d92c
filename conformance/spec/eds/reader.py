"""EDS and DCF files (CiA 306-1) as they are in the field, sloppy ones included.

Whatever is odd becomes a problem with its line; whatever no attribute can hold stays as a line.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from conformance.errors import Problem, SpecError
from conformance.spec.eds.compact import expand_compact
from conformance.spec.eds.entries import EntryReader, says_nothing
from conformance.spec.eds.ini import IniLine, IniSection, read_ini
from conformance.spec.eds.model import ARRAY, LISTS, RECORD, EdsFile, EdsObject, list_of
from conformance.spec.eds.values import parse_number
from conformance.spec.model import address
from conformance.spec.yaml_reader import shown

_OBJECT = re.compile(r"(?:0x)?([0-9A-F]{4})", re.IGNORECASE)
_SUB = re.compile(r"(?:0x)?([0-9A-F]{4})sub([0-9A-F]{1,3})", re.IGNORECASE)
_FIRST_INDEX = 0x1000
_LAST_SUB = 0xFF
_OWN_KEYS = frozenset(("subnumber", "objecttype", "parametername"))


def read_eds(path: Path) -> EdsFile:
    """Read an EDS or DCF file.

    Raises:
        SpecError: It cannot be read or describes no object; with file, line and reason.
    """
    return _Reader(EdsFile(read_ini(path))).read()


class _Reader:
    def __init__(self, eds: EdsFile) -> None:
        self._eds = eds
        self._ini = eds.ini
        self._entries = EntryReader(self._ini)
        self._mains: dict[int, IniSection] = {}
        self._subs: dict[int, dict[int, IniSection]] = {}
        self._again: list[tuple[int, IniSection]] = []

    def read(self) -> EdsFile:
        for section in self._ini.sections:
            self._sort(section)
        for index in sorted(self._mains.keys() | self._subs.keys()):
            self._eds.objects[index] = self._object(index)
        if not self._eds.objects:
            text = "expected an object such as [1000], got none"
            raise SpecError(Problem(self._ini.path, self._ini.sections[-1].line, "", text))
        for index, section in self._again:
            self._eds.objects[index].left += [line for line in section.lines if line.value]
        self._check_lists()
        return self._eds

    def _sort(self, section: IniSection) -> None:
        """Put a section where it belongs."""
        main, sub = _OBJECT.fullmatch(section.name), _SUB.fullmatch(section.name)
        match = main or sub
        index = int(match[1], 16) if match else 0
        number = int(sub[2], 16) if sub else 0
        if index < _FIRST_INDEX or number > _LAST_SUB:
            if sub and index >= _FIRST_INDEX:
                text = f"expected sub-index 0 to FFh, got {shown(section.name)}"
                self._ini.warn(section.line, section.name, text)
            self._eds.rest.append(section)
            return
        if sub is None:
            known = self._mains.setdefault(index, section)
        else:
            known = self._subs.setdefault(index, {}).setdefault(number, section)
        if known is not section:
            self._again.append((index, section))

    def _object(self, index: int) -> EdsObject:
        main, subs = self._mains.get(index), self._subs.get(index, {})
        if main is None:
            section = next(iter(subs.values()))
            text = f"expected [{index:04X}] beside its sub-indices, got none"
            self._ini.warn(section.line, section.name, text)
            main = IniSection(f"{index:04X}", section.line)
        item = EdsObject(index, main.line, self._name(main), in_record=self._in_record(main, subs))
        if not item.in_record:
            item.entries[0] = self._entries.entry(main, index, 0)
            return item
        compact = expand_compact(self._eds, self._entries, main, item)
        for sub, section in sorted(subs.items()):
            item.entries[sub] = self._entries.entry(section, index, sub)
        item.entries = dict(sorted(item.entries.items()))
        self._leave(main, item, compact)
        return item

    def _name(self, section: IniSection) -> str:
        line = section.get("ParameterName")
        if line is None:
            self._ini.warn(section.line, section.name, "expected ParameterName, got none")
            return f"Object {section.name}h"
        return line.value

    def _in_record(self, main: IniSection, subs: dict[int, IniSection]) -> bool:
        line = main.get("ObjectType")
        kind = None if line is None else self._figure(main, "ObjectType")
        several = bool(subs) or main.get("CompactSubObj") is not None
        claimed = kind in (ARRAY, RECORD) or (kind is None and main.get("SubNumber") is not None)
        if line is not None and several and kind not in (ARRAY, RECORD):
            text = f"expected 0x8 or 0x9 for an object with sub-indices, got {shown(line.value)}"
            self._ini.warn(line.number, f"{main.name}.ObjectType", text)
        if line is not None and claimed and not several:
            text = f"expected sub-indices for object type {shown(line.value)}, got none"
            self._ini.warn(line.number, main.name, text)
            return main.get("DataType") is None
        return several or claimed

    def _figure(self, section: IniSection, key: str) -> int | None:
        line = section.get(key)
        if line is None:
            return None
        try:
            number, remark = parse_number(line.value)
        except ValueError as error:
            number, remark = -1, str(error)
        if remark:
            self._ini.warn(line.number, f"{section.name}.{key}", remark)
        return number if isinstance(number, int) and number >= 0 else None

    def _leave(self, main: IniSection, item: EdsObject, compact: frozenset[int]) -> None:
        """Keep what the section of an object with sub-indices says beyond name and entries."""
        count = self._figure(main, "SubNumber")
        if count not in (None, len(item.entries)) and not compact:
            text = f"expected {len(item.entries)}, the number of its sub-indices, got {count}"
            self._ini.warn(main.line, f"{main.name}.SubNumber", text)
        for line in main.lines:
            key = line.key.lower()
            first = main.first(line.key) if line.key else None
            told = line.number in compact or (
                line is first
                and key in _OWN_KEYS
                and not (key == "subnumber" and count != len(item.entries))
                and not (key == "objecttype" and self._figure(main, "ObjectType") != RECORD)
            )
            if line.value and not told and not says_nothing(line):
                item.left.append(line)

    # The lists of objects

    def _check_lists(self) -> None:
        """Hold the lists of objects against the sections, and keep what is odd of them."""
        listed: set[int] = set()
        for name in LISTS:
            section = self._ini.section(name)
            if section is None:
                wanted = [i for i in self._eds.objects if list_of(i) == name]
                if wanted:
                    found = f"got none, but {address(wanted[0])}"
                    self._ini.warn(0, "", f"expected the section [{name}], {found}")
                continue
            section.lines = list(self._odd(section, listed))
        missing = [item for i, item in self._eds.objects.items() if i not in listed]
        for item in missing if listed else ():
            text = "expected it in the list of objects, got it in none"
            self._ini.warn(item.line, f"{item.index:04X}", text)

    def _odd(self, section: IniSection, listed: set[int]) -> Iterable[IniLine]:
        """Return the lines that say something the objects do not say themselves."""
        count = 0
        for line in section.lines:
            if not line.key.isdecimal():
                if line.key.lower() != "supportedobjects":
                    yield line
                continue
            count += 1
            index = self._figure(section, line.key)
            if index in self._eds.objects and index not in listed:
                listed.add(index)
                if list_of(index) == section.name:
                    continue
            elif index is not None and index not in self._eds.objects:
                text = f"expected the section [{index:04X}], got none"
                self._ini.warn(line.number, f"{section.name}.{line.key}", text)
            yield line
        claimed = section.get("SupportedObjects")
        if claimed is not None and self._figure(section, "SupportedObjects") != count:
            text = f"expected {count}, the number of objects listed, got {shown(claimed.value)}"
            self._ini.warn(claimed.number, f"{section.name}.SupportedObjects", text)
            yield claimed
