"""A unit that no run decides is declared nonconforming by a person, and is shown as that."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pypdf
import pytest

from conformance.errors import SpecError
from conformance.lots.declaring import asked_for, declare
from conformance.lots.inspection import Inspection, Sampling, Try, Unit, Word
from conformance.lots.page import declarations
from conformance.lots.statistics import statistics_of
from conformance.lots.verdict import decide

NOW = datetime(2026, 1, 31, 10, tzinfo=UTC)
WORDS: dict[str, Word] = {"c": "conforming", "n": "nonconforming", "u": "undecided"}
LOT = """format: 1
part: Inclinometer
order: order 17
device: siko_ims360
serials: [7, 8, 9]
level: all
select: OD-09
simulation: {faults: {8: [silent]}}
"""


def inspection(*units: str, accept: int = 0) -> Inspection:
    """Return an inspection: a unit of each word, `d` for a declaration between its runs."""
    plan = Sampling(sample=len(units), accept=accept, size=100, words="")
    made = Inspection(lot={}, sha256="", plan=plan, seed=0, units=[])
    for number, word in enumerate(units, 1):
        unit = Unit(unit=number)
        made.units.append(unit)
        for it in word:
            if it == "d":
                declare(made, number, "A. Tester", "dead", NOW)
            else:
                unit.tries.append(Try(folder="", verdict=WORDS[it], node_id=1))
    return made


@pytest.mark.parametrize(
    ("word", "verdict", "declared"),
    [
        ("d", "nonconforming", True),
        ("uud", "nonconforming", True),
        ("cud", "nonconforming", True),
        ("udu", "nonconforming", True),
        ("udc", "conforming", False),
        ("udn", "nonconforming", False),
        ("udcu", "undecided", False),
        ("udcud", "nonconforming", True),
    ],
)
def test_a_declaration_counts_until_a_run_decides(
    word: str, verdict: str, *, declared: bool
) -> None:
    (unit,) = inspection(word).units
    assert unit.verdict == verdict
    assert (unit.declared_so is not None) == declared
    assert ("not measured" in declarations(unit)[-1]) == declared


@pytest.mark.parametrize("word", ["c", "uc", "n", "ud"])
def test_a_decided_unit_is_not_declared(word: str) -> None:
    made = inspection(word)
    with pytest.raises(SpecError, match="expected a unit that no run has decided, got 1"):
        declare(made, 1, "A. Tester", "dead", NOW)
    with pytest.raises(SpecError, match="expected a unit that was drawn, got 2"):
        declare(made, 2, "A. Tester", "dead", NOW)


def test_it_counts_against_the_lot_and_not_among_the_measured() -> None:
    made = inspection("c", "n", "uud", "d")
    verdict, numbers = decide(made), statistics_of(made, None)
    assert (verdict.word, verdict.nonconforming, verdict.declared) == ("not accepted", 3, 2)
    assert "(2 declared so by a person, not measured)" in verdict.reason
    assert (numbers.judged, numbers.declared) == (2, 2)
    assert decide(inspection("c", "ud", accept=1)).word == "accepted"


@pytest.mark.parametrize(
    ("unit", "by", "reason", "alone", "said"),
    [
        (1, "", "dead", True, "expected --reason TEXT and --by NAME"),
        (1, "A. Tester", " ", True, "expected --reason TEXT and --by NAME"),
        (None, "A. Tester", "", True, "expected --nonconforming UNIT"),
        (1, "A. Tester", "dead", False, "without --retest and --dry-run"),
    ],
)
def test_who_declares_says_who_and_why(
    unit: int | None, by: str, reason: str, *, alone: bool, said: str
) -> None:
    with pytest.raises(SpecError, match=said):
        asked_for(unit, by, reason, alone=alone)


def test_a_dead_unit_is_declared_and_shown_as_declared(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    lot, folder = tmp_path / "lot.yaml", tmp_path / "record"
    lot.write_text(LOT, encoding="utf-8")
    call = ("inspect", lot, "--report-dir", folder)
    assert command(*call).code == 2

    word = ("--nonconforming", "8", "--by", "A. <Tester>", "--reason", "no current")
    done = command(*call, *word)
    assert done.code == 1, done.out + done.err
    said = "declared nonconforming by A. <Tester>, "
    assert said in done.out
    assert "declared nonconforming by a person, not measured: 1" in done.out
    unit = json.loads((folder / "lot.json").read_text("ascii"))["units"][1]
    assert [it["verdict"] for it in unit["tries"]] == ["undecided"] * 2
    assert [(it["by"], it["reason"]) for it in unit["declared"]] == [("A. <Tester>", "no current")]
    assert said.replace("<", "&lt;").replace(">", "&gt;") in (folder / "lot.html").read_text(
        "utf-8"
    )

    again = command(*call)
    assert again.code == 1
    assert "8  undecided" not in again.out, "it is not judged again"

    assert command("certificate", folder).code == 0
    text = pypdf.PdfReader(folder / "certificate.pdf").pages[0].extract_text()
    text = " ".join(text.split())
    assert "3 units: 2 conform, 0 deviate, 0 are undecided, 1 declared nonconforming" in text
    assert "Lot not accepted: 1 of 3 units nonconforming (1 declared so by a person" in text
    assert "Serial 8: declared nonconforming by A. <Tester>" in text


def test_a_damaged_inspection_is_not_certified(command: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "lot.json").write_text('{"format": 1}', encoding="ascii")
    done = command("certificate", tmp_path)
    assert done.code == 3
    assert "expected the state of an inspection with its verdict, got what is none" in done.err


def test_a_unit_declared_before_it_was_judged_is_not_asked_for(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    lot, folder = tmp_path / "lot.yaml", tmp_path / "record"
    lot.write_text(LOT, encoding="utf-8")
    call = ("inspect", lot, "--report-dir", folder)
    first = command(*call, "--nonconforming", "8", "--by", "A. Tester", "--reason", "no current")
    assert first.code == 1
    assert "0 judged: 0 conform, 0 deviate, 0 undecided" in first.out
    assert command(*call).code == 1
    units = json.loads((folder / "lot.json").read_text("ascii"))["units"]
    assert [len(it["tries"]) for it in units] == [1, 0, 1]
