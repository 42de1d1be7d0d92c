"""INI files as EDS and DCF files are in the field: every line kept, with its number.

Sections and keys are found whatever their case; the first one counts where a name is given twice.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from conformance.errors import Problem, SpecError
from conformance.spec.yaml_reader import shown

MOST_BYTES = 4_000_000
_LINE_END = re.compile(r"\r\n|\n|\r")
_END_OF_TEXT = "\x1a"
"""What editors of the DOS age left at the end of a file."""


@dataclass(frozen=True, slots=True)
class IniLine:
    """One line: ``key=value``, or a comment or stray line with an empty key."""

    number: int
    key: str
    value: str

    def __str__(self) -> str:
        return f"{self.key}={self.value}" if self.key else self.value


@dataclass(slots=True)
class IniSection:
    """A section and its lines, in the order of the file."""

    name: str
    line: int
    lines: list[IniLine] = field(default_factory=list)

    def get(self, key: str) -> IniLine | None:
        """Return the line of a key that has a value."""
        line = self.first(key)
        return line if line is not None and line.value else None

    def first(self, key: str) -> IniLine | None:
        """Return the first line of a key, be its value empty."""
        wanted = key.lower()
        return next((line for line in self.lines if line.key.lower() == wanted), None)


@dataclass(slots=True)
class IniFile:
    """An INI file.

    Args:
        path: The file.
        text: Its bytes.
        sections: In the order of the file; what stands before the first one has an empty name.
        problems: What a tidy file would not have.
    """

    path: Path
    text: bytes
    sections: list[IniSection] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)

    def section(self, name: str) -> IniSection | None:
        """Return the first section of a name."""
        wanted = name.lower()
        return next((s for s in self.sections if s.name.lower() == wanted), None)

    def warn(self, line: int, key: str, text: str) -> None:
        """Note a problem that the file can be read in spite of."""
        self.problems.append(Problem(self.path, line, key, text))


def read_ini(path: Path) -> IniFile:
    """Read an INI file.

    Raises:
        SpecError: The file cannot be read or is no INI file; one sentence with file and line.
    """
    file = IniFile(path, _read(path))
    lines = _LINE_END.split(_decode(file).rstrip(_END_OF_TEXT))
    section = IniSection("", 0)
    file.sections.append(section)
    known: dict[str, int] = {}
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if text.startswith("["):
            section = _section(file, number, text)
            file.sections.append(section)
            known = {}
        elif text:
            _add(file, section, known, number, text)
    if len(file.sections) == 1:
        number, text = next(((n, t) for n, t in enumerate(lines, 1) if t.strip()), (1, ""))
        raise _refused(path, number, f"expected a section such as [DeviceInfo], got {shown(text)}")
    _warn_of_repeated_sections(file)
    return file


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:  # the latter from a name that no file can have
        reason = getattr(error, "strerror", None) or error
        raise _refused(path, 0, f"expected a readable file, got: {reason}") from error
    if len(text) > MOST_BYTES:
        raise _refused(path, 0, f"expected at most {MOST_BYTES // 10**6} MB, got more")
    return text


def _decode(file: IniFile) -> str:
    """Return the text: UTF-8, else what Windows writes in western Europe, else Latin-1."""
    binary = file.text.find(b"\0")
    if binary >= 0:
        line = file.text.count(b"\n", 0, binary) + 1
        raise _refused(file.path, line, "expected text, got the byte 00h")
    try:
        return file.text.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = file.text.count(b"\n", 0, error.start) + 1
        got = f"byte {file.text[error.start]:02X}h"
        file.warn(line, "", f"expected ASCII or UTF-8, got {got} (read as Windows-1252)")
    try:
        return file.text.decode("cp1252")
    except UnicodeDecodeError:
        return file.text.decode("latin-1")


def _section(file: IniFile, number: int, text: str) -> IniSection:
    name, bracket, rest = text[1:].partition("]")
    section = IniSection(name.strip(), number)
    rest = rest.strip()
    if not bracket:
        file.warn(number, name, f"expected ] after the name of a section, got {shown(text)}")
    elif rest:
        section.lines.append(IniLine(number, "", rest))
        if rest[0] not in ";#":
            file.warn(number, name, f"expected nothing after ], got {shown(rest)}")
    return section


def _add(file: IniFile, section: IniSection, known: dict[str, int], number: int, text: str) -> None:
    key, equals, value = (part.strip() for part in text.partition("="))
    if text[0] in ";#":
        section.lines.append(IniLine(number, "", text))
    elif not equals or not key:
        section.lines.append(IniLine(number, "", text))
        file.warn(number, section.name, f"expected key=value, got {shown(text)}")
    else:
        section.lines.append(IniLine(number, key, value))
        first = known.setdefault(key.lower(), number)
        if first != number:
            text = f"expected each key once, got it again (line {first} counts)"
            file.warn(number, f"{section.name}.{key}", text)


def _warn_of_repeated_sections(file: IniFile) -> None:
    first: dict[str, int] = {}
    for section in file.sections[1:]:
        line = first.setdefault(section.name.lower(), section.line)
        if line != section.line:
            text = f"expected each section once, got it again (line {line} counts)"
            file.warn(section.line, section.name, text)


def _refused(path: Path, line: int, text: str) -> SpecError:
    return SpecError(Problem(path, line, "", text))
