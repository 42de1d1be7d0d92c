"""The README of the checks is that of the registry, and every case of the industry's tool has its answer."""

from __future__ import annotations

import re
import runpy
import sys
from itertools import chain
from pathlib import Path

import pytest

from conformance.checks import industry_cases, reference
from conformance.checks.industry_cases import load_cases
from conformance.checks.loading import load_checks
from conformance.errors import SpecError

LAST = {1: 0, 2: 30, 3: 33, 4: 10, 5: 6, 6: 10, 8: 10, 9: 4, 10: 4}
"""Last case of each group; those of group 7 are numbered in three rows."""
ROWS_OF_7 = (range(1, 7), range(101, 108), range(201, 208))


def test_the_readme_is_up_to_date() -> None:
    expected = reference.page(load_checks().values(), load_cases())
    assert reference.PATH.read_text(encoding="utf-8") == expected, (
        "run: python -m conformance.checks.reference"
    )


@pytest.mark.parametrize("arguments", [[], ["other.md"]])
def test_the_module_writes_the_readme(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]
) -> None:
    written = tmp_path / "other.md" if arguments else tmp_path / "README.md"
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["reference", *arguments])
    copy = tmp_path / "reference.py"
    copy.write_bytes(Path(reference.__file__).read_bytes())

    runpy.run_path(str(copy), run_name="__main__")

    assert written.read_bytes() == reference.PATH.read_bytes()


def test_the_readme_has_a_row_for_each_requirement_and_each_case() -> None:
    text = reference.PATH.read_text(encoding="utf-8")
    first = re.findall(r"^\| ([A-Z]+-\d+|\d+\.\d+) \|", text, re.MULTILINE)
    cases = [it.case for group in load_cases() for it in group.cases]
    assert sorted(first) == sorted([*load_checks(), *cases])
    assert {len(re.findall(r"(?<!\\)\|", line)) for line in text.splitlines()} <= {0, 5, 7}


def test_every_case_of_the_tool_is_there_once_and_in_order() -> None:
    sevens = [f"7.{number}" for number in chain(*ROWS_OF_7)]
    others = {n: [f"{n}.{m}" for m in range(last != 0, last + 1)] for n, last in LAST.items()}
    expected = [case for n in range(1, 11) for case in (sevens if n == 7 else others[n])]
    assert [it.case for group in load_cases() for it in group.cases] == expected


def test_every_requirement_that_a_case_names_exists() -> None:
    named = {name for group in load_cases() for it in group.cases for name in it.covered_by}
    assert named - set(load_checks()) == set()


@pytest.mark.parametrize(
    ("case", "sentence"),
    [
        ('{case: "2.1", asks: Why?}', "expected covered_by, because, or both, got none"),
        ("{case: 2.10, asks: Why?, because: no}", "groups.0.cases.0.case: expected a text"),
        ('{case: "2", asks: Why?, because: no}', "groups.0.cases.0.case: expected a text of"),
        ('{case: "2.1", ask: Why?, because: no}', "expected a known key"),
    ],
)
def test_a_mistake_in_the_cases_is_told_at_its_line(
    tmp_path: Path, case: str, sentence: str
) -> None:
    path = tmp_path / "cases.yaml"
    path.write_text(
        f"format: 1\ngroups:\n  - title: SDO\n    cases:\n      - {case}\n", encoding="utf-8"
    )

    with pytest.raises(SpecError) as caught:
        industry_cases.load_cases(path)

    assert f"{path}:5: " in str(caught.value)
    assert sentence in str(caught.value)
