"""A unit is one by its label and by what its node tells, and each number finds it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import text, update

from conformance.history import asking, schema, series
from conformance.history.command import history
from conformance.history.database import Database
from conformance.history.keeping import enter, keep_lot, place_unit
from conformance.history.lot import Lot
from conformance.history.units import written
from conformance.report.record import Record, read_record


def record(folder: Path, label: str, told: str | None = None, device: str = "x") -> Record:
    """Return a record of a unit with a label whose node told a number; each call makes another."""
    number = len(list(folder.glob("*-run")))
    place = folder / f"{number}-run"
    place.mkdir(parents=True)
    known = {"spec": device, "node_id": 1, "serial": label}
    content = {
        "run": {"started": f"2026-01-01T00:00:{number:02}+00:00"},
        "device": known | ({} if told is None else {"serial_told": told}),
        "items": [],
        "summary": {"verdict": "conforms"},
    }
    (place / "results.json").write_text(json.dumps(content), encoding="utf-8")
    return read_record(place)


def runs_of(database: Database, serial: str) -> list[tuple[str, str, str]]:
    """Return unit, label and told number of each run that a serial number finds."""
    with database.reading() as connection:
        found = asking.runs_where(connection, asking.of_serial(serial))
        return [(it.serial, it.label, it.told) for it in found]


def serials(database: Database) -> list[str]:
    with database.reading() as connection:
        return list(connection.execute(text("select serial from units order by serial")).scalars())


@pytest.mark.parametrize(
    ("label", "told", "known"),
    [
        ("40117", "", "40117"),
        ("00040117", "", "40117"),
        (" 40 117 ", "", "40117"),
        ("0x9CB5", "", "40117"),
        ("9CB5", "40117", "40117"),
        ("9cb5h", "40117", "40117"),
        ("9CB5", "40118", "9CB5"),
        ("9CB5", "", "9CB5"),
        ("10", "16", "10"),
        ("S-4711", "4711", "S-4711"),
        ("1" * 5000, "", None),
        ("", "", ""),
    ],
)
def test_the_same_number_is_written_in_one_way(label: str, told: str, known: str | None) -> None:
    assert written(label, told) == (written(label) if known is None else known)


@pytest.mark.parametrize(
    "runs",
    [
        [("40117", "40117"), ("", "40117")],
        [("", "40117"), ("0040117", "40117"), ("0040117", "")],
        [("9CB5", "40117"), ("9CB5", ""), ("", "40117")],
        [("0x9CB5", ""), ("", "40117")],
    ],
)
def test_one_number_written_differently_is_one_unit(
    url: str, tmp_path: Path, runs: Sequence[tuple[str, str]]
) -> None:
    with closing(Database(url, create=True)) as database:
        for label, told in runs:
            enter(database, record(tmp_path, label, told))
        assert serials(database) == ["40117"] or serials(database) == ["9CB5"]
        for name in ("40117", "0040117", runs[0][0] or runs[1][0]):
            assert len(runs_of(database, name)) == len(runs)


@pytest.mark.parametrize("first", ["labelled", "alone", "dead"])
def test_a_label_and_a_told_number_that_differ_are_both_kept(
    url: str, tmp_path: Path, first: str
) -> None:
    runs = {"labelled": ("S-1", "513"), "alone": ("", "513"), "dead": ("S-1", "")}
    order = [runs[first], *(it for it in runs.values() if it != runs[first])]
    with closing(Database(url, create=True)) as database:
        for label, told in order:
            enter(database, record(tmp_path, label, told))
        if first == "dead":  # what is told alone came between, and the label after it
            enter(database, record(tmp_path, "S-1", "513"))
        assert serials(database) == ["S-1"]
        assert runs_of(database, "S-1") == runs_of(database, "513")
        assert {(label, told) for _, label, told in runs_of(database, "513")} == set(order)


def test_units_that_tell_the_same_number_stay_apart_by_their_labels(
    url: str, tmp_path: Path
) -> None:
    with closing(Database(url, create=True)) as database:
        for label in ("S-1", "S-2"):
            enter(database, record(tmp_path, label, "1"))
        enter(database, record(tmp_path, "", "1"))
        enter(database, record(tmp_path, "S-1", "1"))
        enter(database, record(tmp_path, "S-3", "1", device="y"))
        assert serials(database) == ["1", "S-1", "S-2", "S-3"]
        assert [it[0] for it in runs_of(database, "S-2")] == ["S-2"]
        assert len(runs_of(database, "1")) == 5


def test_a_unit_with_that_label_is_not_taken_over(url: str, tmp_path: Path) -> None:
    with closing(Database(url, create=True)) as database:
        enter(database, record(tmp_path, "513", ""))
        enter(database, record(tmp_path, "", "513"))
        enter(database, record(tmp_path, "S-1", "513"))
        assert serials(database) == ["513", "S-1"]


def test_the_number_zero_tells_no_unit(url: str, tmp_path: Path) -> None:
    with closing(Database(url, create=True)) as database:
        enter(database, record(tmp_path, "", "0"))
        enter(database, record(tmp_path, "S-1", "0"))
        assert serials(database) == ["S-1"]


def test_a_place_goes_with_its_unit(url: str, tmp_path: Path) -> None:
    with closing(Database(url, create=True)) as database:
        keep_lot(database, Lot("L1"))
        enter(database, record(tmp_path, "", "513"))
        place_unit(database, "L1", 1, "x", "", "513")
        enter(database, record(tmp_path, "S-1", "513"))
        place_unit(database, "L1", 2, "x", "S-2")
        place_unit(database, "L1", 3, "x", "", "513")
        with database.reading() as connection:
            lot = asking.lot_named(connection, "L1")
            assert lot is not None
            units = asking.units_of(connection, lot.id)
    assert [(it.place, it.serial, it.runs) for it in units] == [
        (1, "S-1", 2),
        (2, "S-2", 0),
        (3, "S-1", 2),
    ]


def test_a_history_of_the_first_version_goes_on(url: str, tmp_path: Path) -> None:
    with closing(Database(url, create=True)) as database:
        enter(database, record(tmp_path, "0040117"))
        with database.writing() as connection:
            connection.execute(update(schema.units).values(serial="0040117"))
            for name in ("runs_by_label", "runs_by_told"):
                connection.execute(text(f"drop index {name}"))
            for name in ("label", "told"):
                connection.execute(text(f"alter table runs drop column {name}"))
            connection.execute(text("drop table concluded"))
            connection.execute(update(schema.versions).values(version=1))

    with closing(Database(url, create=False)) as database:
        assert runs_of(database, "0040117") == [("0040117", "", "")]
        series.note(database, "ims360", "lot 1", "{}")
        assert series.lots_of(database, "ims360") == ["{}"]
        enter(database, record(tmp_path, "0040117", "40117"))
        enter(database, record(tmp_path, "", "40117"))
        assert serials(database) == ["0040117"]
        assert len(runs_of(database, "40117")) == 3


def test_the_command_says_by_which_numbers_a_unit_goes(
    url: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with closing(Database(url, create=True)) as database:
        enter(database, record(tmp_path, "S-1", "513"))
        enter(database, record(tmp_path, "", "513"))
    history(["513"], database=url)
    said = capsys.readouterr().out
    assert "x S-1, whose node tells 513" in said
    assert said.count("conforms") == 2
