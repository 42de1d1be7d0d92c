"""The matrix of requirements, statements and checks, and what it refuses."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import pytest

from conformance.catalogue import STATUSES, build, find_requirement_problems
from conformance.report.catalogue_page import to_markdown
from conformance.resources import data, names
from conformance.spec.load import SpecFile, load_spec
from conformance.spec.model import address
from conformance.spec.statements import StatementsFile, load_statements, statements_of

Write: TypeAlias = Callable[..., SpecFile]
SPECS = data("device_specs")
WITH_STATEMENTS = [n for n in names("device_specs") if statements_of(SPECS / f"{n}.yaml").exists()]
STATEMENTS = """\
format: 1
device: sensor
statements:
  - id: S-001
    source: "2"
    says: The heartbeat time is in 1017h.
    encoded: [objects/0x1017, services/heartbeat_producer]
    verified_by: [HB-01, OD-11]
  - {id: S-002, source: "2", says: A fall of power resets., needs: power}
  - {id: S-003, source: "2", says: "It shows tilt | slope.", needs: stimulus}
  - {id: S-004, source: "2", says: The lamp is green., needs: operator}
  - {id: S-005, source: "2", says: It is made of steel., because: a bus carries no metal}
  - {id: S-006, source: "2", says: It sends EMCY., open: nobody asks}
  - {id: S-007, source: "2", says: It has a Y axis., variants: [two-axis], open: nobody asks}
"""


EMCY = "says: It sends EMCY., verified_by: [EMCY-03]"
STEEL = '  - {id: S-001, source: "2", says: It is of steel., because: a bus carries no metal}\n'


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a copy of a built-in spec, with statements beside it if there are any."""

    def do(statements: str | None, *edits: tuple[str, str]) -> SpecFile:
        path = tmp_path / "sensor.yaml"
        path.write_bytes((SPECS / "siko_ims360.yaml").read_bytes())
        for old, new in edits:
            assert statements is not None
            assert statements.count(old) == 1
            statements = statements.replace(old, new)
        if statements is not None:
            statements_of(path).write_text(statements, encoding="utf-8")
        return load_spec(path)

    return do


def matrix(spec: SpecFile, variant: str | None = None) -> dict[str, Any]:
    return build(spec, variant, load_statements(spec))


def test_the_matrix_leads_from_requirements_to_statements_and_back(write: Write) -> None:
    made = matrix(write(STATEMENTS))

    requirements = {r["id"]: r for r in made["requirements"]}
    statements = {s["id"]: s for s in made["statements"]}
    assert requirements["HB-01"]["statements"] == ["S-001"]
    assert requirements["HB-02"]["statements"] == []
    assert statements["S-001"]["requirements"] == ["HB-01", "OD-11"]
    assert statements["S-001"]["checks"][0] == requirements["HB-01"]["check"]
    assert [s["status"] for s in made["statements"]] == [*STATUSES, "open"]
    assert [s["reason"] for s in made["statements"]][-3:] == [
        "a bus carries no metal",
        "nobody asks",
        "nobody asks",
    ]
    assert "HB-01" not in made["requirements_without_statement"]
    assert "HB-02" in made["requirements_without_statement"]
    assert made["statements_without_requirement"] == [f"S-00{n}" for n in range(2, 8)]
    assert "1017h" not in made["unstated"]
    assert "services/heartbeat_producer/min_ms" not in made["unstated"]
    assert "1000h" in made["unstated"]
    assert "services/emcy_producer/codes" in made["unstated"]
    assert "behaviours/restart" in made["unstated"]


def test_a_statement_on_another_variant_is_left_out(write: Write) -> None:
    spec = write(STATEMENTS)
    assert matrix(spec)["totals"]["statements"] == 7
    assert matrix(spec, "one-axis")["totals"]["statements"] == 6
    assert matrix(spec, "two-axis")["totals"]["statements"] == 7
    assert matrix(spec, "two-axis")["totals"]["statements_by_status"]["open"] == 2


def test_a_statement_is_verified_where_one_variant_shows_it(write: Write) -> None:
    spec = write(STATEMENTS, ("says: It sends EMCY., open: nobody asks", EMCY))

    for variant, variants, status, shown_in, reason in (
        (None, ["one-axis", "two-axis"], "verified", ["two-axis"], None),
        ("one-axis", ["one-axis"], "open", [], "no item on this variant"),
        ("two-axis", ["two-axis"], "verified", ["two-axis"], None),
    ):
        made = matrix(spec, variant)
        statement = next(s for s in made["statements"] if s["id"] == "S-006")
        assert (made["variant"], made["variants"]) == (variant, variants)
        assert (statement["status"], statement["shown_in"]) == (status, shown_in)
        assert statement["reason"] == reason
        assert statement["requirements"] == ["EMCY-03"]
    page = to_markdown(matrix(spec))
    assert re.search(
        r"^\| S-006 \| 2 \| It sends EMCY. \| EMCY-03: .* \| two-axis \|$", page, re.MULTILINE
    )
    assert re.search(r"^\| S-001 .* \| all \|$", page, re.MULTILINE)


def test_a_verified_statement_may_say_what_its_check_needs(write: Write) -> None:
    both = "needs: stimulus, verified_by: [TPDO-05]"
    made = matrix(write(STATEMENTS, ("needs: stimulus", both)))

    statement = next(s for s in made["statements"] if s["id"] == "S-003")
    assert (statement["status"], statement["needs"]) == ("verified", "stimulus")
    assert made["totals"]["statements_by_status"]["stimulus"] == 0


def test_the_share_of_what_can_be_shown_is_told(write: Write) -> None:
    made = matrix(write(STATEMENTS))

    assert (made["totals"]["showable"], made["totals"]["verified_percent"]) == (6, 16.7)
    sentence = "can show 6 statements; 1 of them are verified (16.7 %)."
    assert sentence in to_markdown(made)
    nothing = matrix(write("format: 1\ndevice: sensor\nstatements:\n" + STEEL))
    assert (nothing["totals"]["showable"], nothing["totals"]["verified_percent"]) == (0, None)
    assert "can show" not in to_markdown(nothing)


def test_without_statements_the_catalogue_says_so(write: Write) -> None:
    made = matrix(write(None))

    assert made["statements_file"] is None
    assert (made["statements"], made["unstated"]) == ([], [])
    assert made["totals"]["statements"] == 0
    page = to_markdown(made)
    assert "There are none: no statements file stands beside the spec." in page
    assert "no statement points to" not in page


def test_the_page_is_a_table_whatever_a_statement_says(write: Write) -> None:
    page = to_markdown(matrix(write(STATEMENTS)))

    assert "| S-003 | 2 | It shows tilt \\| slope. | would need a stimulus | - |" in page
    assert (
        "| S-005 | 2 | It is made of steel. | not visible on a bus | a bus carries no metal |"
        in page
    )
    assert "HB-01: `test_heartbeat:test_heartbeat_keeps_its_period`<br>OD-11: `" in page
    widths: dict[str, set[int]] = {}
    for line in page.splitlines():
        if line.startswith("#"):
            heading = line
        if line.startswith("|"):
            widths.setdefault(heading, set()).add(len(re.findall(r"(?<!\\)\|", line)))
    assert widths
    assert all(len(found) == 1 for found in widths.values()), widths


def number(page: str, words: str) -> int:
    (found,) = re.findall(rf"^\| {words} \| (\d+) \|$", page, re.MULTILINE)
    return int(found)


def check_totals(made: dict[str, Any]) -> None:
    """Assert that the totals are those of the lists, as data and on the page."""
    totals, page = made["totals"], to_markdown(made)
    by_status = totals["statements_by_status"]
    assert number(page, "all") == totals["statements"] == len(made["statements"])
    assert sum(by_status.values()) == totals["statements"]
    assert number(page, "verified on a bus") == by_status["verified"]
    assert number(page, "would need switched power") == by_status["power"]
    assert number(page, "would need a stimulus") == by_status["stimulus"]
    assert number(page, "would need an operator") == by_status["operator"]
    assert number(page, "not visible on a bus") == by_status["not_visible"]
    assert number(page, "visible, not asked for yet") == by_status["open"]
    assert totals["showable"] == totals["statements"] - by_status["not_visible"]
    assert totals["verified_percent"] == round(100 * by_status["verified"] / totals["showable"], 1)
    for status, count in by_status.items():
        assert count == len([s for s in made["statements"] if s["status"] == status])
    unverified = totals["statements"] - by_status["verified"]
    assert len(made["statements_without_requirement"]) == unverified
    rows = re.findall(r"^\| (S-\d+) \|", page, re.MULTILINE)
    assert sorted(rows) == [s["id"] for s in made["statements"]]


def test_the_totals_agree(write: Write) -> None:
    check_totals(matrix(write(STATEMENTS)))


@pytest.mark.parametrize("name", WITH_STATEMENTS)
def test_the_totals_of_the_house_agree(name: str) -> None:
    spec = load_spec(SPECS / f"{name}.yaml")
    for variant in (None, *spec.variants):
        check_totals(matrix(spec, variant))


@pytest.mark.parametrize("name", WITH_STATEMENTS)
def test_requirements_named_by_statements_of_the_house_apply(name: str) -> None:
    spec = load_spec(SPECS / f"{name}.yaml")
    statements = load_statements(spec)
    assert statements is not None
    assert [str(problem) for problem in find_requirement_problems(spec, statements)] == []


def entries_of(paths: list[str]) -> set[str]:
    """Return the addresses that some paths of a spec point into, ``1017h`` or ``1018h:01``."""
    found = set()
    for path in paths:
        match path.split("/"):
            case ["objects", index, "subs", sub, *_]:
                found.add(address(int(index, 0), int(sub, 0)))
            case ["objects", index, *_]:
                found.add(address(int(index, 0)))
    return found


def overlap(one: str, other: str) -> bool:
    """Tell whether two addresses are the same or one is the object of the other."""
    return one == other or one == other.partition(":")[0] or other == one.partition(":")[0]


def unfounded(spec: SpecFile, statements: StatementsFile) -> list[str]:
    """Return statements on objects that name a requirement without an item on any of them."""
    found = []
    for variant in spec.variants:
        for r in build(spec, variant, statements)["requirements"]:
            judged = {item.split("/")[2] for item in r["items"]}
            found += [
                f"{s.id} names {r['id']}, which has no item on {', '.join(sorted(wanted))}"
                for s in statements.statements
                if s.id in r["statements"]
                and (wanted := entries_of(s.encoded))
                and not any(overlap(a, b) for a in wanted for b in judged)
            ]
    return sorted(set(found))


@pytest.mark.parametrize("name", WITH_STATEMENTS)
def test_a_statement_on_an_object_names_no_rule_that_skips_the_object(name: str) -> None:
    spec = load_spec(SPECS / f"{name}.yaml")
    statements = load_statements(spec)
    assert statements is not None
    assert [text for text in unfounded(spec, statements) if " names OD-" in text] == []


def test_a_statement_that_names_a_rule_without_its_object_is_found(write: Write) -> None:
    spec = write(STATEMENTS, ("OD-11", "OD-07"))
    statements = load_statements(spec)
    assert statements is not None
    assert unfounded(spec, statements)[-1] == "S-001 names OD-07, which has no item on 1017h"


def test_a_requirement_nobody_knows_is_told_at_its_line(
    write: Write, command: Callable[..., Any]
) -> None:
    path = write(STATEMENTS, ("OD-11", "OD-99")).yaml.path

    for arguments in (("catalogue", path), ("spec", "lint", path)):
        finished = command(*arguments)
        assert finished.code == 3
        sentence = "statements.0.verified_by.1: expected the id of a requirement, got 'OD-99'"
        assert f"sensor.statements.yaml:8: {sentence}" in finished.err


def test_a_requirement_without_an_item_is_told_at_its_line(
    write: Write, command: Callable[..., Any]
) -> None:
    path = write(STATEMENTS).yaml.path
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("access: wo", "access: rw"), encoding="utf-8")
    beside = statements_of(path)
    beside.write_text(STATEMENTS.replace("OD-11", "OD-07"), encoding="utf-8")

    finished = command("catalogue", path)

    assert finished.code == 3
    wanted = "expected a requirement with items on one-axis or two-axis, got OD-07"
    assert f"sensor.statements.yaml:8: statements.0.verified_by.1: {wanted}" in finished.err


def test_lint_takes_a_spec_or_its_statements(write: Write, command: Callable[..., Any]) -> None:
    spec = write(STATEMENTS).yaml.path
    beside = statements_of(spec)

    for arguments in ((spec,), (beside,), (spec, beside), (beside, spec)):
        finished = command("spec", "lint", *arguments)
        assert finished.code == 0
        assert finished.out.count("sensor.statements.yaml: good (7 statements)") == 1
        assert finished.out.count("sensor.yaml: good (") == 1

    beside.write_text(STATEMENTS.replace("needs: power", "needs: luck"), encoding="utf-8")
    for path in (spec, beside):
        finished = command("spec", "lint", path)
        assert finished.code == 3
        assert "sensor.statements.yaml:9: statements.1.needs: expected 'power'" in finished.err


def test_lint_misses_the_file_it_was_given(write: Write, command: Callable[..., Any]) -> None:
    spec = write(None).yaml.path
    assert "statements" not in command("spec", "lint", spec).out
    for given in (statements_of(spec), spec.with_name("none.statements.yaml")):
        finished = command("spec", "lint", given)
        assert finished.code == 3
        assert "expected a readable file" in finished.err
