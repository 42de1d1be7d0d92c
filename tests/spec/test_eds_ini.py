"""The INI reader: every line kept with its number, whatever the file looks like."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.errors import SpecError
from conformance.spec.eds.ini import IniFile, read_ini


def read(folder: Path, content: bytes | str) -> IniFile:
    path = folder / "a.eds"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_ini(path)


def warnings(file: IniFile) -> list[str]:
    return [str(problem).partition("a.eds:")[2] for problem in file.problems]


def test_sections_and_keys_are_found_whatever_their_case(tmp_path: Path) -> None:
    file = read(tmp_path, "\ufeff[deviceINFO]\r\nVENDORname = A = B ; c \r\nEmpty=\r\n")

    section = file.section("DeviceInfo")
    assert section is not None
    line = section.get("VendorName")
    assert line is not None
    assert (line.number, line.key, line.value) == (2, "VENDORname", "A = B ; c")
    assert section.get("Empty") is None
    assert section.first("Empty") is not None
    assert warnings(file) == []


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_are_counted_with_each_line_end(end: str, tmp_path: Path) -> None:
    file = read(tmp_path, end.join(["; head", "", "[1000]", "A=1", "A=2", "\x1a"]))

    assert warnings(file) == ["5: 1000.A: expected each key once, got it again (line 4 counts)"]
    section = file.section("1000")
    assert section is not None
    assert [str(line) for line in section.lines] == ["A=1", "A=2"]
    assert [str(line) for line in file.sections[0].lines] == ["; head"]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[A]\nstray\n", "2: A: expected key=value, got 'stray'"),
        ("[A]\n=5\n", "2: A: expected key=value, got '=5'"),
        ("[A\nB=1\n", "1: A: expected ] after the name of a section, got '[A'"),
        ("[A] B=1\n", "1: A: expected nothing after ], got 'B=1'"),
        ("[A]\n[B]\n[a]\n", "3: a: expected each section once, got it again (line 1 counts)"),
        (b"[A]\nB=\x94\n", "2: expected ASCII or UTF-8, got byte 94h (read as Windows-1252)"),
    ],
)
def test_what_is_untidy_is_told_with_its_line(
    text: str | bytes, sentence: str, tmp_path: Path
) -> None:
    assert warnings(read(tmp_path, text)) == [sentence]


@pytest.mark.parametrize(
    ("text", "value"), [("ü".encode(), "ü"), (b"\xfc", "ü"), (b"\x94", "”"), (b"\x81", "\x81")]
)
def test_bytes_are_read_as_utf8_windows_or_latin1(text: bytes, value: str, tmp_path: Path) -> None:
    section = read(tmp_path, b"[A]\nB=" + text).section("A")

    assert section is not None
    assert section.lines[0].value == value


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"\n<?xml version='1.0'?>\n", "a.eds:2: expected a section such as [DeviceInfo], got"),
        (b"", "a.eds:1: expected a section such as [DeviceInfo], got ''"),
        (b"[A]\nB=\0\n", "a.eds:2: expected text, got the byte 00h"),
        (b"[A]\n" + b";" * 4_000_000, "a.eds: expected at most 4 MB, got more"),
    ],
)
def test_what_is_no_ini_file_is_refused_with_the_line(
    content: bytes, sentence: str, tmp_path: Path
) -> None:
    with pytest.raises(SpecError) as caught:
        read(tmp_path, content)

    assert sentence in str(caught.value)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="expected a readable file, got: No such file"):
        read_ini(tmp_path / "none.eds")


@given(content=st.binary(max_size=200).map(lambda noise: b"[1000]\n" + noise.replace(b"\0", b"0")))
def test_every_line_with_text_is_kept(
    content: bytes, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = read(tmp_path_factory.getbasetemp(), content)

    kept = {section.line for section in file.sections}
    kept |= {line.number for section in file.sections for line in section.lines}
    lines = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    written = {n for n, line in enumerate(lines, 1) if line.strip(b" \t\x1a").isalnum()}
    assert written <= kept
