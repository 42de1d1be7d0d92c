"""The JSON Schema that editors use, and the README that shows how to write a spec."""

from __future__ import annotations

import json
import re
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from conformance.resources import data, names
from conformance.spec import schema
from conformance.spec.load import find_problems, load_spec
from conformance.spec.schema import json_schema
from conformance.spec.yaml_reader import read_yaml

SPECS = data("device_specs")
SCHEMA = SPECS / "schema.json"
VALIDATOR = Draft202012Validator(json_schema())


def as_editors_see_it(value: Any, *, hexadecimal: bool = False) -> Any:
    """Return data with texts for keys, as JSON has them."""
    if isinstance(value, dict):
        return {
            f"0x{key:X}"
            if hexadecimal and isinstance(key, int) and key >= 0
            else str(key): as_editors_see_it(below, hexadecimal=hexadecimal)
            for key, below in value.items()
        }
    if isinstance(value, list):
        return [as_editors_see_it(item, hexadecimal=hexadecimal) for item in value]
    return value


def complaints(path: Path, *, hexadecimal: bool = False) -> list[str]:
    document = as_editors_see_it(read_yaml(path).data, hexadecimal=hexadecimal)
    return [error.message for error in VALIDATOR.iter_errors(document)]


def test_the_schema_is_a_valid_schema_of_its_dialect() -> None:
    made = json_schema()
    Draft202012Validator.check_schema(made)
    assert made["$schema"] == schema.DIALECT
    assert made["title"] == "CANopen device spec"
    unknown = {"ge", "le", "gt", "lt"} & set(re.findall(r'"(\w+)":', json.dumps(made)))
    assert not unknown


def test_the_schema_in_device_specs_is_up_to_date() -> None:
    expected = json.loads(SCHEMA.read_text(encoding="utf-8"))
    assert expected == json_schema(), "run: python -m conformance.spec.schema"


@pytest.mark.parametrize("arguments", [[], ["other.json"]])
def test_the_module_writes_the_schema(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str]
) -> None:
    (tmp_path / "device_specs").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["schema", *arguments])
    runpy.run_path(schema.__file__, run_name="__main__")
    written = tmp_path / (arguments[0] if arguments else "device_specs/schema.json")
    assert written.read_bytes() == SCHEMA.read_bytes()


@pytest.mark.parametrize("name", names("device_specs"))
@pytest.mark.parametrize("hexadecimal", [False, True])
def test_every_spec_of_the_house_validates(name: str, *, hexadecimal: bool) -> None:
    path = SPECS / f"{name}.yaml"
    assert complaints(path, hexadecimal=hexadecimal) == []
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert first == "# yaml-language-server: $schema=schema.json"


def test_the_good_spec_validates(tmp_path: Path, good: str) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(good, encoding="utf-8")
    assert complaints(path) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("access: rw", "acess: rw"),
        ("access: rw", "access: rx"),
        ("type: UNSIGNED16", "type: UINT16"),
        ("0x1017:\n", "heartbeat:\n"),
        ("default: 50", "default: 0.5"),
        ("ranges: [[0, 0], [10, 65535]]", "ranges: [[0, 0, 0]]"),
        ("node_id: 0x0A", "node_id: 0"),
        ("format: 1", "format: 2"),
        ("date: 2025-05-15", "date: 15.5.2025"),
        ("id: T-01", "id: t1"),
        ("judged_by: either", "judged_by: both"),
        ("signature: save", "signature: saves"),
        ("      1: {name: All", "      one: {name: All"),
    ],
)
def test_a_typo_does_not_validate(tmp_path: Path, good: str, old: str, new: str) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(good.replace(old, new, 1), encoding="utf-8")
    assert complaints(path)
    assert find_problems(path)[1]


def example() -> str:
    """Return the spec that the README shows."""
    (text,) = re.findall(r"```yaml\n(.*?)```", README, re.DOTALL)
    return str(text)


README = (SPECS / "README.md").read_text(encoding="utf-8")


def test_the_example_of_the_readme_is_a_good_spec(tmp_path: Path) -> None:
    path = tmp_path / "my_sensor.yaml"
    path.write_text(example(), encoding="utf-8")
    assert [str(problem) for problem in find_problems(path)[1]] == []
    assert complaints(path) == []
    file = load_spec(path)
    for variant in file.variants:
        assert file.resolve(variant).entries


def test_the_readme_names_every_kind_and_every_attribute_of_an_entry() -> None:
    definitions = json_schema()["$defs"]
    entry = definitions["EntryDoc"]["properties"]
    words = [*entry, *entry["kind"]["enum"], *definitions["Services"]["properties"]]
    assert [word for word in words if f"`{word}`" not in README] == []
