"""A device spec as YAML text, the way people write the built-in ones."""

from __future__ import annotations

import json
import re
from collections.abc import Hashable, Iterator, Mapping
from typing import Any, Final

from conformance.spec.yaml_reader import Path_

_WIDTH: Final = 110
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")
_PLAIN = re.compile(r"[A-Za-z](?:[A-Za-z0-9 _()/.+'-]*[A-Za-z0-9)])?")
_FRAME = re.compile(r"[;#*=\-\s]+")
_WORDS: Final = frozenset(("true", "false", "null", "yes", "no", "on", "off", "y", "n"))
_HEX: Final = frozenset(("object", "error_register", "history", "communication", "mapping"))
_SPACED: Final = frozenset(("services", "objects"))


class Hex(int):
    """An integer to be written in hexadecimal."""


def yaml_text(data: Mapping[str, Any], comments: Mapping[Path_, list[str]]) -> str:
    """Return a mapping as YAML.

    Args:
        data: Mappings, lists, texts and numbers.
        comments: Lines to print above a key, by its path.
    """
    return "\n".join(_mapping(data, (), comments)) + "\n"


def comment(text: str, indent: str = "") -> str:
    """Return a text as a comment: one line, with what YAML forbids written as escapes."""
    return f"{indent}# {''.join(_printable(c) for c in text)}".rstrip()


def is_frame(text: str) -> bool:
    """Tell whether a comment is nothing but a frame: ``;-----``."""
    return _FRAME.fullmatch(text) is not None


def _mapping(
    data: Mapping[Any, Any], path: Path_, comments: Mapping[Path_, list[str]]
) -> Iterator[str]:
    indent = "  " * len(path)
    for number, (key, value) in enumerate(data.items()):
        here = (*path, key)
        if not path or (len(path) == 1 and path[0] in _SPACED and number):
            yield ""
        yield from (comment(text, indent) for text in comments.get(here, ()))
        name = _key(key, path)
        if not isinstance(value, dict):
            yield f"{indent}{name}: {_flow(value, here)}"
            continue
        line = f"{indent}{name}: {_flow(value, here)}"
        below = any(place[: len(here)] == here and place != here for place in _near(comments, here))
        if _may_flow(here) and len(line) <= _WIDTH and not below:
            yield line
        else:
            yield f"{indent}{name}:"
            yield from _mapping(value, here, comments)


def _near(comments: Mapping[Path_, list[str]], path: Path_) -> Iterator[Path_]:
    """Return the paths of comments where one of them may be below a path."""
    return iter(()) if path[0] == "objects" and len(path) > 2 else iter(comments)


def _may_flow(path: Path_) -> bool:
    """Tell whether a mapping may stand on one line: not the lists of things, nor a variable."""
    if path[0] in _SPACED:
        return len(path) > 3 or (len(path) == 2 and path[0] == "services")
    return len(path) > 1 or path[0] != "variants"


def _key(key: Hashable, path: Path_) -> str:
    if not isinstance(key, int):
        return _scalar(str(key))
    if len(path) == 1 or path[-1] == "codes":
        return f"0x{key:04X}"
    return str(key) if key < 10 or path[-1] != "subs" else f"0x{key:02X}"


def _flow(value: object, path: Path_) -> str:
    match value:
        case bool():
            return str(value).lower()
        case int():
            return _number(value, path)
        case list():
            return f"[{', '.join(_flow(item, path) for item in value)}]"
        case dict():
            items = (f"{_key(k, path)}: {_flow(v, (*path, k))}" for k, v in value.items())
            return f"{{{', '.join(items)}}}"
        case _:
            return _scalar(str(value))


def _number(value: int, path: Path_) -> str:
    as_hex = isinstance(value, Hex) or path[-1] in _HEX or "groups" in path
    return f"0x{value:X}" if as_hex and value >= 0 else str(int(value))


def _scalar(text: str) -> str:
    if _DATE.fullmatch(text):
        return text
    if _PLAIN.fullmatch(text) and text.lower() not in _WORDS:
        return text
    return "".join(_printable(c) for c in json.dumps(text, ensure_ascii=False))


def _printable(character: str) -> str:
    """Return a character, or its escape where YAML would not take it as it is."""
    if character.isprintable():
        return character
    code = ord(character)
    return (
        f"\\x{code:02x}"
        if code <= 0xFF
        else f"\\u{code:04x}"
        if code <= 0xFFFF
        else (f"\\U{code:08x}")
    )
