"""The file of concluded lots, and what it makes of the next one."""

from __future__ import annotations

from pathlib import Path

import pytest

from conformance.errors import SpecError
from conformance.lots.inspection import Inspection, Sampling
from conformance.lots.kept_series import SeriesFile
from conformance.lots.lot_file import Lot, load_lot
from conformance.lots.series import concluded, scheme_for
from conformance.lots.verdict import LotVerdict, LotWord


def lot(folder: Path, order: str, more: str = "") -> Lot:
    path = folder / "lot.yaml"
    path.write_text(
        f"format: 1\npart: A sensor\norder: {order}\ndevice: siko_ims360\nsize: 50\naql: 1.0\n{more}",
        encoding="utf-8",
    )
    return load_lot(path)


def note(path: Path, which: Lot, word: LotWord, bad: int = 0) -> None:
    plan = Sampling(sample=13, accept=0, size=50, words="", severity="normal")
    made = Inspection(lot={}, sha256="", plan=plan, seed=0, units=[])
    SeriesFile(path).note(which, concluded(which, made, LotVerdict(word, "", 13 - bad, bad, 0, 0)))


def test_lots_are_noted_in_order_and_each_once(tmp_path: Path) -> None:
    path = tmp_path / "series.json"
    for order in ("a", "b", "c"):
        note(path, lot(tmp_path, order), "accepted")
    note(path, lot(tmp_path, "b"), "not accepted", 2)
    found = [(it.lot, it.accepted) for it in SeriesFile(path).load(lot(tmp_path, "d"))]
    assert found == [("a", True), ("b", False), ("c", True)]


def test_what_was_noted_of_a_lot_is_taken_back(tmp_path: Path) -> None:
    path = tmp_path / "series.json"
    note(path, lot(tmp_path, "a"), "accepted")
    SeriesFile(path).note(lot(tmp_path, "a"), None)
    assert SeriesFile(path).load(lot(tmp_path, "b")) == []


def test_lots_that_are_inspected_otherwise_are_another_series(tmp_path: Path) -> None:
    path = tmp_path / "series.json"
    note(path, lot(tmp_path, "a"), "accepted")
    with pytest.raises(
        SpecError, match="expected lots of A sensor, level III, AQL 1, got A sensor"
    ):
        SeriesFile(path).load(lot(tmp_path, "b", "level: III\n"))


def test_a_damaged_series_is_told(tmp_path: Path) -> None:
    path = tmp_path / "series.json"
    path.write_text("{}", encoding="ascii")
    with pytest.raises(SpecError, match="expected a series of lots, got what is none"):
        SeriesFile(path).load(lot(tmp_path, "a"))


def test_sampling_that_is_discontinued_goes_on_once_the_supplier_has_acted(tmp_path: Path) -> None:
    path = tmp_path / "series.json"
    for nth in range(7):
        note(path, lot(tmp_path, f"lot {nth}"), "not accepted", 3)
    following = lot(tmp_path, "lot 7")
    with pytest.raises(SpecError, match="sampling is discontinued, for 5 lots were not accepted"):
        scheme_for(following, SeriesFile(path).load(following))
    resumed = lot(tmp_path, "lot 7", "resumed: true\n")
    assert scheme_for(resumed, SeriesFile(path).load(resumed)).severity == "tightened"


def test_reduced_inspection_needs_leave(tmp_path: Path) -> None:
    path = tmp_path / "series.json"
    for nth in range(15):
        note(path, lot(tmp_path, f"lot {nth}", "reduced: true\n"), "accepted")
    allowed = lot(tmp_path, "next", "reduced: true\n")
    assert scheme_for(allowed, SeriesFile(path).load(allowed)).severity == "reduced"
    plain = lot(tmp_path, "next")
    assert scheme_for(plain, SeriesFile(path).load(plain)).severity == "normal"
