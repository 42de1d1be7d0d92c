"""Pydantic's complaints as one sentence each: ``expected …, got …`` at a line of the file."""

from __future__ import annotations

import difflib
from collections.abc import Hashable
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from conformance.errors import Problem
from conformance.spec.yaml_reader import Path_, YamlFile

M = TypeVar("M", bound=BaseModel)
_TAGS = {"plain", "by_variant", "variable", "record", "int", "str", "[key]"}
_EXPECTED = {
    "missing": "this key",
    "int_type": "an integer",
    "string_type": "a text",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "date_type": "a date such as 2025-05-15",
    "date_from_datetime_parsing": "a date such as 2025-05-15",
    "date_parsing": "a date such as 2025-05-15",
}


def validate(model: type[M], file: YamlFile) -> tuple[M | None, list[Problem]]:
    """Return the file's content as ``model``, or what keeps it from being one.

    The data come from YAML, where a date is a text: it alone is converted.
    """
    try:
        return model.model_validate(file.data), []
    except ValidationError as error:
        known = sorted(_field_names(model.model_json_schema()))
        problems = [_problem(details, file, known) for details in error.errors(include_url=False)]
        return None, list(dict.fromkeys(problems))


def _field_names(schema: dict[str, Any]) -> set[str]:
    parts = [schema, *schema.get("$defs", {}).values()]
    return {name for part in parts for name in part.get("properties", {})}


def _problem(details: ErrorDetails, file: YamlFile, known: list[str]) -> Problem:
    path = _path(details["loc"], file.data)
    return file.problem(path, _sentence(details, path, known))


def _path(loc: tuple[int | str, ...], data: Any) -> Path_:
    """Return the keys of the file in ``loc``, without the tags that pydantic adds for unions."""
    path: list[Hashable] = []
    place = data
    for part in loc:
        known = _step(place, part)
        if known is _ABSENT:
            if part in _TAGS:
                continue
            path.append(part)
            place = None
        else:
            path.append(part)
            place = known
    return tuple(path)


_ABSENT = object()


def _step(place: Any, part: int | str) -> Any:
    if isinstance(place, dict):
        return place.get(part, _ABSENT)
    if isinstance(place, list) and isinstance(part, int) and part < len(place):
        return place[part]
    return _ABSENT


def _sentence(details: ErrorDetails, path: Path_, known: list[str]) -> str:
    kind, context = details["type"], details.get("ctx", {})
    if kind == "extra_forbidden":
        return f"expected a known key, got {path[-1]!r}{_nearest(str(path[-1]), known)}"
    if kind == "value_error":
        return str(context["error"])
    got = "nothing" if kind == "missing" else _short(details["input"])
    expected = _EXPECTED.get(kind)
    if kind == "literal_error":
        expected = context["expected"]
    elif expected is None:
        expected = details["msg"].removeprefix("Input should ").removeprefix("be ")
        expected = expected[:1].lower() + expected[1:]
    return f"expected {expected}, got {got}"


def _nearest(key: str, known: list[str]) -> str:
    close = difflib.get_close_matches(key, known, n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
