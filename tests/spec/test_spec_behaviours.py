"""Rules between objects in a spec: where they hold, and what readings make of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

from conformance.spec.behaviours import SameValue, Slope
from conformance.spec.load import SpecFile

Edited: TypeAlias = Callable[..., str]
Loaded: TypeAlias = Callable[[str], SpecFile]

PLACE = "ambiguities:\n  - id: T-01"
EITHER = "        changes: {objects/0x2000/default: 2}"


def rule(*rules: str) -> tuple[str, str]:
    """Put rules into the good spec, numbered from 1."""
    lines = "".join(f'  x{n}: {{{it}, source: "3"}}  #{n}\n' for n, it in enumerate(rules, 1))
    return PLACE, f"behaviours:\n{lines}{PLACE}"


def test_a_follower_of_one_variant_follows_there_alone(edited: Edited, loaded: Loaded) -> None:
    file = loaded(edited(("name: Hidden, ", "name: Hidden, follows: {two: tilt-y}, ")))
    followed = [file.resolve(variant).entries[0x6013, 0].follows for variant in ("one", "two")]
    assert followed == [None, "tilt-y"]


def test_a_rule_holds_in_the_variants_that_have_all_its_objects(
    edited: Edited, loaded: Loaded
) -> None:
    first = "rule: same-value, objects: [0x2000, 0x2001]"
    second = "rule: same-value, objects: [0x2001, 0x2003]"
    third = "rule: slope, value: 0x6010, offset: 0x2003"
    file = loaded(edited(rule(first, second, third)))
    held = [list(file.resolve(variant).behaviours) for variant in ("one", "two")]
    assert held == [["x1"], ["x1", "x2", "x3"]]
    slope = file.resolve("two").behaviours["x3"]
    assert isinstance(slope, Slope)
    assert (slope.offset, slope.resolution_change, slope.inverts) == (
        0x2003,
        "keeps-numbers",
        "measured",
    )


def test_companions_are_aliases_and_partners(edited: Edited, loaded: Loaded) -> None:
    rules = (
        "rule: same-value, objects: [0x2000, 0x2001]",
        "rule: paired, objects: [0x2001, 0x2003]",
    )
    file = loaded(edited(rule(*rules)))
    one, two = file.resolve("one"), file.resolve("two")
    assert one.companions((0x2001, 0)) == ((0x2001, 0), (0x2000, 0))
    assert two.companions((0x2001, 0)) == ((0x2001, 0), (0x2000, 0), (0x2003, 0))
    assert two.companions((0x2000, 0)) == ((0x2000, 0), (0x2001, 0))
    assert two.companions((0x1017, 0)) == ((0x1017, 0),)


def test_a_reading_may_do_away_with_a_rule(edited: Edited, loaded: Loaded) -> None:
    text = edited(
        rule("rule: same-value, objects: [0x2000, 0x2001]"),
        (EITHER, "        changes: {behaviours/x1/holds: false}"),
    )
    file = loaded(text)
    assert isinstance(file.resolve().behaviours["x1"], SameValue)
    assert file.resolve(readings={"T-01": 2}).behaviours == {}


def services_reading(judged: str) -> list[tuple[str, str]]:
    return [
        (EITHER, "        changes: {services/nmt/automatic_start: true}"),
        ("judged_by: either", f"judged_by: {judged}"),
    ]


def test_the_services_of_an_open_reading_are_at_hand(edited: Edited, loaded: Loaded) -> None:
    file = loaded(edited(*services_reading("either")))
    spec = file.resolve()
    assert not spec.services.nmt.automatic_start
    (judged, none), (other, which) = spec.services_readings
    assert (judged, none) == (spec.services, None)
    assert other.nmt.automatic_start
    assert which is not None
    assert (which.ambiguity, which.reading) == ("T-01", 2)
    asked = file.resolve(readings={"T-01": 2})
    assert asked.services.nmt.automatic_start
    assert asked.other_services == (), "one that was asked for is not open"


@pytest.mark.parametrize("judged", ["1", "2"])
def test_a_judged_reading_has_no_other_services(
    edited: Edited, loaded: Loaded, judged: str
) -> None:
    spec = loaded(edited(*services_reading(judged))).resolve()
    assert spec.services.nmt.automatic_start == (judged == "2")
    assert spec.other_services == ()


def test_a_reading_that_changes_objects_alone_has_no_services_of_its_own(
    good: str, loaded: Loaded
) -> None:
    assert loaded(good).resolve().other_services == ()
