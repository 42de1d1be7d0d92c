"""Defects that no bus shows: the file beside a spec that lists them, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from conformance.errors import SpecError
from conformance.mutants.defect import Defect
from conformance.spec.fields import StrictModel
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import YamlFile, read_yaml

ENDING = ".equivalents"
_Text = Annotated[str, Field(min_length=1)]


class Equivalent(StrictModel):
    """Defects with one reason why they are none to see: ``*`` stands for any part of an id."""

    defects: Annotated[list[_Text], Field(min_length=1)]
    why: _Text
    variants: list[_Text] | None = None


class _Document(StrictModel):
    format: Literal[1]
    equivalents: list[Equivalent]


@dataclass(frozen=True, slots=True)
class Equivalents:
    """The list of one device; an empty one where there is no file."""

    yaml: YamlFile | None
    entries: tuple[Equivalent, ...]
    variant: str

    def why(self, defect: Defect) -> str:
        """Return why a defect cannot be seen, empty where it can."""
        for entry in self._of_variant():
            if any(fnmatchcase(defect.id, _literal(it)) for it in entry.defects):
                return entry.why
        return ""

    def useless(self, defects: list[Defect]) -> list[str]:
        """Return those of the ids listed that no defect has."""
        return [
            pattern
            for entry in self._of_variant()
            for pattern in entry.defects
            if not any(fnmatchcase(defect.id, _literal(pattern)) for defect in defects)
        ]

    def _of_variant(self) -> list[Equivalent]:
        return [it for it in self.entries if it.variants is None or self.variant in it.variants]


def _literal(pattern: str) -> str:
    """Return a pattern in which brackets stand for themselves."""
    return pattern.replace("[", "[[]")


def load_equivalents(spec: Path, variant: str) -> Equivalents:
    """Return the list beside a spec file.

    Raises:
        SpecError: The file is wrong.
    """
    path = spec.with_name(f"{spec.stem}{ENDING}{spec.suffix}")
    if not path.is_file():
        return Equivalents(None, (), variant)
    yaml = read_yaml(path)
    document, invalid = validate(_Document, yaml)
    problems = [*yaml.problems, *invalid]
    if document is None or problems:
        raise SpecError(*problems)
    return Equivalents(yaml, tuple(document.equivalents), variant)
