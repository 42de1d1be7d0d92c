"""Lot files: what is right, and what is said of what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from conformance.errors import SpecError
from conformance.lots.lot_file import load_lot

HEAD = "format: 1\npart: A sensor\norder: order 1\ndevice: siko_ims360\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "lot.yaml"
    path.write_text(HEAD + text, encoding="utf-8")
    return path


def test_a_lot_is_read(tmp_path: Path) -> None:
    lot = load_lot(written(tmp_path, "serials: [7, 9, 12]\naql: 2.5\n"))
    assert lot.content.names == [7, 9, 12]
    assert (lot.content.units, lot.content.level, lot.content.aql) == (3, "II", 2.5)
    assert load_lot(written(tmp_path, "size: 3\nlevel: all\n")).content.names == [1, 2, 3]


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("aql: 1.0\n", 1, "expected serials or size, got neither"),
        ("size: 50\n", 1, "expected an aql beside the level, got none"),
        ("size: 50\naql: 1.1\n", 6, "aql: expected an AQL of the table that counts units: 0.01, "),
        ("size: 50\naql: 15\n", 6, "6.5, 10; got 15"),
        ("size: 50\naql: 1%\n", 6, "aql: expected a number, got '1%'"),
        ("size: 0\naql: 1.0\n", 5, "size: expected at least 1, got 0"),
        (
            "size: 1\naql: 1.0\n",
            1,
            "expected at least 2 units to sample from, or level: all, got 1",
        ),
        ("size: 5\naql: 1.0\nlevel: IV\n", 7, "level: expected "),
        ("size: 5\naql: 1.0\nlevel: all\n", 1, "expected no aql, severity or series"),
        ("serials: [1, 2, 1]\naql: 1.0\n", 1, "expected each serial number once, got 1 again"),
        ("serials: [1, 2]\nsize: 3\naql: 1.0\n", 1, "expected a size of 2, as there are serials"),
        ("serials: [A7, 2]\naql: 1.0\n", 5, "serials.0: expected an integer, got 'A7'"),
        ("size: 5\naql: 1.0\nnode_ids: 10-5\n", 7, "node_ids: expected node-IDs from 1 to 127"),
        ("size: 5\naql: 1.0\nseverity: normal\nseries: a.json\n", 1, "expected severity or series"),
        ("size: 5\naql: 1.0\nsimulation: {faults: {6: [x]}}\n", 1, "expected a unit of the lot"),
        ("size: 5\naql: 1.0\nsevirity: normal\n", 7, "(did you mean 'severity'?)"),
    ],
)
def test_what_is_wrong_is_told_with_file_and_line(
    tmp_path: Path, text: str, line: int, said: str
) -> None:
    path = written(tmp_path, text)
    with pytest.raises(SpecError) as caught:
        load_lot(path)
    problem = str(caught.value)
    assert said in problem
    assert problem.startswith(f"{path}:{line}:") or line == 1


def test_an_empty_file_is_told(tmp_path: Path) -> None:
    path = tmp_path / "lot.yaml"
    path.touch()
    with pytest.raises(SpecError, match="expected a lot, got an empty file"):
        load_lot(path)


def test_paths_are_seen_from_the_lot_file(tmp_path: Path) -> None:
    lot = load_lot(written(tmp_path, "size: 3\nlevel: all\n"))
    assert lot.beside("siko_ims360") == "siko_ims360"
    assert lot.beside("specs/mine.yaml") == str(tmp_path / "specs/mine.yaml")
