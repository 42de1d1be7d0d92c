"""YAML 1.2 files as plain data with the line of every key.

Reads the event stream, so that nesting is bounded before it can exhaust anything. Aliases, tags and
several documents in one file are refused: a spec is read by people.
"""

from __future__ import annotations

import math
import re
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
)
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.reader import ReaderError
from ruamel.yaml.resolver import VersionedResolver

from conformance.errors import Problem, SpecError

Path_: TypeAlias = tuple[Hashable, ...]
MOST_BYTES = 1_000_000
MOST_LEVELS = 16
_MOST_SHOWN = 60
_SURROGATE = re.compile("[\ud800-\udfff]")
_INTEGERS = range(-(2**63), 2**64)
_INTEGER = "tag:yaml.org,2002:int"
_FLOAT = "tag:yaml.org,2002:float"
_BOOLEAN = "tag:yaml.org,2002:bool"
_NULL = "tag:yaml.org,2002:null"


@dataclass(slots=True)
class YamlFile:
    """The data of a YAML file and where each key stands.

    Args:
        path: The file.
        data: Plain dicts, lists and scalars.
        lines: Path of keys to 1-based line.
        problems: What is wrong with the file as YAML though it could be read (duplicate keys).
        text: The bytes of the file, for its hash.
    """

    path: Path
    data: Any = None
    lines: dict[Path_, int] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    text: bytes = b""

    def line(self, path: Path_) -> int:
        """Return the line of ``path``, or of the nearest key above it that stands in the file."""
        while path and path not in self.lines:
            path = path[:-1]
        return self.lines.get(path, 0)

    def problem(self, path: Path_, text: str) -> Problem:
        """Return a problem at ``path``."""
        return Problem(self.path, self.line(path), spell(path), text)


def spell(path: Path_) -> str:
    """Return a path as a person writes it: ``objects.0x1018.subs.1.default``."""
    return ".".join(_spell_key(key) for key in path)


def _spell_key(key: Hashable) -> str:
    if isinstance(key, int):
        return f"0x{key:04X}" if key > 0xFF else str(key)
    text = str(key)
    return text if text.isprintable() and len(text) <= _MOST_SHOWN else shown(text)


def shown(value: object) -> str:
    """Return a value as a person finds it in the file, cut short."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a mapping"
    text = repr(value)
    return text if len(text) <= _MOST_SHOWN else f"{text[: _MOST_SHOWN - 1]}…"


def read_yaml(path: Path) -> YamlFile:
    """Read one YAML file.

    Raises:
        SpecError: The file cannot be read or is not YAML; one sentence with file and line.
    """
    result = YamlFile(path, text=_read(path))
    content = _decode(result)
    try:
        _Builder(result).build(YAML(typ="safe", pure=True).parse(content))
    except YAMLError as error:
        line, reason = _place_and_reason(error, content)
        raise SpecError(Problem(path, line, "", f"expected YAML, got: {reason}")) from error
    except (ValueError, OverflowError) as error:  # ruamel.yaml on "\\UFFFFFFFF"
        text = "expected YAML, got an escape that is no character"
        raise SpecError(Problem(path, 0, "", text)) from error
    return result


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:  # the latter from a name that no file can have
        reason = getattr(error, "strerror", None) or error
        raise SpecError(Problem(path, 0, "", f"expected a readable file, got: {reason}")) from error
    if len(text) > MOST_BYTES:
        raise SpecError(
            Problem(path, 0, "", f"expected a file of at most {MOST_BYTES // 10**6} MB, got more")
        )
    return text


def _decode(file: YamlFile) -> str:
    try:
        return file.text.decode("utf-8")
    except UnicodeDecodeError as error:
        line = file.text.count(b"\n", 0, error.start) + 1
        got = f"byte {file.text[error.start]:02X}h"
        raise SpecError(Problem(file.path, line, "", f"expected UTF-8 text, got {got}")) from error


def _place_and_reason(error: YAMLError, content: str) -> tuple[int, str]:
    if isinstance(error, ReaderError):
        line = content.count("\n", 0, error.position) + 1
        return line, f"the character U+{ord(content[error.position]):04X}"
    mark = error.problem_mark if isinstance(error, MarkedYAMLError) else None
    reason = (error.problem if isinstance(error, MarkedYAMLError) else None) or str(error)
    return (mark.line + 1 if mark else 0), reason.splitlines()[0]


class _Builder:
    """Turns an event stream into plain data."""

    def __init__(self, file: YamlFile) -> None:
        self._file = file
        self._resolver = VersionedResolver("1.2")

    def build(self, events: Iterator[Event]) -> None:
        documents = 0
        for event in events:
            if isinstance(event, DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self._refuse(event, (), "expected one YAML document, got a second one")
            elif isinstance(event, NodeEvent):
                self._file.data = self._value(event, events, ())

    def _value(self, event: Event, events: Iterator[Event], path: Path_) -> Any:
        if len(path) > MOST_LEVELS:
            self._refuse(event, path[:3], f"expected at most {MOST_LEVELS} levels, got more")
        self._check_plain(event, path)
        self._file.lines.setdefault(path, event.start_mark.line + 1)
        if isinstance(event, ScalarEvent):
            return self._scalar(event, path)
        if isinstance(event, MappingStartEvent):
            return self._mapping(events, path)
        items: list[Any] = []
        while not isinstance(item := next(events), SequenceEndEvent):
            items.append(self._value(item, events, (*path, len(items))))
        return items

    def _mapping(self, events: Iterator[Event], path: Path_) -> dict[Any, Any]:
        result: dict[Any, Any] = {}
        while not isinstance(event := next(events), MappingEndEvent):
            key = self._key(event, path)
            below = (*path, key)
            line = event.start_mark.line + 1
            if key in result:
                self._refuse_again(below, line)
                lines, self._file.lines = self._file.lines, {}
                self._value(next(events), events, below)
                self._file.lines = lines
            else:
                self._file.lines[below] = line
                result[key] = self._value(next(events), events, below)
        return result

    def _key(self, event: Event, path: Path_) -> str | int:
        self._check_plain(event, path)
        if not isinstance(event, ScalarEvent):
            self._refuse(event, path, "expected a name or an integer as key, got a collection")
        key = self._scalar(event, path)
        if isinstance(key, bool) or not isinstance(key, str | int):
            self._refuse(event, path, f"expected a name or an integer as key, got {event.value!r}")
        return key

    def _refuse_again(self, path: Path_, line: int) -> None:
        text = f"expected each key once, got it again (first on line {self._file.lines[path]})"
        self._file.problems.append(Problem(self._file.path, line, spell(path), text))

    def _check_plain(self, event: Event, path: Path_) -> None:
        """Refuse what only programs write: anchors, aliases, tags."""
        if isinstance(event, AliasEvent) or (isinstance(event, NodeEvent) and event.anchor):
            self._refuse(event, path, "expected a plain value, got an anchor or alias (& or *)")
        tag = getattr(event, "tag", None)
        if tag is not None:
            self._refuse(event, path, f"expected a plain value, got the tag {tag}")

    def _scalar(self, event: ScalarEvent, path: Path_) -> str | int | float | None:
        text = event.value
        tag = str(self._resolver.resolve(ScalarNode, text, event.implicit))
        if tag == _NULL:
            return None
        if tag == _BOOLEAN:
            return bool(text.lower() == "true")
        if tag not in (_INTEGER, _FLOAT):
            if _SURROGATE.search(text):
                self._refuse(event, path, f"expected Unicode text, got {shown(text)}")
            return str(text)
        number = _number(text.replace("_", ""), tag)
        if number is None:
            hint = "expected a number of at most 64 bits (0x for hexadecimal)"
            self._refuse(event, path, f"{hint}, got {shown(text)}")
        return number

    def _refuse(self, event: Event, path: Path_, text: str) -> NoReturn:
        raise SpecError(Problem(self._file.path, event.start_mark.line + 1, spell(path), text))


def _number(text: str, tag: str) -> int | float | None:
    try:
        number = int(text, 0) if tag == _INTEGER else float(text)
    except ValueError:
        return None
    fits = number in _INTEGERS if isinstance(number, int) else math.isfinite(number)
    return number if fits else None
