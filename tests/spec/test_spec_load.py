"""Loading files: all or nothing, and nothing but SpecError."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conformance.errors import Problem, SpecError
from conformance.resources import data, names
from conformance.spec.load import SpecFile, find_problems, load_spec
from conformance.spec.yaml_reader import read_yaml

Problems: TypeAlias = Callable[[str], list[str]]

NASTY = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**65), 2**65),
    st.floats(),
    st.text(max_size=5),
    st.sampled_from(
        [0, 1, 255, 256, 65536, "NODEID", "NODEID*", "UNSIGNED8", "REAL32", "wo", "live", "either"]
    ),
    st.just([]),
    st.just({}),
    st.lists(st.integers(-1, 300), max_size=3),
    st.dictionaries(st.sampled_from([0, 1, "one", "two", "0x2000"]), st.integers(), max_size=2),
)


def write(folder: Path, content: str | bytes) -> Path:
    path = folder / "spec.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def use(file: SpecFile) -> None:
    """Resolve a good file in every way that needs no second reading asked for."""
    for variant in file.variants:
        assert file.resolve(variant, 127).entries
        for ambiguity in file.document.ambiguities:
            for number, reading in enumerate(ambiguity.readings, 1):
                if reading.changes:
                    file.resolve(variant, 1, {ambiguity.id: number})


def load_or_refuse(content: str | bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder), content)
        file, problems = find_problems(path)
        assert (file is None) == bool(problems)
        for problem in problems:
            assert str(problem).isprintable(), problem
            assert "expected " in problem.text
        if file is not None:
            use(file)
        else:
            with pytest.raises(SpecError) as caught:
                load_spec(path)
            assert caught.value.problems == tuple(problems)


def test_a_good_file_loads(tmp_path: Path, good: str) -> None:
    file = load_spec(write(tmp_path, good))
    assert (file.name, file.variants) == ("spec", ("one", "two"))
    assert file.document.device.vendor == "Nobody"
    use(file)


def test_a_file_with_windows_line_ends_and_a_byte_order_mark_loads(
    tmp_path: Path, good: str
) -> None:
    content = b"\xef\xbb\xbf" + good.replace("\n", "\r\n").encode()
    use(load_spec(write(tmp_path, content)))


def test_a_file_is_read_again_only_after_a_change(tmp_path: Path, good: str) -> None:
    path = write(tmp_path, good)
    assert load_spec(path) is load_spec(path)
    first = load_spec(path)
    path.write_text(good.replace("name: Tilt,", "name: Tilt 2,"), encoding="utf-8")
    os.utime(path, ns=(0, 0))
    assert load_spec(path) is not first
    assert load_spec(path).document.device.name == "Tilt 2"


def test_every_problem_is_in_the_error(tmp_path: Path, good: str) -> None:
    path = write(tmp_path, good.replace("default: 254", "default: 256").replace("two]", "too]"))
    with pytest.raises(SpecError) as caught:
        load_spec(path)
    assert str(caught.value) == (
        f"{path}:72: objects.0x1800.subs.2.default: expected 0 to 255 for UNSIGNED8, got 256\n"
        f"{path}:108: objects.0x2003.variants: expected a variant of this file (one, two), got 'too'"
    )
    assert all(isinstance(problem, Problem) for problem in caught.value.problems)


def test_a_file_that_is_not_there_is_an_error_not_a_traceback(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none.yaml", tmp_path / "none" / "none.yaml", Path("a\0b")):
        with pytest.raises(SpecError, match="expected a readable file, got: "):
            load_spec(path)


@pytest.mark.parametrize("name", names("device_specs"))
def test_every_spec_of_the_house_is_good(name: str) -> None:
    use(load_spec(data("device_specs") / f"{name}.yaml"))


@settings(deadline=None)
@given(st.text())
def test_an_arbitrary_text_is_refused(text: str) -> None:
    load_or_refuse(text.encode("utf-8", "surrogatepass"))


@settings(deadline=None)
@given(st.binary())
def test_arbitrary_bytes_are_refused(content: bytes) -> None:
    load_or_refuse(content)


@settings(deadline=None)
@given(st.text("[]{}-:,?!&*|>'\"%@#~\\U0x1a \n\t", max_size=60))
def test_a_text_of_yaml_characters_is_refused(text: str) -> None:
    load_or_refuse(text)


def mutated(lines: list[str], mutation: tuple[str, int, int, str]) -> list[str]:
    """Do one thing to a text: what, at which line, at which token or column, with what."""
    what, at, column, new = mutation
    at %= len(lines)
    line = lines[at]
    if what == "delete":
        return [*lines[:at], *lines[at + 1 :]] or [""]
    if what == "repeat":
        return [*lines[:at], line, *lines[at:]]
    if what == "swap":
        return [*lines[:at], *lines[at : at + 2][::-1], *lines[at + 2 :]]
    if what == "indent":
        return [*lines[:at], f" {line}" if column % 2 else line[1:], *lines[at + 1 :]]
    tokens = re.split(r"(\w+|\W)", line)
    place = column % len(tokens)
    return [*lines[:at], "".join([*tokens[:place], new, *tokens[place + 1 :]]), *lines[at + 1 :]]


WORDS = st.sampled_from(
    [
        *("", " ", ":", "[", "]", "{", "}", ",", "-", "#", "&a", "*a", "!!int", "\t", "0", "1"),
        *("-1", "256", "65536", "0x1017", "0x2000", "0x60110020", "4294967296", "1.5", "true"),
        *("null", "ro", "wo", "const", "live", "config", "constant", "UNSIGNED8", "INTEGER64"),
        *("VISIBLE_STRING", "REAL32", "BOOLEAN", "DOMAIN", "one", "two", "three", "either"),
        *("NODEID", "subs", "default", "variants", "ranges", "values", "objects", "services"),
    ]
)
MUTATIONS = st.lists(
    st.tuples(
        st.sampled_from(["delete", "repeat", "swap", "indent", "word", "word", "word", "word"]),
        st.integers(0, 200),
        st.integers(0, 80),
        WORDS,
    ),
    min_size=1,
    max_size=4,
)


@settings(deadline=None, max_examples=200)
@given(mutations=MUTATIONS)
def test_a_good_spec_with_changed_lines_is_used_or_refused(
    good: str, mutations: list[tuple[str, int, int, str]]
) -> None:
    lines = good.splitlines()
    for mutation in mutations:
        lines = mutated(lines, mutation)
    load_or_refuse("\n".join(lines))


@pytest.fixture(scope="session")
def good_data(good: str, tmp_path_factory: pytest.TempPathFactory) -> Any:
    return read_yaml(write(tmp_path_factory.mktemp("good"), good)).data


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Return the path of every value."""
    yield path
    if isinstance(value, dict):
        for key, below in value.items():
            yield from places(below, (*path, key))
    if isinstance(value, list):
        for number, below in enumerate(value):
            yield from places(below, (*path, number))


def replaced(value: Any, path: tuple[Any, ...], new: Any) -> Any:
    if not path:
        return new
    copy = value.copy()
    copy[path[0]] = replaced(value[path[0]], path[1:], new)
    return copy


def flow(value: Any) -> str:
    """Write a value as one line of YAML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(k)}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, str):
        return '"' + "".join(f"\\U{ord(character):08X}" for character in value) + '"'
    return "null" if value is None else str(value).lower()


def test_a_good_spec_on_one_line_is_good(good_data: Any, problems: Problems) -> None:
    assert problems(flow(good_data)) == []


@settings(deadline=None, max_examples=200)
@given(
    edits=st.lists(st.tuples(st.integers(0, 1000), NASTY), min_size=1, max_size=3),
)
def test_a_good_spec_with_changed_values_is_used_or_refused(
    good_data: Any, edits: list[tuple[int, Any]]
) -> None:
    content = good_data
    for number, new in edits:
        paths = list(places(content))
        content = replaced(content, paths[number % len(paths)], new)
    load_or_refuse(flow(content))
