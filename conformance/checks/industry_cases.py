"""The cases of the industry's conformance test tool, and the requirements that ask the same."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from conformance.errors import SpecError
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import read_yaml

PATH = Path(__file__).with_name("industry_cases.yaml")

_Text = Annotated[str, Field(min_length=1)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class IndustryCase(_Model):
    """One case of the tool.

    Args:
        case: Its number.
        asks: What it asks, in our words.
        covered_by: Requirements that ask it.
        because: Why none does, or in which way they differ.
    """

    case: Annotated[str, Field(pattern=r"^\d+\.\d+$")]
    asks: _Text
    covered_by: list[_Text] = []
    because: _Text | None = None

    @model_validator(mode="after")
    def _says_one_or_the_other(self) -> IndustryCase:
        if not self.covered_by and self.because is None:
            raise ValueError("expected covered_by, because, or both, got none")
        return self


class Group(_Model):
    """Cases on one thing."""

    title: _Text
    cases: Annotated[list[IndustryCase], Field(min_length=1)]


class _File(_Model):
    format: Literal[1]
    groups: Annotated[list[Group], Field(min_length=1)]


def load_cases(path: Path = PATH) -> list[Group]:
    """Return the cases in a file, grouped.

    Raises:
        SpecError: With every problem of the file.
    """
    yaml = read_yaml(path)
    file, problems = validate(_File, yaml)
    if file is None or yaml.problems:
        raise SpecError(*yaml.problems, *problems)
    return file.groups
