from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from conformance.errors import SpecError
from conformance.spec.yaml_reader import MOST_BYTES, YamlFile, read_yaml, shown, spell


def read(tmp_path: Path, content: str | bytes) -> YamlFile:
    path = tmp_path / "some.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_yaml(path)


def refusal(tmp_path: Path, content: str | bytes) -> str:
    with pytest.raises(SpecError) as caught:
        read(tmp_path, content)
    (problem,) = caught.value.problems
    assert str(caught.value) == str(problem)
    return str(problem).removeprefix(f"{tmp_path}{os.sep}")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("text", "text"),
        ('"5"', "5"),
        ("'0x5'", "0x5"),
        ("5", 5),
        ("+5", 5),
        ("-5", -5),
        ("0x1F", 31),
        ("-0x10", -16),
        ("0b11", 3),
        ("0o17", 15),
        ("1_000", 1000),
        ("18446744073709551615", 2**64 - 1),
        ("-9223372036854775808", -(2**63)),
        ("1.5", 1.5),
        ("-1e-3", -0.001),
        ("true", True),
        ("False", False),
        ("yes", "yes"),
        ("no", "no"),
        ("on", "on"),
        ("Off", "Off"),
        ("null", None),
        ("~", None),
        ("2025-05-15", "2025-05-15"),
        ("1:30", "1:30"),
        ("=", "="),
        ("_", "_"),
        ("|\n  a\n  b\n", "a\nb\n"),
        (">-\n  a\n  b\n", "a b"),
        ('"\\u00b0"', "°"),
        ("[]", []),
        ("{}", {}),
    ],
)
def test_a_scalar_is_what_yaml_1_2_says(tmp_path: Path, text: str, value: Any) -> None:
    data = read(tmp_path, f"key: {text}").data
    assert data == {"key": value}
    assert type(data["key"]) is type(value)


def test_every_key_and_item_has_its_line(tmp_path: Path) -> None:
    file = read(tmp_path, "a: 1\nb:\n  0x1017: {c: 2,\n    d: 3}\n  e:\n  - 4\n  - f: 5\n")
    assert file.data == {"a": 1, "b": {0x1017: {"c": 2, "d": 3}, "e": [4, {"f": 5}]}}
    assert file.lines == {
        (): 1,
        ("a",): 1,
        ("b",): 2,
        ("b", 0x1017): 3,
        ("b", 0x1017, "c"): 3,
        ("b", 0x1017, "d"): 4,
        ("b", "e"): 5,
        ("b", "e", 0): 6,
        ("b", "e", 1): 7,
        ("b", "e", 1, "f"): 7,
    }
    assert file.line(("b", 0x1017, "missing", "below")) == 3
    assert file.line(("nowhere",)) == 1
    assert YamlFile(Path("x")).line(("a",)) == 0


def test_a_problem_names_file_line_and_key_with_hexadecimal_indices(tmp_path: Path) -> None:
    file = read(tmp_path, "objects:\n  0x1018:\n    subs:\n      1: {default: 9}\n")
    problem = file.problem(("objects", 0x1018, "subs", 1, "default"), "expected 1, got 9")
    sentence = f"{tmp_path / 'some.yaml'}:4: objects.0x1018.subs.1.default: expected 1, got 9"
    assert str(problem) == sentence


def test_strange_keys_are_spelled_on_one_line() -> None:
    assert spell(("a b", -1, 0xFF, 0x100)) == "a b.-1.255.0x0100"
    assert spell(("a\nb", "x" * 100)) == f"'a\\nb'.'{'x' * 58}…"


def test_values_are_shown_as_they_stand_in_the_file() -> None:
    values = (None, True, False, 5, 1.5, "a", [1, "b"], {"a": 1}, "x" * 100)
    assert [shown(value) for value in values] == [
        *("nothing", "true", "false", "5", "1.5", "'a'", "[1, 'b']", "a mapping"),
        f"'{'x' * 58}…",
    ]


@pytest.mark.parametrize("content", ["", "\n\n", "# a comment\n# another\n", "---\n", "---\n...\n"])
def test_a_file_without_content_has_no_data(tmp_path: Path, content: str) -> None:
    assert read(tmp_path, content).data is None


def test_a_byte_order_mark_is_skipped(tmp_path: Path) -> None:
    file = read(tmp_path, b"\xef\xbb\xbfa: 1\nb: 2\n")
    assert (file.data, file.lines["b",]) == ({"a": 1, "b": 2}, 2)


def test_windows_line_ends_count_once(tmp_path: Path) -> None:
    file = read(tmp_path, "a: 1\r\nb: |\r\n  x\r\n  y\r\nc: 3\r\n")
    assert file.data == {"a": 1, "b": "x\ny\n", "c": 3}
    assert file.lines["c",] == 5
    assert file.text.endswith(b"3\r\n")


def test_a_key_given_twice_is_a_problem_that_names_both_lines(tmp_path: Path) -> None:
    file = read(tmp_path, "a: 1\nb:\n  1: x\n  0x01: {c: 1}\na: {d: 2}\na: 3\n")
    assert file.data == {"a": 1, "b": {1: "x"}}
    assert [str(problem).removeprefix(f"{tmp_path}{os.sep}") for problem in file.problems] == [
        "some.yaml:4: b.1: expected each key once, got it again (first on line 3)",
        "some.yaml:5: a: expected each key once, got it again (first on line 1)",
        "some.yaml:6: a: expected each key once, got it again (first on line 1)",
    ]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("a: &x 1\nb: 2", ":1: a: expected a plain value, got an anchor or alias (& or *)"),
        ("a: 1\nb: *x", ":2: b: expected a plain value, got an anchor or alias (& or *)"),
        ("a: &x {b: 1}", ":1: a: expected a plain value, got an anchor or alias (& or *)"),
        ("a: &x [1]", ":1: a: expected a plain value, got an anchor or alias (& or *)"),
        ("a:\n  &x b: 1", ":2: a: expected a plain value, got an anchor or alias (& or *)"),
        ("a: 1\n*x : 1", ":2: expected a plain value, got an anchor or alias (& or *)"),
        ("a: !!str 5", ":1: a: expected a plain value, got the tag tag:yaml.org,2002:str"),
        ("a: ! 5", ":1: a: expected a plain value, got the tag !"),
        ("a: !x {b: 1}", ":1: a: expected a plain value, got the tag !x"),
        ("a:\n- !x [1]", ":2: a.0: expected a plain value, got the tag !x"),
        ("!x a: 1", ":1: expected a plain value, got the tag !x"),
        ("a: 1\n---\nb: 2", ":2: expected one YAML document, got a second one"),
        ("---\n---\n", ":2: expected one YAML document, got a second one"),
        ("? [a]\n: 1", ":1: expected a name or an integer as key, got a collection"),
        ("a:\n  ? {b: 1}\n  : 1", ":2: a: expected a name or an integer as key, got a collection"),
        ("true: 1", ":1: expected a name or an integer as key, got 'true'"),
        ("a:\n  1.5: 1", ":2: a: expected a name or an integer as key, got '1.5'"),
        ("a:\n  : 1", ":2: a: expected a name or an integer as key, got ''"),
    ],
)
def test_what_only_programs_write_is_refused(tmp_path: Path, content: str, sentence: str) -> None:
    assert refusal(tmp_path, content) == f"some.yaml{sentence}"


@pytest.mark.parametrize(
    ("text", "got"),
    [
        ("017", "'017'"),
        ("08", "'08'"),
        (".inf", "'.inf'"),
        ("-.inf", "'-.inf'"),
        (".nan", "'.nan'"),
        ("1e999", "'1e999'"),
        ("18446744073709551616", "'18446744073709551616'"),
        ("-9223372036854775809", "'-9223372036854775809'"),
        ("9" * 5000, f"'{'9' * 58}…"),
        ("0x" + "F" * 5000, f"'0x{'F' * 56}…"),
    ],
)
def test_a_number_that_is_none_or_too_large_is_refused(tmp_path: Path, text: str, got: str) -> None:
    sentence = "expected a number of at most 64 bits (0x for hexadecimal)"
    assert refusal(tmp_path, f"a: {text}") == f"some.yaml:1: a: {sentence}, got {got}"


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("a: [1", ":1: expected YAML, got: expected ',' or ']', but got '<stream end>'"),
        ("a: 1\nb: c: 2", ":2: expected YAML, got: mapping values are not allowed here"),
        ("a:\n\t- 1", ":2: expected YAML, got: found character '\\t' that cannot start any token"),
        ("a: 1\nb: \x07", ":2: expected YAML, got: the character U+0007"),
        ('a: "\\UFFFFFFFF"', ": expected YAML, got an escape that is no character"),
        ('a: "\\U00110000"', ": expected YAML, got an escape that is no character"),
        ('a: 1\nb: "\\ud800"', ":2: b: expected Unicode text, got '\\ud800'"),
    ],
)
def test_what_is_not_yaml_is_refused_with_its_line(
    tmp_path: Path, content: str, sentence: str
) -> None:
    assert refusal(tmp_path, content) == f"some.yaml{sentence}"


def test_latin_1_is_refused_with_byte_and_line(tmp_path: Path) -> None:
    content = "a: 1\nunit: °C\n".encode("latin-1")
    assert refusal(tmp_path, content) == "some.yaml:2: expected UTF-8 text, got byte B0h"


def test_utf_16_is_refused(tmp_path: Path) -> None:
    content = "a: 1\n".encode("utf-16")
    assert refusal(tmp_path, content) == "some.yaml:1: expected UTF-8 text, got byte FFh"


@pytest.mark.parametrize("bracket", ["[", "{a: ", "- ", "a:\n "])
def test_nesting_is_bounded_before_it_costs_anything(tmp_path: Path, bracket: str) -> None:
    if bracket == "a:\n ":
        content = "".join(f"{' ' * depth}a:\n" for depth in range(1000))
    else:
        content = bracket * (MOST_BYTES // len(bracket))
    assert refusal(tmp_path, content).endswith(": expected at most 16 levels, got more")


def test_sixteen_levels_are_read(tmp_path: Path) -> None:
    assert read(tmp_path, "[" * 16 + "]" * 16).data is not None
    sentence = "some.yaml:1: 0.0.0: expected at most 16 levels, got more"
    assert refusal(tmp_path, "[" * 17 + "1" + "]" * 17) == sentence


def test_ten_megabytes_are_refused_unread(tmp_path: Path) -> None:
    sentence = "some.yaml: expected a file of at most 1 MB, got more"
    assert refusal(tmp_path, b"[" * 10_000_000) == sentence
    assert read(tmp_path, b"#" * MOST_BYTES).data is None


def test_a_missing_file_a_folder_and_an_impossible_name_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.yaml", tmp_path, tmp_path / "a\0b.yaml"):
        with pytest.raises(SpecError) as caught:
            read_yaml(path)
        assert str(caught.value).startswith(f"{path}: expected a readable file, got: ")
