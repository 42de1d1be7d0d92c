"""Statements files: what is wrong with one is told at its line, and those of the house are good."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from conformance.errors import SpecError
from conformance.resources import data, names
from conformance.spec.load import load_spec
from conformance.spec.schema import STATEMENTS_NAME, statements_schema
from conformance.spec.statements import (
    StatementsFile,
    find_statement_problems,
    is_statements_file,
    load_statements,
    spec_of,
    statements_of,
)
from conformance.spec.yaml_reader import read_yaml

SPECS = data("device_specs")
VALIDATOR = Draft202012Validator(statements_schema())
GOOD = """\
format: 1
device: spec
statements:
  - id: S-001
    source: "2"
    says: The heartbeat period is set in 1017h.
    encoded: [objects/0x1017/ranges/1, services/heartbeat_producer/min_ms]
    ambiguity: [T-02]
    verified_by: [HB-01]
  - id: S-002
    source: "1"
    says: There is a second axis.
    encoded: [variants/two]
    variants: [two]
    needs: stimulus
  - {id: S-004, source: "1", says: It weighs 100 g., because: a bus carries no mass}
  - {id: S-010, source: "1", says: It sends EMCY., open: no check asks for EMCY}
"""

Edit = tuple[str, str]
Beside = Callable[[str], Path]


@pytest.fixture
def beside(tmp_path: Path, good: str) -> Beside:
    """Write statements beside the good spec."""

    def write(text: str) -> Path:
        (tmp_path / "spec.yaml").write_text(good, encoding="utf-8")
        path = tmp_path / "spec.statements.yaml"
        path.write_text(text, encoding="utf-8", newline="")
        return path

    return write


def sentences(path: Path) -> str:
    file, problems = find_statement_problems(load_spec(spec_of(path)))
    assert (file is None) == bool(problems)
    return "\n".join(str(problem).removeprefix(str(path)) for problem in problems)


def changed(edit: Edit) -> str:
    old, new = edit
    assert GOOD.count(old) == 1
    return GOOD.replace(old, new)


def test_a_good_file_is_what_it_says(beside: Beside) -> None:
    path = beside(GOOD)

    assert sentences(path) == ""
    file = load_statements(load_spec(spec_of(path)))
    assert isinstance(file, StatementsFile)
    first, second, third, fourth = file.statements
    assert first.verified_by == ["HB-01"]
    assert first.ambiguity == ["T-02"]
    assert [s.applies_to("one") for s in file.statements] == [True, False, True, True]
    assert second.needs == "stimulus"
    assert third.because == "a bus carries no mass"
    assert fourth.open == "no check asks for EMCY"


def test_a_file_is_read_once_and_again_when_it_was_changed(beside: Beside) -> None:
    path = beside(GOOD)
    spec = load_spec(spec_of(path))
    first = load_statements(spec)
    assert load_statements(spec) is first

    path.write_text(GOOD.replace("a bus carries no mass", "nobody weighs it"), encoding="utf-8")
    file = load_statements(spec)
    assert file is not None
    assert file.statements[2].because == "nobody weighs it"


def test_a_spec_without_statements_has_none(tmp_path: Path, good: str) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(good, encoding="utf-8")
    assert load_statements(load_spec(path)) is None


def test_the_two_files_of_a_device_find_each_other() -> None:
    spec, statements = Path("a/x.yaml"), Path("a/x.statements.yaml")
    assert statements_of(spec) == statements
    assert spec_of(statements) == spec
    assert is_statements_file(statements)
    assert not is_statements_file(spec)


FATES = "expected exactly one of verified_by, needs, because, open"
PATHS = "expected a path such as objects/0x1017/default of spec.yaml"


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (("format: 1", "format: 2"), ":1: format: expected 1, got 2"),
        (
            ("device: spec", "device: other"),
            ":2: device: expected spec, the spec beside this file, got 'other'",
        ),
        (("S-001", "S-01"), ":4: statements.0.id: expected an id such as S-001, got 'S-01'"),
        (("S-001", "1"), ":4: statements.0.id: expected a text, got 1"),
        (("S-002", "S-001"), ":10: statements.1.id: expected each id once, got S-001 again"),
        (("S-010", "S-003"), ":17: statements.3.id: expected ascending ids, got S-003 after S-004"),
        (('    source: "2"\n', ""), ":4: statements.0.source: expected this key, got nothing"),
        (
            ("    says: There is a second axis.\n", ""),
            ":10: statements.1.says: expected this key, got nothing",
        ),
        (
            ("says: There is a second axis.", 'says: ""'),
            ":12: statements.1.says: expected at least 1 characters, got ''",
        ),
        (
            ("    says: There", "    say: There"),
            (
                ":10: statements.1.says: expected this key, got nothing\n"
                ":12: statements.1.say: expected a known key, got 'say' (did you mean 'says'?)"
            ),
        ),
        (("    needs: stimulus\n", ""), f":10: statements.1: {FATES}, got none"),
        (
            ("needs: stimulus", "needs: power\n    open: later"),
            f":10: statements.1: {FATES}, got needs and open",
        ),
        (
            ("needs: stimulus", "because: no\n    verified_by: [HB-01]"),
            f":10: statements.1: {FATES}, got verified_by and because",
        ),
        (
            ("needs: stimulus", "needs: luck"),
            ":15: statements.1.needs: expected 'power', 'stimulus' or 'operator', got 'luck'",
        ),
        (
            ("verified_by: [HB-01]", "verified_by: []"),
            ":9: statements.0.verified_by: expected at least 1 of them, got 0",
        ),
        (
            ("verified_by: [HB-01]", "verified_by: HB-01"),
            ":9: statements.0.verified_by: expected a list, got 'HB-01'",
        ),
        (
            ("0x1017/ranges/1", "0x1017/ranges/2"),
            f":7: statements.0.encoded.0: {PATHS}, got 'objects/0x1017/ranges/2'",
        ),
        (
            ("0x1017/ranges/1", "0x1017/range"),
            f":7: statements.0.encoded.0: {PATHS}, got 'objects/0x1017/range'",
        ),
        (
            ("0x1017/ranges/1", "0x1017/type/1"),
            f":7: statements.0.encoded.0: {PATHS}, got 'objects/0x1017/type/1'",
        ),
        (
            ("0x1017/ranges/1", "0x1017/ranges/first"),
            f":7: statements.0.encoded.0: {PATHS}, got 'objects/0x1017/ranges/first'",
        ),
        (
            ("services/heartbeat_producer/min_ms", "services/heartbeat"),
            f":7: statements.0.encoded.1: {PATHS}, got 'services/heartbeat'",
        ),
        (
            ("[T-02]", "[T-03]"),
            ":8: statements.0.ambiguity.0: expected an ambiguity of spec.yaml, got T-03",
        ),
        (
            ("[T-02]", "[t2]"),
            ":8: statements.0.ambiguity.0: expected an id such as X-07, got 't2'",
        ),
        (
            ("variants: [two]", "variants: [two, three]"),
            ":14: statements.1.variants.1: expected a variant of spec.yaml (one, two), got 'three'",
        ),
        (
            ("    variants: [two]\n", "    variants: [two]\n    variants: [one]\n"),
            ":15: statements.1.variants: expected each key once, got it again (first on line 14)",
        ),
        ((GOOD, ""), ": expected statements, got an empty file"),
        (
            (GOOD[GOOD.index("statements:") :], "statements: []\n"),
            ":3: statements: expected at least 1 of them, got 0",
        ),
        ((GOOD, "- 1\n"), ":1: expected a mapping, got [1]"),
    ],
)
def test_a_mistake_is_told_in_one_sentence_at_its_line(
    edit: Edit, sentence: str, beside: Beside
) -> None:
    path = beside(changed(edit))

    assert sentences(path) == sentence
    with pytest.raises(SpecError):
        load_statements(load_spec(spec_of(path)))


def test_what_is_no_yaml_or_no_file_is_refused(beside: Beside) -> None:
    path = beside(GOOD.replace("It sends EMCY.", "It sends: EMCY: 1"))
    assert re.fullmatch(r":\d+: expected YAML, got: .+", sentences(path))
    path.unlink()
    assert sentences(path).startswith(": expected a readable file, got: ")


WITH_STATEMENTS = [
    name for name in names("device_specs") if statements_of(SPECS / f"{name}.yaml").exists()
]


@pytest.mark.parametrize("name", WITH_STATEMENTS)
def test_statements_of_the_house_are_good(name: str) -> None:
    spec = load_spec(SPECS / f"{name}.yaml")
    _, problems = find_statement_problems(spec)
    assert [str(problem) for problem in problems] == []
    path = statements_of(spec.yaml.path)
    assert [error.message for error in VALIDATOR.iter_errors(read_yaml(path).data)] == []
    first = path.read_text(encoding="utf-8").splitlines()[0]
    schema = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", first)
    assert schema is None or (SPECS / schema[1]).is_file()


def test_the_schema_is_valid_and_in_device_specs() -> None:
    Draft202012Validator.check_schema(statements_schema())
    written = json.loads((SPECS / STATEMENTS_NAME).read_text(encoding="utf-8"))
    assert written == statements_schema(), "run: python -m conformance.spec.schema"


@pytest.mark.parametrize(
    "edit",
    [
        ("S-001", "S-1"),
        ("needs: stimulus", "needs: luck"),
        ("    needs: stimulus\n", ""),
        ("needs: stimulus", "needs: power\n    open: later"),
        ("needs: stimulus", "needs: power\n    verified_by: [HB-01]\n    open: later"),
        ("    says: There", "    say: There"),
    ],
)
def test_the_schema_refuses_a_typo(edit: Edit, beside: Beside) -> None:
    assert not list(VALIDATOR.iter_errors(read_yaml(beside(GOOD)).data))
    assert list(VALIDATOR.iter_errors(read_yaml(beside(changed(edit))).data))


def test_what_a_check_needs_may_stand_beside_what_verifies(beside: Beside) -> None:
    path = beside(changed(("needs: stimulus", "needs: power\n    verified_by: [HB-01]")))
    assert not list(VALIDATOR.iter_errors(read_yaml(path).data))
    file, problems = find_statement_problems(load_spec(spec_of(path)))
    assert problems == []
    assert file is not None
    second = file.statements[1]
    assert (second.needs, second.verified_by) == ("power", ["HB-01"])
