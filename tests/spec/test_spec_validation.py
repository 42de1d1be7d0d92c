"""What pydantic says, in a technician's words; used for benches and faults as well."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import pytest
from pydantic import BaseModel, ConfigDict, Field

from conformance.spec.validation import validate
from conformance.spec.yaml_reader import YamlFile


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    deep: bool = False


class Outer(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    plain: Inner | None = None
    few: Annotated[list[int], Field(max_length=2)] = []
    short: Annotated[str, Field(max_length=3)] = ""
    address: Annotated[str, Field(pattern="^0x")] = "0x"
    more: Annotated[float, Field(gt=0, lt=10)] = 1.0
    finite: Annotated[float, Field(allow_inf_nan=False)] = 1.0
    keys: dict[Annotated[str, Field(min_length=2)], int] = {}
    kind: bytes = b""
    either: int | Inner = 0


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        ({"plain": 5}, "plain: expected a mapping, got 5"),
        ({"plain": {"deep": 1}}, "plain.deep: expected true or false, got 1"),
        (
            {"plain": {"few": 1}},
            "plain.few: expected a known key, got 'few', which belongs elsewhere",
        ),
        ({"few": [1, 2, 3]}, "few: expected at most 2 of them, got 3"),
        ({"few": [1, "b"]}, "few.1: expected an integer, got 'b'"),
        ({"short": "long"}, "short: expected at most 3 characters, got 'long'"),
        ({"address": "5"}, "address: expected a text of the form ^0x, got '5'"),
        ({"more": 0.0}, "more: expected more than 0.0, got 0.0"),
        ({"more": 10}, "more: expected less than 10.0, got 10"),
        ({"more": "1"}, "more: expected a number, got '1'"),
        ({"finite": float("inf")}, "finite: expected a number, got inf"),
        ({"keys": {"a": 1}}, "keys.a: expected at least 2 characters as key, got 'a'"),
        ({"kind": 1}, "kind: expected a valid bytes, got 1"),
        ({"plains": None}, "plains: expected a known key, got 'plains' (did you mean 'plain'?)"),
    ],
)
def test_a_complaint_becomes_one_sentence(data: Any, sentence: str) -> None:
    model, problems = validate(Outer, YamlFile(Path("x.yaml"), data))
    assert model is None
    assert [str(problem) for problem in problems] == [f"x.yaml: {sentence}"]


def test_a_choice_gets_a_sentence_for_each_alternative_at_the_same_key() -> None:
    _, problems = validate(Outer, YamlFile(Path("x.yaml"), {"either": "a"}))
    assert [str(problem) for problem in problems] == [
        "x.yaml: either: expected an integer, got 'a'",
        "x.yaml: either: expected a mapping, got 'a'",
    ]


def test_good_data_become_the_model() -> None:
    model, problems = validate(Outer, YamlFile(Path("x.yaml"), {"few": [1]}))
    assert (model, problems) == (Outer(few=[1]), [])
