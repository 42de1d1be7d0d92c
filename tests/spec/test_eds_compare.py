"""A manual against an EDS: what counts as a difference, and what is only noted."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from conformance.spec.eds.compare import Row, compare
from conformance.spec.eds.reader import read_eds
from conformance.spec.eds.writer import to_eds
from conformance.spec.load import load_spec

Told = tuple[str, str, str, str]


def rows(folder: Path, spec_text: str, *edits: tuple[str, str]) -> list[Row]:
    """Compare a spec with its own EDS after some replacements, each of the first hit."""
    path = folder / "spec.yaml"
    path.write_text(spec_text, encoding="utf-8")
    file = load_spec(path)
    text = to_eds(file, None, None, "spec.eds", datetime.now(UTC)).replace("\r\n", "\n")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    eds = folder / "spec.eds"
    eds.write_text(text, encoding="utf-8")
    return compare(file.resolve(), read_eds(eds))


def told(found: list[Row]) -> list[Told]:
    return [(row.object, row.attribute, row.manual, row.eds) for row in found if row.differs]


FILTER = "ParameterName=Filter\nObjectType=0x7\nDataType=0x0005\nAccessType=rw\nDefaultValue=1\n"


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (
            (FILTER, FILTER.replace("0x0005", "0x0006")),
            [("2000h", "type", "UNSIGNED8", "UNSIGNED16")],
        ),
        ((FILTER, FILTER.replace("rw", "ro")), [("2000h", "access", "rw", "ro")]),
        (
            (FILTER, FILTER.replace("DefaultValue=1", "DefaultValue=0")),
            [("2000h", "default", "1 or 2", "0")],
        ),
        ((FILTER, FILTER.replace("DefaultValue=1", "DefaultValue=2")), []),
        ((FILTER, FILTER.replace("DefaultValue=1", "DefaultValue=")), []),
        ((FILTER, FILTER.replace("Filter", "Low-pass")), []),
        ((FILTER + "LowLimit=0\nHighLimit=2", FILTER + "LowLimit=0\nHighLimit=5"),
         [("2000h", "limits", "0 to 2", "0 to 5")]),
        ((FILTER + "LowLimit=0\nHighLimit=2", FILTER + "HighLimit=2"), []),
        ((FILTER + "LowLimit=0\nHighLimit=2", FILTER + "HighLimit=3"),
         [("2000h", "limits", "0 to 2", "at most 3")]),
        (("[6012]", "[6014]"),
         [("6012h", "existence", "documented as Tilt X text", "not listed"),
          ("6014h", "existence", "not documented", "listed as Tilt X text")]),
        (("$NODEID+0x80", "0x8A"), []),
        (("$NODEID+0x80", "0x8B"), [("1014h", "default", "138 (8Ah)", "139 (8Bh)")]),
    ],
)  # fmt: skip
def test_a_row_differs_when_both_say_something_else(
    edit: tuple[str, str], expected: list[Told], good: str, tmp_path: Path
) -> None:
    assert told(rows(tmp_path, good, edit)) == expected


def test_mappable_is_compared_where_both_give_it(good: str, tmp_path: Path) -> None:
    found = rows(tmp_path, good, ("PDOMapping=1", "PDOMapping=0"))

    assert told(found) == [("6010h", "mappable", "yes", "no")]


def test_names_and_one_sided_figures_are_notes_with_section_and_line(
    good: str, tmp_path: Path
) -> None:
    found = rows(
        tmp_path,
        good,
        (FILTER, FILTER.replace("Filter", "Low-pass").replace("Value=1", "Value=")),
    )

    notes = {(r.object, r.attribute): r for r in found if not r.differs}
    name, default = notes["2000h", "name"], notes["2000h", "default"]
    assert (name.manual, name.section, name.eds) == ("Filter", "3", "Low-pass")
    assert (default.manual, default.eds) == ("1 or 2", "")
    lines = (tmp_path / "spec.eds").read_text("utf-8").split("\n")
    assert lines[name.line - 1] == "ParameterName=Low-pass"


def test_what_a_manual_reserves_an_eds_must_not_list(good: str, tmp_path: Path) -> None:
    reserved = good.replace("name: Tilt X text,", "name: Tilt X text, reserved: true,")

    assert told(rows(tmp_path, reserved)) == []
    again = ("[1000]", "[6012]\nParameterName=X\nDataType=9\nAccessType=ro\n[1000]")
    assert told(rows(tmp_path, reserved, again)) == [("6012h", "existence", "reserved", "listed")]
