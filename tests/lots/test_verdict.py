"""What becomes of a lot, by what became of its units."""

from __future__ import annotations

import pytest

from conformance.lots.inspection import Inspection, Sampling, Try, Unit, Word, draw
from conformance.lots.verdict import decide

WORDS: dict[str, Word] = {"c": "conforming", "n": "nonconforming", "u": "undecided"}


def unit(number: int, tries: str) -> Unit:
    made = [Try(folder="", verdict=WORDS[it], node_id=1) for it in tries]
    return Unit(unit=number, tries=made)


def inspection(units: str, accept: int) -> Inspection:
    """Return an inspection: a word of tries per unit, `-` for one not judged."""
    made = [unit(nth, "" if it == "-" else it) for nth, it in enumerate(units.split())]
    plan = Sampling(sample=len(made), accept=accept, size=100, words="")
    return Inspection(lot={}, sha256="", plan=plan, seed=0, units=made)


@pytest.mark.parametrize(
    ("units", "accept", "word", "exit_code"),
    [
        ("c c c", 0, "accepted", 0),
        ("c n c", 0, "not accepted", 1),
        ("c n c", 1, "accepted", 0),
        ("n n c", 1, "not accepted", 1),
        ("n - -", 0, "not accepted", 1),  # what is still to come changes nothing
        ("c c -", 0, "not decided", 2),
        ("c c -", 2, "not decided", 2),  # the sample is not whole
        ("c u c", 0, "not decided", 2),  # never taken for a conforming one
        ("c u c", 1, "accepted", 0),  # accepted even if it deviates
        ("n u c", 1, "not decided", 2),
        ("uc c c", 0, "accepted", 0),  # made good by a run that could decide
        ("nc c c", 0, "not accepted", 1),  # a deviation once seen stays
        ("cu c c", 0, "not decided", 2),
    ],
)
def test_the_verdict_follows_from_the_units(
    units: str, accept: int, word: str, exit_code: int
) -> None:
    verdict = decide(inspection(units, accept))
    assert (verdict.word, verdict.exit_code) == (word, exit_code)
    assert str(accept) in verdict.reason or str(accept + 1) in verdict.reason or "-" in units


def test_the_words_say_why() -> None:
    assert decide(inspection("c u c", 1)).reason == (
        "0 of 3 units nonconforming and 1 undecided: not more than Ac 1 even if those deviate"
    )


def test_both_results_of_a_retest_are_kept() -> None:
    again = unit(1, "uc")
    assert [it.verdict for it in again.tries] == ["undecided", "conforming"]
    assert again.verdict == "conforming"
    assert again.telling is again.tries[1]
    assert unit(1, "nc").telling is not None
    assert unit(1, "").verdict is None


def test_a_drawing_is_repeatable_and_in_order() -> None:
    names = list(range(100, 200))
    drawn = draw(names, 13, 7)
    assert drawn == draw(names, 13, 7) == sorted(set(drawn))
    assert len(drawn) == 13
    assert drawn != draw(names, 13, 8)
    assert draw(names, 100, 7) == names
