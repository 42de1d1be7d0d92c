"""YAML 1.2 files as plain data with the line of every key.

Reads the event stream, so that nesting is bounded before it can exhaust anything. Aliases, tags and
several documents in one file are refused: a spec is read by people.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.resolver import VersionedResolver

from conformance.errors import Problem, SpecError

Path_: TypeAlias = tuple[Hashable, ...]
MOST_BYTES = 2_000_000
MOST_LEVELS = 16
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
    return ".".join(
        f"0x{key:04X}" if isinstance(key, int) and key > 0xFF else str(key) for key in path
    )


def read_yaml(path: Path) -> YamlFile:
    """Read one YAML file.

    Raises:
        SpecError: The file cannot be read or is not YAML; one sentence with file and line.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise SpecError(
            Problem(path, 0, "", f"expected a readable file, got {error.strerror}")
        ) from error
    if len(text) > MOST_BYTES:
        raise SpecError(
            Problem(path, 0, "", f"expected a file of at most {MOST_BYTES // 10**6} MB, got more")
        )
    result = YamlFile(path, text=text)
    try:
        content = text.decode("utf-8")
    except UnicodeDecodeError as error:
        line = text.count(b"\n", 0, error.start) + 1
        raise SpecError(
            Problem(path, line, "", f"expected UTF-8 text, got byte {text[error.start]:02X}h")
        ) from error
    try:
        _Builder(result).build(YAML(typ="safe", pure=True).parse(content))
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None) if isinstance(error, MarkedYAMLError) else None
        reason = (getattr(error, "problem", None) or str(error)).splitlines()[0]
        line = mark.line + 1 if mark else 0
        raise SpecError(Problem(path, line, "", f"expected YAML, got: {reason}")) from error
    return result


class _Builder:
    """Turns an event stream into plain data."""

    def __init__(self, file: YamlFile) -> None:
        self._file = file
        self._resolver = VersionedResolver("1.2")

    def build(self, events: Iterator[Event]) -> None:
        documents = 0
        for event in events:
            if isinstance(event, MappingStartEvent | SequenceStartEvent | ScalarEvent | AliasEvent):
                documents += 1
                if documents > 1:
                    self._refuse(event, (), "expected one YAML document, got a second one")
                self._file.data = self._value(event, events, ())

    def _value(self, event: Event, events: Iterator[Event], path: Path_) -> Any:
        if len(path) > MOST_LEVELS:
            self._refuse(event, path[:3], f"expected at most {MOST_LEVELS} levels, got more")
        if isinstance(event, AliasEvent) or getattr(event, "anchor", None):
            self._refuse(event, path, "expected plain values, got an anchor or alias")
        self._file.lines.setdefault(path, event.start_mark.line + 1)
        if isinstance(event, ScalarEvent):
            return self._scalar(event, path)
        if isinstance(event, SequenceStartEvent):
            items: list[Any] = []
            for item in events:
                if isinstance(item, SequenceEndEvent):
                    break
                items.append(self._value(item, events, (*path, len(items))))
            return items
        return self._mapping(events, path)

    def _mapping(self, events: Iterator[Event], path: Path_) -> dict[Any, Any]:
        result: dict[Any, Any] = {}
        for event in events:
            if isinstance(event, MappingEndEvent):
                break
            if not isinstance(event, ScalarEvent):
                self._refuse(event, path, "expected a name or number as key, got a collection")
            key = self._scalar(event, path)
            below = (*path, key)
            line = event.start_mark.line + 1
            if key in result:
                first = self._file.lines[below]
                self._file.problems.append(
                    Problem(
                        self._file.path,
                        line,
                        spell(below),
                        f"expected each key once, got it again (first on line {first})",
                    )
                )
            self._file.lines.setdefault(below, line)
            result[key] = self._value(next(events), events, below)
        return result

    def _scalar(self, event: ScalarEvent, path: Path_) -> Any:
        text = event.value
        if event.tag is not None:
            self._refuse(event, path, f"expected a plain value, got the tag {event.tag}")
        tag = str(self._resolver.resolve(ScalarNode, text, event.implicit))
        if tag == _NULL:
            return None
        if tag == _BOOLEAN:
            return text.lower() == "true"
        try:
            if tag == _INTEGER:
                return int(text.replace("_", ""), 0)
            if tag == _FLOAT:
                return float(text.replace("_", ""))
        except ValueError:
            self._refuse(event, path, f"expected a number (0x for hexadecimal), got {text!r}")
        return text

    def _refuse(self, event: Event, path: Path_, text: str) -> NoReturn:
        raise SpecError(Problem(self._file.path, event.start_mark.line + 1, spell(path), text))
