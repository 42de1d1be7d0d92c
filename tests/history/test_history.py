"""The history keeps runs, units and lots, on SQLite and on PostgreSQL."""

from __future__ import annotations

import csv
import json
import multiprocessing
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select, text, update

from conformance.errors import BenchError, SpecError
from conformance.history import asking, schema, series
from conformance.history.command import history
from conformance.history.database import Database
from conformance.history.keeping import enter, keep_lot, place_unit
from conformance.history.lot import Lot
from conformance.report.record import Record, read_record

STATIONS = 4
RUNS_OF_A_STATION = 15


def _write(folder: Path, *failed: str, serial: str = "4711", **more: Any) -> Path:
    """Write a small record, the named items failed, and return its folder."""
    folder.mkdir(parents=True)
    item = {"sentence": "", "level": "manual", "source": "", "service": "sdo", "object": ""}
    items = [
        item
        | {"id": f"x/{name}", "requirement": name, "verdict": verdict, "actual": "a\x00b\ud800"}
        for name in ("A-01", "A-02")
        for verdict in ["fail" if name in failed else "pass"]
    ]
    content = {
        "run": {"started": more.pop("started", "2026-01-01T00:00:00+00:00"), "suite": "0.1.0"},
        "device": {"spec": "x", "node_id": 1, "serial": serial} | more,
        "items": items,
        "summary": {"verdict": "deviates" if failed else "conforms"},
    }
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


def _record(folder: Path, *failed: str, **more: Any) -> Record:
    return read_record(_write(folder, *failed, **more))


def test_a_run_is_entered_once(url: str, tmp_path: Path) -> None:
    record = _record(tmp_path / "a", "A-01")

    with closing(Database(url, create=True)) as database:
        assert enter(database, record) is True
        assert enter(database, record) is False
        with database.reading() as connection:
            (run,) = asking.runs_where(connection, asking.of_serial("4711"))
            assert (run.verdict, run.deviations, run.items) == ("deviates", 1, 2)
            assert asking.deviations_where(connection) == {run.id: ["x/A-01"]}


def test_a_unit_without_a_label_is_known_by_what_it_says(url: str, tmp_path: Path) -> None:
    told = {"1018h:04": "01 02 00 00"}
    with closing(Database(url, create=True)) as database:
        enter(database, _record(tmp_path / "a", serial="", identity=told))
        enter(database, _record(tmp_path / "b", serial="", identity={"1018h:04": "no answer"}))

        with database.reading() as connection:
            found = list(asking.runs_where(connection))
    assert [run.serial for run in found] == ["513", None]


def test_a_lot_is_kept_with_its_units_and_their_last_verdicts(url: str, tmp_path: Path) -> None:
    lot = Lot("L1", part="IMS360", order="4500017", size=3, plan="n 3, Ac 0")
    with closing(Database(url, create=True)) as database:
        keep_lot(database, lot)
        for place, serial in enumerate(("s1", "s2", "s3"), 1):
            place_unit(database, "L1", place, "x", serial)
        place_unit(database, "L1", 3, "x", "s4")
        enter(database, _record(tmp_path / "1", serial="s1"))
        enter(database, _record(tmp_path / "2", "A-01", serial="s2", started="2026-01-02"))
        enter(database, _record(tmp_path / "3", serial="s2", started="2026-01-01"))
        keep_lot(database, replace(lot, verdict="not accepted", decided="2026-01-03"))

        with database.reading() as connection:
            (kept,) = asking.newest_lots(connection)
            units = asking.units_of(connection, kept.id)
            judged = list(asking.runs_where(connection, asking.of_lot(kept.id)))
    assert (kept.order_number, kept.verdict, kept.size) == ("4500017", "not accepted", 3)
    assert [(it.serial, it.runs, it.verdict) for it in units] == [
        ("s1", 1, "conforms"),
        ("s2", 2, "deviates"),
        ("s4", 0, ""),
    ]
    assert len(judged) == 3


def test_no_unit_is_placed_in_an_unknown_lot(url: str) -> None:
    with (
        closing(Database(url, create=True)) as database,
        pytest.raises(SpecError, match="lot 'L9'"),
    ):
        place_unit(database, "L9", 1, "x", "s1")


def test_the_overview_counts_verdicts_and_deviations(url: str, tmp_path: Path) -> None:
    with closing(Database(url, create=True)) as database:
        enter(database, _record(tmp_path / "a", serial="s1"))
        enter(database, _record(tmp_path / "b", "A-01", serial="s1"))
        enter(database, _record(tmp_path / "c", "A-01", "A-02", serial="s2"))
        with database.reading() as connection:
            (row,) = asking.by_device(connection)
            frequent = [tuple(it) for it in asking.most_frequent(connection)]

    assert (row.units, row.runs, row.conforms, row.deviates, row.inconclusive) == (2, 3, 1, 2, 0)
    assert frequent == [("x/A-01", 2), ("x/A-02", 1)]


def _station(url: str, folder: Path, number: int) -> None:
    with closing(Database(url, create=True)) as database:
        for run in range(RUNS_OF_A_STATION):
            name = f"{number}-{run}"
            enter(database, _record(folder / name, "A-01", serial=f"s{run}", started=name))


def test_stations_that_write_at_once_lose_nothing(url: str, tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    stations = [
        context.Process(target=_station, args=(url, tmp_path, number)) for number in range(STATIONS)
    ]
    for station in stations:
        station.start()
    for station in stations:
        station.join(240)

    assert [station.exitcode for station in stations] == [0] * STATIONS
    with closing(Database(url, create=False)) as database, database.reading() as connection:
        (row,) = asking.by_device(connection)
        assert (row.runs, row.units) == (STATIONS * RUNS_OF_A_STATION, RUNS_OF_A_STATION)
        assert len(asking.deviations_where(connection)) == STATIONS * RUNS_OF_A_STATION


def test_a_station_has_the_file_to_itself_before_it_looks(tmp_path: Path) -> None:
    path = tmp_path / "history.sqlite"
    with closing(Database(f"sqlite:///{path}", create=True)) as database:
        with database.writing(), closing(sqlite3.connect(path, timeout=0)) as other:
            assert other.execute("pragma journal_mode").fetchone() == ("wal",)
            with pytest.raises(sqlite3.OperationalError, match="locked"):
                other.execute("begin immediate")
        with database.reading(), closing(sqlite3.connect(path, timeout=0)) as other:
            other.execute("begin immediate")


def test_an_older_history_is_brought_up_to_date(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Database(url, create=True).close()
    now = schema.VERSION
    monkeypatch.setattr(schema, "VERSION", now + 2)
    steps = {
        now: ["alter table runs add column a integer"],
        now + 1: ["alter table runs add column b text"],
    }
    monkeypatch.setattr(schema, "STEPS", steps)

    with closing(Database(url, create=False)) as database, database.reading() as connection:
        connection.execute(text("select a, b from runs"))
        assert connection.execute(select(schema.versions.c.version)).scalar_one() == now + 2


def test_a_newer_history_is_refused(url: str) -> None:
    with closing(Database(url, create=True)) as database, database.writing() as connection:
        connection.execute(update(schema.versions).values(version=9))

    with pytest.raises(SpecError, match="or older, got version 9"):
        Database(url, create=False)


def test_a_series_keeps_its_order_and_each_lot_once(url: str) -> None:
    with closing(Database(url, create=True)) as database:
        for lot in ("a", "b", "c"):
            series.note(database, "x", lot, lot)
        series.note(database, "y", "a", "other")
        series.note(database, "x", "a", "a again")
        series.withdraw(database, "x", "c")
        series.withdraw(database, "x", "d")
        assert series.lots_of(database, "x") == ["a again", "b"]
        assert series.lots_of(database, "y") == ["other"]


def _conclude(url: str, number: int) -> None:
    with closing(Database(url, create=True)) as database:
        for lot in range(RUNS_OF_A_STATION):
            series.note(database, "x", "shared", "{}")
            series.note(database, "x", f"{number}-{lot}", "{}")


def test_stations_that_conclude_lots_at_once_lose_none(url: str) -> None:
    context = multiprocessing.get_context("spawn")
    stations = [context.Process(target=_conclude, args=(url, it)) for it in range(STATIONS)]
    for station in stations:
        station.start()
    for station in stations:
        station.join(240)

    assert [station.exitcode for station in stations] == [0] * STATIONS
    with closing(Database(url, create=False)) as database:
        assert len(series.lots_of(database, "x")) == STATIONS * RUNS_OF_A_STATION + 1


def test_half_a_transaction_leaves_nothing(url: str, tmp_path: Path) -> None:
    record = _record(tmp_path / "a", "A-01")
    with closing(Database(url, create=True)) as database:
        with database.writing() as connection:
            connection.execute(text("drop table deviations"))
        with pytest.raises(BenchError, match="failed"):
            enter(database, record)
        with database.reading() as connection:
            assert list(asking.runs_where(connection)) == []


@pytest.mark.parametrize(
    ("asked", "word"),
    [
        ("oracle://a:secret@b/c", "oracle://a"),
        ("nonsense", "no URL"),
        ("sqlite://", "sqlite:///FILE"),
        ("sqlite:////nowhere/history.sqlite", "no file"),
    ],
)
def test_a_wrong_database_is_told_without_its_password(asked: str, word: str) -> None:
    with pytest.raises(SpecError) as error:
        Database(asked, create=False)

    assert word in str(error.value)
    assert "secret" not in str(error.value)


def test_what_is_no_database_is_told(tmp_path: Path) -> None:
    path = tmp_path / "history.sqlite"
    path.write_text("no database at all, but long enough to be taken for one" * 20)

    with pytest.raises(BenchError, match="not a database"):
        Database(f"sqlite:///{path}", create=False)


def test_the_command_shows_a_unit_over_time_and_exports_it(
    url: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folders = [
        _write(tmp_path / str(day), *failed, serial="=cmd()", started=f"2026-01-0{day}")
        for day, failed in ((1, ["A-01"]), (2, ["A-01"]), (3, []), (4, ["A-01"]))
    ]
    history(["add", *map(str, folders)], database=url)
    history(["add", str(folders[0])], database=url)
    assert "1 were there already" in capsys.readouterr().out

    file = tmp_path / "runs.csv"
    history(["=cmd()"], export=file, database=url)

    assert "x/A-01    1-2, 4" in capsys.readouterr().out
    with file.open(encoding="utf-8", newline="") as text_:
        lines = list(csv.DictReader(text_))
    assert [line["verdict"] for line in lines] == ["deviates", "deviates", "conforms", "deviates"]
    assert lines[0]["serial"] == "'=cmd()"
    assert lines[0]["deviating_items"] == "x/A-01"


def test_the_command_names_what_it_does_not_know(url: str, tmp_path: Path) -> None:
    history(["add", str(_write(tmp_path / "a"))], database=url)

    with pytest.raises(SpecError, match="got '4712'"):
        history(["4712"], database=url)
    with pytest.raises(SpecError, match="got 'L1'"):
        history(lot="L1", database=url)
    with pytest.raises(SpecError, match="got none"):
        history(["add"], database=url)
    with pytest.raises(SpecError, match="got more"):
        history(["4711", "4712"], database=url)
