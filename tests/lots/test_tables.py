"""The tables of ISO 2859-1 against a second reading, published examples and their own regularity."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import get_args

import pytest

from conformance.lots.plans import plan_of
from conformance.lots.tables import Level, Severity, tables

LETTERS = "ABCDEFGHJKLMNPQR"

COLUMNS = {
    ("normal", 0.025): "N500/0*14 R2000/1*2",
    ("normal", 0.65): "F20/0*7 J80/1*2 K125/2 L200/3 M315/5 N500/7 P800/10 Q1250/14 R2000/21",
    (
        "normal",
        1.0,
    ): "E13/0*6 H50/1*2 J80/2 K125/3 L200/5 M315/7 N500/10 P800/14 Q1250/21*2",
    (
        "normal",
        2.5,
    ): "C5/0*4 F20/1*2 G32/2 H50/3 J80/5 K125/7 L200/10 M315/14 N500/21*4",
    ("normal", 6.5): "A2/0*2 D8/1*2 E13/2 F20/3 G32/5 H50/7 J80/10 K125/14 L200/21*6",
    ("normal", 10): "C5/1*3 D8/2 E13/3 F20/5 G32/7 H50/10 J80/14 K125/21*7",
    ("normal", 250): "A2/10 B3/14 C5/21 D8/30 E13/44*12",
    ("normal", 1000): "A2/30 B3/44*15",
    ("tightened", 0.015): "Q1250/0*16",
    ("tightened", 0.025): "P800/0*14 S3150/1*2",
    (
        "tightened",
        1.0,
    ): "F20/0*6 J80/1*3 K125/2 L200/3 M315/5 N500/8 P800/12 Q1250/18*2",
    ("tightened", 10): "A2/0 D8/1*3 E13/2 F20/3 G32/5 H50/8 J80/12 K125/18*7",
    ("tightened", 1000): "A2/27 B3/41*15",
    ("reduced", 0.025): "N200/0*16",
    ("reduced", 0.040): "M125/0*13 R800/1*3",
    (
        "reduced",
        1.0,
    ): "E5/0*6 J32/1*3 K50/2 L80/3 M125/5 N200/6 P315/8 Q500/10*2",
    ("reduced", 6.5): "A2/0*2 E5/1*3 F8/2 G13/3 H20/5 J32/6 K50/8 L80/10*6",
    ("reduced", 650): "A2/21 B2/21 C2/21*14",
    ("reduced", 1000): "A2/30 B2/30*15",
}
"""Read from another print of the tables, arrows followed: letter, size and Ac of what A to R lead to."""


def plans(text: str) -> list[str]:
    found = (part.partition("*") for part in text.split())
    return [plan for plan, _, times in found for _ in range(int(times or 1))]


BOUNDS = {
    "S-1": "A50 B500 C35000 D",
    "S-2": "A25 B150 C1200 D35000 E",
    "S-3": "A15 B50 C150 D500 E3200 F35000 G500000 H",
    "S-4": "A15 B25 C90 D150 E500 F1200 G10000 H35000 J500000 K",
    "I": "A15 B25 C90 D150 E280 F500 G1200 H3200 J10000 K35000 L150000 M500000 N",
    "II": "A8 B15 C25 D50 E90 F150 G280 H500 J1200 K3200 L10000 M35000 N150000 P500000 Q",
    "III": "B8 C15 D25 E50 F90 G150 H280 J500 K1200 L3200 M10000 N35000 P150000 Q500000 R",
}
"""Read from another print: the code letters of a level, each with the largest lot it is for."""


@pytest.mark.parametrize("level", BOUNDS)
def test_code_letters_agree_with_a_second_reading(level: Level) -> None:
    least = 2
    for part in BOUNDS[level].split():
        most = int(part[1:] or 10**9)
        assert tables().letter(least, level) == part[0]
        assert tables().letter(most, level) == part[0]
        least = most + 1


def accepted(mean: float, accept: int) -> float:
    """Return the chance of a lot, by Poisson, with so many nonconforming units in the sample on average."""
    return math.fsum(
        math.exp(-mean) * mean**count / math.factorial(count) for count in range(accept + 1)
    )


@pytest.mark.parametrize(("severity", "aql"), COLUMNS)
def test_columns_agree_with_a_second_reading(severity: Severity, aql: float) -> None:
    master = tables().masters[severity]
    column = tables().aqls.index(aql)
    found = [master.plan(letter, column) for letter in LETTERS]
    assert [f"{it}{master.sizes[it]}/{ac}" for it, ac in found] == plans(COLUMNS[severity, aql])


@pytest.mark.parametrize(
    ("size", "level", "aql", "severity", "sample", "accept"),
    [
        (2400, "II", 2.5, "normal", 125, 7),  # published by makers of calculators
        (2000, "II", 1.0, "normal", 125, 3),
        (500, "II", 2.5, "normal", 50, 3),  # MIL-STD-105E has the same
        (500, "III", 1.5, "tightened", 80, 2),
        (1000, "I", 4.0, "normal", 32, 3),
        (8, "II", 0.65, "normal", 8, 0),  # 20 would be more than there are
        (35_001, "S-4", 6.5, "reduced", 32, 6),
        (500_001, "III", 0.025, "tightened", 3150, 1),
    ],
)
def test_published_examples(
    size: int, level: Level, aql: float, severity: Severity, sample: int, accept: int
) -> None:
    plan = plan_of(size, level, aql, severity)
    assert (plan.sample, plan.accept, plan.reject) == (sample, accept, accept + 1)
    assert plan.whole == (sample == size)


def test_a_sample_as_great_as_the_lot_is_100_percent_inspection() -> None:
    assert "100 % inspection" in plan_of(13, "II", 1.0, "normal").words
    assert "100 % inspection" not in plan_of(14, "II", 1.0, "normal").words
    assert not plan_of(14, "II", 1.0, "normal").whole


def test_the_acceptance_number_with_a_tighter_aql_is_that_of_the_same_sample() -> None:
    assert plan_of(2000, "II", 1.0, "normal").accept_tighter == 2
    assert plan_of(500_000, "III", 1.0, "normal").accept_tighter == 14
    assert plan_of(100, "II", 0.65, "normal").accept_tighter is None
    assert plan_of(100, "II", 0.01, "normal").accept_tighter is None


def test_letters_grow_with_the_lot_and_from_level_to_level() -> None:
    order = "ABCDEFGHJKLMNPQR"
    rows = [[order.index(row[level]) for level in get_args(Level)] for _, row in tables().letters]
    assert len(rows) == 15
    for row in rows:
        assert row == sorted(row)
    for smaller, greater in pairwise(rows):
        assert all(a <= b for a, b in zip(smaller, greater, strict=True))
    assert tables().letter(8, "III") == "B"
    assert tables().letter(9, "III") == "C"
    assert tables().letter(10**6, "II") == "Q"


@pytest.mark.parametrize("severity", get_args(Severity))
def test_tables_are_whole_and_grow_with_the_aql(severity: Severity) -> None:
    known = tables()
    master = known.masters[severity]
    assert "".join(master.rows).rstrip("S") == LETTERS
    assert list(known.aqls) == sorted(known.aqls)
    for letter in LETTERS:
        assert len(master.rows[letter]) == len(known.aqls) == 26
        own = [it for column in range(26) if (it := master.accepted_at(letter, column)) is not None]
        assert len(own) >= 7
        assert own == sorted(set(own)), letter
        led = [master.plan(letter, column)[1] for column in range(26)]
        assert led == sorted(led), letter


@pytest.mark.parametrize("severity", ["normal", "tightened"])
def test_a_letter_further_goes_with_an_aql_tighter(severity: Severity) -> None:
    rows = tables().masters[severity].rows
    pairs = [
        (upper[column + 1], lower[column])
        for upper, lower in pairwise(rows[letter] for letter in LETTERS)
        for column in range(25)
        if upper[column + 1].isdecimal() and lower[column].isdecimal()
    ]
    assert len(pairs) > 100
    assert all(upper == lower for upper, lower in pairs)


def test_lots_as_good_as_the_aql_are_mostly_accepted() -> None:
    known = tables()
    master = known.masters["normal"]
    for letter in LETTERS:
        for column, aql in enumerate(known.aqls):
            accept = master.accepted_at(letter, column)
            if accept is None or aql > 10:
                continue
            mean = master.sizes[letter] * aql / 100
            assert 0.87 < accepted(mean, accept) < 0.999, (letter, aql)


def test_where_all_are_inspected_the_words_say_why() -> None:
    assert plan_of(5, "II", 1.0, "normal").words == (
        "level II, AQL 1, normal inspection: code letter A, table 2-A, whose arrow leads to E: "
        "13 units, Ac 0, Re 1; the lot has 5: 100 % inspection"
    )
