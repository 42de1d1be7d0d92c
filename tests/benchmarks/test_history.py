"""How long it takes to ask a history of 100,000 runs, beside asking for one unit on SQLite."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import postgres_server
import pytest
from sqlalchemy import Connection, insert, text

from conformance.history import asking, pages
from conformance.history.database import Database
from conformance.history.keeping import enter
from conformance.history.schema import deviations, lots, places, runs, units
from conformance.report.record import read_record

MANY, FEW = 100_000, 1_000
RUNS_OF_A_UNIT = 4
UNITS_OF_A_LOT = 50
ENTERED = 20
ROUNDS = 5


@pytest.fixture
def databases(tmp_path: Path) -> Iterator[dict[str, Database]]:
    if not postgres_server.is_installed():
        pytest.skip(postgres_server.MISSING)
    with (
        postgres_server.running() as server,
        closing(Database(f"sqlite:///{tmp_path / 'history.sqlite'}", create=True)) as file,
        closing(Database(postgres_server.new_database(server), create=True)) as site,
    ):
        yield {"SQLite": file, "PostgreSQL": site}


def _fill(database: Database, count: int) -> None:
    """Enter runs of four per unit, every tenth with three deviations, in lots of fifty units."""
    with database.writing() as connection:
        unit_ids = range(1, count // RUNS_OF_A_UNIT + 1)
        lot_ids = range(1, len(unit_ids) // UNITS_OF_A_LOT + 1)
        connection.execute(
            insert(units), [{"id": n, "device": f"d{n % 3}", "serial": f"s{n}"} for n in unit_ids]
        )
        lot = {"part": "p", "order_number": "o", "size": UNITS_OF_A_LOT, "plan": "", "verdict": ""}
        connection.execute(
            insert(lots), [lot | {"id": n, "name": f"L{n}", "decided": ""} for n in lot_ids]
        )
        connection.execute(
            insert(places),
            [
                {"lot_id": (n - 1) // UNITS_OF_A_LOT + 1, "place": n, "unit_id": n}
                for n in range(1, len(lot_ids) * UNITS_OF_A_LOT + 1)
            ],
        )
        connection.execute(insert(runs), [_run(n, len(unit_ids)) for n in range(1, count + 1)])
        connection.execute(
            insert(deviations),
            [
                {"run_id": n, "item": f"d/HB-{(n + k) % 40:02}/1017h", "quantity": "period"}
                | {"expected": "100 ms", "actual": "110 ms", "unit": "ms"}
                for n in range(10, count + 1, 10)
                for k in range(3)
            ],
        )
        if connection.dialect.name == "postgresql":
            for table in ("units", "runs"):  # it counts only what it numbers itself
                connection.execute(
                    text("select setval(pg_get_serial_sequence(:table, 'id'), :count)"),
                    {"table": table, "count": count},
                )
            connection.execute(text("analyze"))  # as a server does by itself after a while


def _run(number: int, of_units: int) -> dict[str, str | int | bool]:
    unit = number % of_units + 1
    failed = number % 10 == 0
    return {
        **dict.fromkeys(("variant", "selected", "suite", "firmware", "bench"), "x"),
        "id": number,
        "sha256": f"{number:064x}",
        "unit_id": unit,
        "device": f"d{unit % 3}",
        "started": f"2026-01-01T{number:06}",
        "verdict": "deviates" if failed else "conforms",
        "complete": True,
        "items": 2000,
        "deviations": 3 if failed else 0,
        "spec_sha256": "0" * 64,
        "simulated": False,
        "path": f"/records/{number}/results.json",
    }


def _export(connection: Connection, path: Path) -> None:
    pages.write_csv(path, asking.runs_where(connection), asking.deviations_where(connection))


def _asked(path: Path) -> dict[str, Callable[[Connection], object]]:
    one = asking.of_serial("s77")
    return {
        "one unit": lambda it: (list(asking.runs_where(it, one)), asking.deviations_where(it, one)),
        "a lot of 50": lambda it: asking.units_of(it, 7),
        "all devices": asking.by_device,
        "most frequent deviations": asking.most_frequent,
        "newest lots": asking.newest_lots,
        "CSV of all": lambda it: _export(it, path),
    }


def _record(folder: Path, number: int) -> Path:
    path = folder / f"{number}.json"
    content = {
        "run": {"started": f"2027-{number}"},
        "device": {"spec": "x", "node_id": 1, "serial": "s77"},
        "items": [],
        "summary": {"verdict": "inconclusive"},
    }
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def test_asking_a_long_history(
    databases: dict[str, Database],
    tmp_path: Path,
    tell: Callable[[str], None],
    request: pytest.FixtureRequest,
) -> None:
    count = MANY if request.config.getoption("benchmark_enable") else FEW
    unit_s = 0.0
    for name, database in databases.items():
        _fill(database, count)
        with database.reading() as connection:
            assert sum(row.runs for row in asking.by_device(connection)) == count
            for question, ask in _asked(tmp_path / "runs.csv").items():
                took_s = [_timed(ask, connection) for _ in range(ROUNDS)]
                median_s = statistics.median(took_s)
                unit_s = unit_s or median_s
                tell(f"{count} runs, {name}: {question}: {median_s / unit_s:.1f}")
        records = [read_record(_record(tmp_path, n)) for n in range(ENTERED)]
        began = time.perf_counter()
        assert all(enter(database, record) for record in records)
        each_s = (time.perf_counter() - began) / ENTERED
        tell(f"{count} runs, {name}: entering one: {each_s / unit_s:.1f}")
    tell(f"1.0 is {unit_s * 1000:.2f} ms")


def _timed(ask: Callable[[Connection], object], connection: Connection) -> float:
    began = time.perf_counter()
    ask(connection)
    return time.perf_counter() - began
