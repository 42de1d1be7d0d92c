"""Readings of ambiguities: changes to values of the document, each at a path of the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import TypeAdapter, ValidationError

from conformance.spec.behaviours import Behaviour
from conformance.spec.document import (
    Ambiguity,
    ObjectDoc,
    RecordDoc,
    Services,
    SpecDocument,
    VariableDoc,
)
from conformance.spec.validation import complaints
from conformance.spec.yaml_reader import Path_

_OBJECT: TypeAdapter[VariableDoc | RecordDoc] = TypeAdapter(ObjectDoc)
_BEHAVIOURS: TypeAdapter[dict[str, Behaviour]] = TypeAdapter(dict[str, Behaviour])


class ChangeError(ValueError):
    """Some changes do not fit the file.

    Args:
        mistakes: Path in the changed file and ``expected …, got …``.
    """

    def __init__(self, *mistakes: tuple[Path_, str]) -> None:
        super().__init__("; ".join(text for _, text in mistakes))
        self.mistakes = mistakes


def parse_path(text: str) -> Path_:
    """Return the keys of a path such as ``objects/0x1003/subs/0/default``."""
    return tuple(_number_or_name(part) for part in text.split("/"))


def _number_or_name(part: str) -> int | str:
    try:
        return int(part, 0)
    except ValueError:
        return part


def changes_of(ambiguities: Sequence[Ambiguity], numbers: Sequence[int]) -> dict[str, Any]:
    """Return all changes of one reading per ambiguity, by its 1-based number."""
    changes: dict[str, Any] = {}
    for ambiguity, number in zip(ambiguities, numbers, strict=True):
        changes.update(ambiguity.readings[number - 1].changes)
    return changes


def touched_objects(changes: Mapping[str, Any]) -> list[int]:
    """Return the indices of the objects that a reading changes."""
    indices = set()
    for text in changes:
        match parse_path(text):
            case ("objects", int(index), *_):
                indices.add(index)
    return sorted(indices)


def touches_services(changes: Mapping[str, Any]) -> bool:
    """Tell whether a reading changes a service."""
    return _touches("services", changes)


def touches_behaviours(changes: Mapping[str, Any]) -> bool:
    """Tell whether a reading changes a behaviour."""
    return _touches("behaviours", changes)


def _touches(part: str, changes: Mapping[str, Any]) -> bool:
    return any(parse_path(text)[0] == part for text in changes)


def patched(document: SpecDocument, data: Any, changes: Mapping[str, Any]) -> SpecDocument:
    """Return the document as it is with the changes of a reading.

    Args:
        document: The document as it stands in the file.
        data: The plain data it was made from.
        changes: Path to value.

    Raises:
        ChangeError: A path does not exist, or a value does not fit its path.
    """
    if not changes:
        return document
    changed = _applied(data, changes)
    mistakes: list[tuple[Path_, str]] = []
    update: dict[str, Any] = {"objects": dict(document.objects)}
    for index in touched_objects(changes):
        part = changed["objects"][index]
        try:
            update["objects"][index] = _OBJECT.validate_python(part)
        except ValidationError as error:
            mistakes += _below(("objects", index), error, part)
    if touches_services(changes):
        part = changed["services"]
        try:
            update["services"] = Services.model_validate(part)
        except ValidationError as error:
            mistakes += _below(("services",), error, part)
    if _touches("behaviours", changes):
        part = changed["behaviours"]
        try:
            update["behaviours"] = _BEHAVIOURS.validate_python(part)
        except ValidationError as error:
            mistakes += _below(("behaviours",), error, part)
    if mistakes:
        raise ChangeError(*mistakes)
    return document.model_copy(update=update)


def _below(place: Path_, error: ValidationError, part: Any) -> Iterator[tuple[Path_, str]]:
    for path, text in complaints(error, part, SpecDocument):
        yield (*place, *path), text


def _applied(data: Any, changes: Mapping[str, Any]) -> Any:
    """Return plain data with the values at some paths replaced; what is not on them is shared."""
    for text, value in changes.items():
        path = parse_path(text)
        try:
            data = _replaced(data, path if _may_change(path) else (), value)
        except (KeyError, IndexError, TypeError):
            sentence = f"expected a path such as objects/0x1017/default of this file, got {text!r}"
            raise ChangeError((path, sentence)) from None
    return data


def _may_change(path: Path_) -> bool:
    match path:
        case ("services" | "behaviours", str(), *_):
            return True
        case ("objects", int(index), *_):
            return 0 <= index <= 0xFFFF
        case _:
            return False


def _replaced(place: Any, path: Path_, value: Any) -> Any:
    if not path or not isinstance(place, dict | list):
        raise TypeError
    first, *rest = path
    copied: Any = place.copy()
    copied[first] = _replaced(copied[first], tuple(rest), value) if rest else value
    return copied
