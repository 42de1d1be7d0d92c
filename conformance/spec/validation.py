"""Pydantic's complaints as one sentence each: ``expected …, got …`` at a line of the file."""

from __future__ import annotations

import difflib
from collections.abc import Hashable, Iterator
from functools import cache
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from conformance.errors import Problem
from conformance.spec.yaml_reader import Path_, YamlFile, shown

M = TypeVar("M", bound=BaseModel)
_KEY = "[key]"
_EXPECTED = {
    "missing": "this key",
    "int_type": "an integer",
    "float_type": "a number",
    "finite_number": "a number",
    "string_type": "a text",
    "invalid_key": "a text",
    "string_too_short": "at least {min_length} characters",
    "string_pattern_mismatch": "a text of the form {pattern}",
    "string_too_long": "at most {max_length} characters",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "literal_error": "{expected}",
    "greater_than": "more than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "too_short": "at least {min_length} of them",
    "too_long": "at most {max_length} of them",
}


def validate(model: type[M], file: YamlFile) -> tuple[M | None, list[Problem]]:
    """Return the file's content as ``model``, or what keeps it from being one."""
    try:
        return model.model_validate(file.data), []
    except ValidationError as error:
        found = [file.problem(*it) for it in complaints(error, file.data, model)]
        return None, list(dict.fromkeys(found))


def complaints(
    error: ValidationError, data: Any, model: type[BaseModel]
) -> Iterator[tuple[Path_, str]]:
    """Return each complaint as its place in the data and a sentence.

    Args:
        error: What pydantic says.
        data: What it was given.
        model: The model whose keys to suggest for an unknown one.
    """
    for details in error.errors(include_url=False):
        path = _path(details, data)
        yield path, _sentence(details, path, model)


@cache
def _known_keys(model: type[BaseModel]) -> frozenset[str]:
    schema = model.model_json_schema()
    parts = [schema, *schema.get("$defs", {}).values()]
    return frozenset(name for part in parts for name in part.get("properties", {}))


def _path(details: ErrorDetails, data: Any) -> Path_:
    """Return the keys of the file in a location, without the tags that pydantic adds for unions."""
    path: list[Hashable] = []
    *parts, last = details["loc"] or ("",)
    for part in parts:
        if _has(data, part):
            path.append(part)
            data = data[part]
    if details["type"] == "missing" or _has(data, last):
        path.append(last)
    return tuple(path)


def _has(place: Any, part: int | str) -> bool:
    if isinstance(place, dict):
        return part in place
    return isinstance(place, list) and isinstance(part, int) and part < len(place)


def _sentence(details: ErrorDetails, path: Path_, model: type[BaseModel]) -> str:
    kind, context = details["type"], details.get("ctx", {})
    if kind == "extra_forbidden":
        return f"expected a known key, got {shown(path[-1])}{_hint(str(path[-1]), model)}"
    if kind == "value_error":
        return str(context["error"])
    value = details["input"]
    if kind == "union_tag_invalid":
        return f"expected {context['expected_tags']} as {context['discriminator']}, got {shown(context['tag'])}"
    if kind == "union_tag_not_found":
        return f"expected the key {context['discriminator']}, got none"
    got = "nothing" if kind == "missing" else shown(value)
    if kind in ("too_short", "too_long"):
        got = str(context["actual_length"])
    if kind == "invalid_key" or _KEY in details["loc"][-1:]:
        return f"expected {_expected(details)} as key, got {got}"
    return f"expected {_expected(details)}, got {got}"


def _expected(details: ErrorDetails) -> str:
    template = _EXPECTED.get(details["type"])
    if template is not None:
        return template.format_map(details.get("ctx", {}))
    text = details["msg"].removeprefix("Input should ").removeprefix("be ")
    return text[:1].lower() + text[1:]


def _hint(key: str, model: type[BaseModel]) -> str:
    known = _known_keys(model)
    if key in known:
        return ", which belongs elsewhere"
    close = difflib.get_close_matches(key, sorted(known), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""
