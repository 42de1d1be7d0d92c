"""The switching rules of ISO 2859-1 over series of lots."""

from __future__ import annotations

from conformance.lots.switching import Concluded, Scheme, follow
from conformance.lots.tables import Severity


def lots(text: str, *, reduced: bool = False, accept: int = 0) -> list[Concluded]:
    """Return lots: a letter each, `a` accepted, `n` not accepted, `t` accepted, but not with a tighter AQL."""
    counts = {"a": 0, "t": accept, "n": accept + 1}
    return [
        Concluded(
            lot=f"{nth}",
            severity="normal",
            accepted=letter != "n",
            count=counts[letter],
            accept=accept,
            accept_tighter=accept - 1 if accept else None,
            reduced=reduced,
        )
        for nth, letter in enumerate(text)
    ]


def severity(text: str, *, reduced: bool = False) -> Severity:
    return follow(lots(text, reduced=reduced)).severity


def test_two_of_five_lots_not_accepted_lead_to_tightened_inspection() -> None:
    assert severity("n") == "normal"
    assert severity("nn") == "tightened"
    assert severity("naaan") == "tightened"
    assert severity("naaaan") == "normal"
    assert follow(lots("anan")).why == "2 of 4 consecutive lots were not accepted"


def test_five_lots_accepted_lead_back_to_normal_inspection() -> None:
    assert severity("nnaaaa") == "tightened"
    assert severity("nnaaaaa") == "normal"
    assert severity("nnaanaaa") == "tightened"
    assert severity("nnaanaaaaa") == "normal"
    assert severity("nnaaaaan") == "normal", "what was before tightened inspection is past"


def test_five_lots_not_accepted_under_tightened_inspection_end_it() -> None:
    assert not follow(lots("nnnannan")).discontinued
    ended = follow(lots("nnnannann"))
    assert ended.discontinued
    assert ended.why == "5 lots were not accepted under tightened inspection"
    ended.resume()
    assert (ended.severity, ended.discontinued) == ("tightened", False)


def test_lots_after_the_supplier_acted_are_counted_anew() -> None:
    before = lots("nnnannann")
    after = [it.model_copy(update={"resumed": True}) for it in lots("annnn")]
    assert not follow([*before, *after]).discontinued
    assert follow([*before, *after, *lots("n")]).discontinued


def test_the_score_grows_by_two_with_small_acceptance_numbers() -> None:
    assert follow(lots("aaa")).score == 6
    assert follow(lots("aana")).score == 2
    assert follow(lots("ta", accept=1)).score == 4


def test_the_score_grows_by_three_where_a_tighter_aql_would_have_accepted_the_lot() -> None:
    assert follow(lots("aa", accept=3)).score == 6
    assert follow(lots("ata", accept=3)).score == 3


def test_a_score_of_thirty_leads_to_reduced_inspection_where_it_is_allowed() -> None:
    assert severity("a" * 14, reduced=True) == "normal"
    assert severity("a" * 15, reduced=True) == "reduced"
    assert severity("a" * 20) == "normal"
    assert follow(lots("a" * 10, reduced=True, accept=2)).severity == "reduced"


def test_one_lot_not_accepted_ends_reduced_inspection() -> None:
    scheme = follow(lots("a" * 15 + "n", reduced=True))
    assert (scheme.severity, scheme.score) == ("normal", 0)
    assert severity("a" * 18, reduced=True) == "reduced"


def test_reduced_inspection_ends_when_it_is_not_allowed_any_more() -> None:
    scheme = follow(lots("a" * 15, reduced=True))
    scheme.forbid_reduced()
    assert scheme.severity == "normal"


def test_inspection_begins_as_normal() -> None:
    assert Scheme().severity == "normal"
