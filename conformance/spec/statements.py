"""Statements of a manual: the file beside a spec that lists them, what verifies each, or why nothing does."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, ConfigDict, Field, WithJsonSchema, model_validator

from conformance.errors import Problem, SpecError
from conformance.spec.fields import AmbiguityId, Source, StrictModel
from conformance.spec.load import SpecFile, load_spec, state_of
from conformance.spec.readings import parse_path
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import Path_, YamlFile, read_yaml, shown

Need: TypeAlias = Literal["power", "stimulus", "operator"]
_ENDING = ".statements"
_ID = re.compile(r"S-[0-9]{3,}")
_FATES = ("verified_by", "needs", "because", "open")


def _statement_id(value: str) -> str:
    if not _ID.fullmatch(value):
        raise ValueError(f"expected an id such as S-001, got {shown(value)}")
    return value


_StatementId = Annotated[
    str,
    AfterValidator(_statement_id),
    WithJsonSchema({"type": "string", "pattern": f"^{_ID.pattern}$"}),
]
_Text = Annotated[str, Field(min_length=1)]
_Texts = Annotated[list[_Text], Field(min_length=1)]


def _only(fate: str) -> dict[str, Any]:
    """Return the JSON Schema of a statement with this fate, told apart from one that is verified."""
    verified = {"required": ["verified_by"]}
    return {"required": [fate]} | ({"not": verified} if fate == "needs" else {})


class Statement(StrictModel):
    """One sentence of the manual that says what the device does or accepts; one fate each.

    A statement that is verified may say as well what its check needs.
    """

    model_config = ConfigDict(json_schema_extra={"oneOf": [_only(fate) for fate in _FATES]})

    id: _StatementId
    source: Source
    says: _Text = Field(description="The sentence, paraphrased.")
    encoded: list[_Text] = Field(
        default=[], description="Paths in the spec where the fact stands (objects/0x1017/ranges)."
    )
    ambiguity: list[AmbiguityId] = Field(
        default=[], description="Ambiguities recorded on this statement."
    )
    variants: _Texts | None = Field(default=None, description="True of these variants only.")
    verified_by: _Texts | None = Field(
        default=None, description="Requirements whose check shows it on a bus."
    )
    needs: Need | None = Field(
        default=None, description="What a check needs; without verified_by none exists."
    )
    because: _Text | None = Field(default=None, description="Why no bus can show it.")
    open: _Text | None = Field(
        default=None, description="A bus could show it; what no check asks yet."
    )

    @model_validator(mode="after")
    def _has_one_fate(self) -> Statement:
        given = [name for name in _FATES if getattr(self, name) is not None]
        if len(given) != 1 and given != ["verified_by", "needs"]:
            got = " and ".join(given) or "none"
            raise ValueError(f"expected exactly one of {', '.join(_FATES)}, got {got}")
        return self

    def applies_to(self, variant: str) -> bool:
        """Tell whether the statement is about a variant."""
        return self.variants is None or variant in self.variants


class StatementsDocument(StrictModel):
    """The content of a statements file."""

    format: Literal[1]
    device: _Text = Field(description="Name of the spec beside this file.")
    statements: Annotated[list[Statement], Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class StatementsFile:
    """A statements file that holds together with its spec."""

    yaml: YamlFile
    document: StatementsDocument

    @property
    def statements(self) -> list[Statement]:
        """Every statement, by ascending id."""
        return self.document.statements


def is_statements_file(path: Path) -> bool:
    """Tell whether a file lists statements, by its name: ``my_sensor.statements.yaml``."""
    return path.stem.endswith(_ENDING)


def statements_of(spec: Path) -> Path:
    """Return where the statements of a spec file stand, if it has any."""
    return spec.with_name(f"{spec.stem}{_ENDING}{spec.suffix}")


def spec_of(statements: Path) -> Path:
    """Return the spec file that a statements file belongs to."""
    return statements.with_name(f"{statements.stem.removesuffix(_ENDING)}{statements.suffix}")


def find_statement_problems(spec: SpecFile) -> tuple[StatementsFile | None, list[Problem]]:
    """Return the statements beside a spec, if they can be used, and every problem found in them."""
    path = statements_of(spec.yaml.path)
    try:
        yaml = read_yaml(path)
    except SpecError as error:
        return None, [p for p in error.problems if isinstance(p, Problem)]
    if yaml.data is None:
        return None, [Problem(path, 0, "", "expected statements, got an empty file")]
    document, invalid = validate(StatementsDocument, yaml)
    problems = [*yaml.problems, *invalid]
    if document is not None:
        problems += [yaml.problem(*mistake) for mistake in _mistakes(document, spec)]
    if problems or document is None:
        return None, sorted(dict.fromkeys(problems), key=lambda problem: problem.line)
    return StatementsFile(yaml, document), []


def load_statements(spec: SpecFile) -> StatementsFile | None:
    """Return the statements beside a spec, or None when there is no such file.

    Raises:
        SpecError: With every problem of the file.
    """
    path = spec.yaml.path
    statements = statements_of(path)
    if not statements.exists():
        return None
    return _load(path, state_of(path), state_of(statements))


@lru_cache(maxsize=32)
def _load(path: Path, _spec: tuple[int, ...], _statements: tuple[int, ...]) -> StatementsFile:
    file, problems = find_statement_problems(load_spec(path))
    if file is None:
        raise SpecError(*problems)
    return file


def _mistakes(document: StatementsDocument, spec: SpecFile) -> Iterator[tuple[Path_, str]]:
    if document.device != spec.name:
        text = f"expected {spec.name}, the spec beside this file, got {shown(document.device)}"
        yield ("device",), text
    yield from _id_mistakes(document.statements)
    ambiguities = {ambiguity.id for ambiguity in spec.document.ambiguities}
    for number, statement in enumerate(document.statements):
        place = ("statements", number)
        for nth, path in enumerate(statement.encoded):
            if not _stands_in(spec.yaml.data, parse_path(path)):
                wanted = f"a path such as objects/0x1017/default of {spec.yaml.path.name}"
                yield (*place, "encoded", nth), f"expected {wanted}, got {shown(path)}"
        for nth, name in enumerate(statement.ambiguity):
            if name not in ambiguities:
                text = f"expected an ambiguity of {spec.yaml.path.name}, got {name}"
                yield (*place, "ambiguity", nth), text
        for nth, name in enumerate(statement.variants or ()):
            if name not in spec.variants:
                known = ", ".join(spec.variants)
                text = f"expected a variant of {spec.yaml.path.name} ({known}), got {shown(name)}"
                yield (*place, "variants", nth), text


def _id_mistakes(statements: Iterable[Statement]) -> Iterator[tuple[Path_, str]]:
    seen: set[str] = set()
    last = "S-000"
    for number, statement in enumerate(statements):
        path = ("statements", number, "id")
        if statement.id in seen:
            yield path, f"expected each id once, got {statement.id} again"
        elif _number(statement.id) < _number(last):
            yield path, f"expected ascending ids, got {statement.id} after {last}"
        seen.add(statement.id)
        last = max(last, statement.id, key=_number)


def _number(identifier: str) -> int:
    return int(identifier.removeprefix("S-"))


def _stands_in(data: Any, path: Path_) -> bool:
    for key in path:
        if isinstance(data, list):
            if not isinstance(key, int) or not 0 <= key < len(data):
                return False
        elif not isinstance(data, dict) or key not in data:
            return False
        data = data[key]
    return True
