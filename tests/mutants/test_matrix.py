"""What becomes of the outcomes: fates, whose defect an item names, and the totals."""

from __future__ import annotations

from conformance.mutants.defect import Defect
from conformance.mutants.matrix import Matrix, names, row
from conformance.mutants.trial import Outcome

OWN = Defect("1017h/default=10", "", (), "default", "objects", (0x1017, 0), seen_by=("OD-",))
FILE = Defect("heartbeat-slow", "", (), "fault file", "faults", seen_by=("HB-01", "HB-07"))


def test_an_item_names_the_defect_by_requirement_and_object() -> None:
    assert names(OWN, "x/OD-10/1017h")
    assert names(OWN, "x/OD-10/1017h/reset")
    assert not names(OWN, "x/OD-10/1018h:01")
    assert not names(OWN, "x/HB-01/1017h/10ms")
    assert names(FILE, "x/HB-07/1017h/2000ms")
    assert not names(FILE, "x/HB-02/1017h")


def test_the_fate_of_a_defect() -> None:
    assert row(Outcome(OWN, ("x/OD-10/1017h",)), "").fate == "killed"
    assert row(Outcome(OWN, ()), "").fate == "survived"
    assert row(Outcome(OWN, (), {"x/OD-10/1017h": "no answer"}), "").fate == "open"
    assert row(Outcome(OWN, (), aborted="gone"), "").fate == "open"
    assert row(Outcome(OWN, ()), "no bus shows it").fate == "equivalent"


def test_what_is_called_equivalent_and_seen_is_told() -> None:
    assert row(Outcome(OWN, ("x/OD-10/1017h",)), "no bus shows it").wrongly_equivalent


def test_the_totals() -> None:
    rows = (
        row(Outcome(OWN, ("x/OD-10/1017h", "x/RST-01/1018h:01")), ""),
        row(Outcome(FILE, ("x/HB-02/1017h", "x/HB-01/1017h")), ""),
        row(Outcome(FILE, ()), ""),
    )
    matrix = Matrix(rows, {"OD-10": 3, "HB-01": 1, "HB-02": 1, "RST-01": 2, "LSS-01": 1})

    assert matrix.summary == {
        "defects": 3,
        "killed": 2,
        "survived": 1,
        "open": 0,
        "equivalent": 0,
        "wrongly_equivalent": 0,
        "first_right": 1,
        "accused_wrongly": 1,
        "unrelated_items": 2,
        "requirements": 5,
        "requirements_without_kill": ["LSS-01"],
    }
    assert matrix.kills == {"OD-10": 1, "RST-01": 1, "HB-01": 1, "HB-02": 1}
    assert matrix.first == {"OD-10": 1, "HB-02": 1}
    assert matrix.accused == {"RST-01": 1, "HB-02": 1}
