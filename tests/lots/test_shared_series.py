"""A series of lots that several stations share by the history."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.errors import SpecError
from conformance.history.acting import Entering
from conformance.lots.kept_series import SharedSeries
from conformance.lots.lot_file import Lot, load_lot
from conformance.lots.series import scheme_for
from conformance.lots.switching import Concluded

LOT = """format: 1
part: Inclinometer
order: order {order}
device: siko_ims360
seed: 1
size: 20
aql: 10
level: S-1
series: inclinometers
select: OD-09
"""


def station(folder: Path, order: int, more: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / f"lot-{order}.yaml"
    path.write_text(LOT.format(order=order) + more, encoding="utf-8")
    return path


def read(folder: Path, order: int, more: str = "") -> Lot:
    return load_lot(station(folder, order, more))


def refused(lot: str) -> Concluded:
    return Concluded(lot=lot, severity="normal", accepted=False, count=3, accept=0)


def test_two_stations_go_by_one_series(command: Callable[..., Any], tmp_path: Path) -> None:
    history = ("--history", "--database", f"sqlite:///{tmp_path / 'history.db'}")
    bad = ", ".join(f"{unit}: [wrong-identity]" for unit in range(1, 21))
    for order, desk in ((1, "left"), (2, "right")):
        lot = station(tmp_path / desk, order, f"simulation: {{faults: {{{bad}}}}}\n")
        call = ("inspect", lot, "--report-dir", tmp_path / desk / str(order), *history)
        done = command(*call)
        assert done.code == 1, done.out + done.err
        assert "normal inspection" in done.out
        assert command(*call).code == 1, "and concluded once more, it counts once"

    third = station(tmp_path / "left", 3)
    done = command("inspect", third, "--dry-run", *history)
    assert done.code == 0, done.out + done.err
    assert "tightened inspection" in done.out
    assert [it.name for it in (tmp_path / "left").iterdir() if it.suffix == ".json"] == []

    alone = command("inspect", third)
    assert alone.code == 3
    assert "expected --history, which keeps the series 'inclinometers', got none" in alone.err


def test_a_dry_run_makes_no_history(command: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "history.db"
    call = ("--dry-run", "--history", "--database", f"sqlite:///{path}")
    assert command("inspect", station(tmp_path, 1), *call).code == 3
    assert not path.exists()


def test_a_lot_that_is_not_decided_any_more_is_taken_back(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    url = f"sqlite:///{tmp_path / 'history.db'}"
    folder = tmp_path / "record"
    call = ("inspect", station(tmp_path, 1), "--report-dir", folder, "--history", "--database", url)
    assert command(*call).code == 0
    kept = json.loads((folder / "lot.json").read_text("ascii"))
    for tried in (tried for unit in kept["units"] for tried in unit["tries"]):
        tried["verdict"] = "undecided"
    (folder / "lot.json").write_text(json.dumps(kept), encoding="ascii")
    assert len(Entering(url).series("inclinometers")) == 1
    assert command(*call).code == 2
    assert Entering(url).series("inclinometers") == []


def test_an_inspection_that_never_was_decided_takes_nothing_back(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    url = f"sqlite:///{tmp_path / 'history.db'}"
    faults = ", ".join(f"{unit}: [silent]" for unit in range(1, 21))
    lot = station(tmp_path, 1, f"simulation: {{faults: {{{faults}}}}}\n")
    kept = SharedSeries(Entering(url), "inclinometers")
    kept.note(load_lot(lot), refused("order 1"))
    call = ("inspect", lot, "--report-dir", tmp_path / "record", "--history", "--database", url)
    assert command(*call).code == 2
    assert [it.lot for it in kept.load(load_lot(lot))] == ["order 1"]


def test_what_is_no_concluded_lot_is_told(tmp_path: Path) -> None:
    history = Entering(f"sqlite:///{tmp_path / 'history.db'}")
    history.conclude("inclinometers", "order 1", "{}")
    with pytest.raises(SpecError, match="series inclinometers: expected a concluded lot"):
        SharedSeries(history, "inclinometers").load(read(tmp_path, 2))


def test_lots_that_are_inspected_otherwise_are_another_series(tmp_path: Path) -> None:
    kept = SharedSeries(Entering(f"sqlite:///{tmp_path / 'history.db'}"), "inclinometers")
    kept.note(read(tmp_path, 1), refused("order 1"))
    kept.note(read(tmp_path, 2), refused("order 2"))
    assert scheme_for(read(tmp_path, 3), kept.load(read(tmp_path, 3))).severity == "tightened"
    text = LOT.format(order=3).replace("aql: 10", "aql: 4.0")
    (tmp_path / "other.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(SpecError, match="expected lots of Inclinometer, level S-1, AQL 4, got"):
        kept.load(load_lot(tmp_path / "other.yaml"))
