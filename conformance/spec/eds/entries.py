"""One entry of an EDS: its attributes, and the lines that none of them holds."""

from __future__ import annotations

from conformance.spec.document import Access
from conformance.spec.eds.ini import IniFile, IniLine, IniSection
from conformance.spec.eds.model import DOMAIN, VAR, EdsEntry
from conformance.spec.eds.values import Parsed, parse_limit, parse_number, parse_value
from conformance.spec.yaml_reader import shown
from conformance.wire.datatypes import DataType

_ACCESS: dict[str, tuple[Access, bool]] = {
    "ro": ("ro", True),
    "wo": ("wo", True),
    "rw": ("rw", True),
    "const": ("const", True),
    "rwr": ("rw", False),
    "rww": ("rw", False),
    "r": ("ro", False),
    "w": ("wo", False),
}
"""Access right by its word, and whether the right is all that the word says."""

PROCESS_DATA = ("rwr", "rww")
"""Words that add the direction of the process data to the access right."""
_IN_CIA_306 = frozenset(("ro", "wo", "rw", "const", *PROCESS_DATA))
_LIMITS = ("low", "high")
_KEYS = {
    "name": "ParameterName",
    "type": "DataType",
    "access": "AccessType",
    "mappable": "PDOMapping",
    "unit": "Unit",
    "default": "DefaultValue",
    "low": "LowLimit",
    "high": "HighLimit",
}
_LAST_TYPE = 0xFF


class EntryReader:
    """Reads the sections of entries.

    Args:
        file: The file; told of what is odd.
    """

    def __init__(self, file: IniFile) -> None:
        self._file = file

    def entry(self, section: IniSection, index: int, sub: int) -> EdsEntry:
        """Return the entry that a section describes."""
        entry = EdsEntry(index, sub, section.line)
        self._read_words(section, entry)
        self._read_figures(section, entry)
        told = {line.number for line in entry.said.values()}
        told |= self._object_type(section, entry)
        entry.left = [
            line
            for line in section.lines
            if line.number not in told or not line.key or section.first(line.key) is not line
        ]
        entry.left = [line for line in entry.left if line.value and not says_nothing(line)]
        return entry

    def _object_type(self, section: IniSection, entry: EdsEntry) -> set[int]:
        """Return the number of the line ObjectType, if type and entry say the same."""
        line = section.get("ObjectType")
        if line is None:
            return set()
        value, _ = self._number(section, line)
        if value == DOMAIN and entry.type is None and "type" not in entry.said:
            entry.type = DataType.DOMAIN
            return {line.number}
        plain = value == VAR or (value == DOMAIN and entry.type is DataType.DOMAIN)
        return {line.number} if plain else set()

    def _read_words(self, section: IniSection, entry: EdsEntry) -> None:
        said = entry.said
        if (line := section.get(_KEYS["name"])) is not None:
            entry.name, said["name"] = line.value, line
        else:
            self._file.warn(section.line, section.name, "expected ParameterName, got none")
            entry.name = f"Object {section.name}"
        if (line := section.get(_KEYS["unit"])) is not None:
            entry.unit, said["unit"] = line.value, line
        if (line := section.get(_KEYS["mappable"])) is not None:
            value, clean = self._number(section, line)
            if value in (0, 1):
                entry.mappable = value == 1
                said.update({"mappable": line} if clean else {})
            elif value is not None:
                self._warn(section, line, f"expected 0 or 1, got {shown(line.value)}")
        self._read_access(section, entry)

    def _read_access(self, section: IniSection, entry: EdsEntry) -> None:
        line = section.get(_KEYS["access"])
        if line is None:
            self._file.warn(section.line, section.name, "expected AccessType, got none")
            return
        word = line.value.partition(";")[0].strip().lower()
        entry.access, whole = _ACCESS.get(word, (None, False))
        if word not in _IN_CIA_306 or ";" in line.value:
            wanted = "expected ro, wo, rw, rwr, rww or const"
            self._warn(section, line, f"{wanted}, got {shown(line.value)}")
        elif whole:
            entry.said["access"] = line

    def _read_figures(self, section: IniSection, entry: EdsEntry) -> None:
        line = section.get(_KEYS["type"])
        if line is None:
            if not self._is_domain(section):
                self._file.warn(section.line, section.name, "expected DataType, got none")
        else:
            self._read_type(section, entry, line)
        if self._is_domain(section) and line is None:
            entry.type = DataType.DOMAIN
        kind = entry.type
        if kind is None:
            return
        if (line := section.get(_KEYS["default"])) is not None:
            parsed = self._parsed(section, line, kind, limit=False)
            if parsed is not None:
                entry.default = parsed.value
                entry.said.update({} if parsed.remark else {"default": line})
        if kind.is_integer:
            self._read_limits(section, entry, kind)

    def _is_domain(self, section: IniSection) -> bool:
        line = section.get("ObjectType")
        return line is not None and line.value.lower() in ("2", "0x2", "0x02")

    def _read_type(self, section: IniSection, entry: EdsEntry, line: IniLine) -> None:
        value, clean = self._number(section, line)
        if value is None:
            return
        kind = _data_type(value)
        if kind is not None:
            entry.type = kind
            entry.said.update({"type": line} if clean else {})
            return
        base = self._base_type(value)
        self._warn(
            section,
            line,
            f"expected a CiA 301 data type, got {value:#06x}"
            + ("" if base is None else f" (read as {base.name}, on which the file builds it)"),
        )
        entry.type = base

    def _base_type(self, value: int) -> DataType | None:
        """Return the type that a type of the file's own is made of, as CANFestival writes it."""
        section = self._file.section(f"{value:X}sub1") if value <= _LAST_TYPE else None
        line = None if section is None else section.get("DefaultValue")
        try:
            number = None if line is None else parse_number(line.value)[0]
        except ValueError:
            return None
        return _data_type(number) if isinstance(number, int) else None

    def _read_limits(self, section: IniSection, entry: EdsEntry, kind: DataType) -> None:
        found = {}
        for name in _LIMITS:
            line = section.get(_KEYS[name])
            parsed = None if line is None else self._parsed(section, line, kind, limit=True)
            if line is not None and parsed is not None and not isinstance(parsed.value, str):
                found[name] = (line, parsed.value, parsed.remark)
        if len(found) == 2:
            (low_line, low, _), (_, high, _) = found["low"], found["high"]
            if isinstance(low, int) and isinstance(high, int) and low > high:
                self._warn(section, low_line, f"expected at most HighLimit ({high}), got {low}")
                return
        for name, (line, value, remark) in found.items():
            setattr(entry, name, value)
            entry.said.update({} if remark else {name: line})

    def _parsed(
        self, section: IniSection, line: IniLine, kind: DataType, *, limit: bool
    ) -> Parsed | None:
        try:
            parsed = parse_limit(line.value, kind) if limit else parse_value(line.value, kind)
        except ValueError as error:
            self._warn(section, line, str(error))
            return None
        if parsed.remark:
            self._warn(section, line, parsed.remark)
        return parsed

    def _number(self, section: IniSection, line: IniLine) -> tuple[int | None, bool]:
        """Return a plain number, and whether it is written as it should be."""
        try:
            number, remark = parse_number(line.value)
        except ValueError as error:
            self._warn(section, line, str(error))
            return None, False
        if remark:
            self._warn(section, line, remark)
        return (number if isinstance(number, int) else None), not remark

    def _warn(self, section: IniSection, line: IniLine, text: str) -> None:
        self._file.warn(line.number, f"{section.name}.{line.key}", text)


def _data_type(number: int) -> DataType | None:
    try:
        return DataType(number)
    except ValueError:
        return None


def says_nothing(line: IniLine) -> bool:
    """Tell whether a line says what CiA 306 takes for granted: ``ObjFlags=0``."""
    return line.key.lower() == "objflags" and line.value in ("0", "0x0", "0x00", "0x00000000")
