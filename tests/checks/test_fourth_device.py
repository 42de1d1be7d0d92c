"""A device unlike any built-in one, in YAML alone, is judged as it is: nothing in Python knows it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.spec.load import load_spec

SPEC = Path(__file__).with_name("fourth_device.yaml")
VARIANTS = load_spec(SPEC).variants

DEFECTS = {
    "values": [
        ("kind: config, default: -5", "kind: config, default: -6", {"OD-10/2010h:01"}),
        ('default: "0.1"', 'default: "0.2"', {"OD-10/2010h:02"}),
        ("default: 8192", "default: 8191", {"OD-09/6501h"}),
        ("FileName=rota", "FileName=ROTA", {"OD-09/1021h"}),
        ("    min_ms: 100\n", "    min_ms: 200\n", {"OD-11/1017h"}),
        ("ranges: [[1, 99]]", "ranges: [[1, 98]]", {"OD-11/2000h"}),
        ("[[1, 0x1000000000]]", "[[0, 0x1000000000]]", {"OD-13/2010h:06"}),
        ("        5: [[2, 4096]]", "        5: [[2, 8192]]", {"OD-13/6001h"}),
        ("{0: 1 Mbit/s,", "{0: 1 Mbit/s, 1: 800 kbit/s,", {"OD-13/2001h"}),
    ],
    "entries": [
        ("Gain, type: REAL32, access: rw", "Gain, type: REAL32, access: ro", {"OD-04/2010h:02"}),
        ("type: UNSIGNED40, access: rw", "type: UNSIGNED40, access: wo", {"OD-02/2010h:06"}),
        ("Hours, type: UNSIGNED64", "Hours, type: UNSIGNED56", {"OD-03/2010h:03"}),
        (
            "Zero, type: INTEGER24",
            "Zero, type: INTEGER32",
            {"OD-03/2010h:01", "SDO-20/2010h:01"},
        ),
        ("0x6501: {name: Single", "0x6503: {name: Single", {"OD-01/6501h"}),
        ("kind: constant, reserved: true", "kind: constant", {"OD-15/2010h:0C"}),
        ('"1", mappable: true', '"1", mappable: false', {"TPDO-06/2010h:04", "TPDO-33/1A00h"}),
        ("[[1, 100], [255, 255]]\n", "[[1, 2], [255, 255]]\n", {"OD-11/1800h:02"}),
    ],
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_it_conforms(variant: str, judge: Callable[..., Any]) -> None:
    finished = judge("--variant", variant, device=SPEC)

    assert finished.items("fail") == finished.items("inconclusive") == []
    assert finished.code == 0
    judged = {"TPDO-02", "TPDO-03", "TPDO-05", "HB-01", "SDO-06", "NID-01"}
    assert judged <= finished.requirements("pass")


def test_it_may_follow_a_reading_that_is_open_and_not_one_that_is_not(
    judge: Callable[..., Any],
) -> None:
    readings = ("--reading", "ROTA-01=2", "--reading", "ROTA-02=2")

    finished = judge(*readings, "--select", "HB or OD", device=SPEC)

    assert finished.items("fail") == ["OD-13/1017h", "HB-15/1017h/1ms", "HB-15/1017h/99ms"]
    (item,) = (it for it in finished.record["items"] if it["id"].endswith("OD-09/6502h"))
    assert item["readings"] == {"ROTA-01": 2}


@pytest.mark.parametrize("where", DEFECTS)
def test_a_wrong_copy_fails_in_its_defects(
    where: str, judge: Callable[..., Any], tmp_path: Path
) -> None:
    text, expected = SPEC.read_text(encoding="utf-8"), set()
    for old, new, failing in DEFECTS[where]:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
        expected |= failing
    copy = tmp_path / "copy.yaml"
    copy.write_text(text, encoding="utf-8")

    finished = judge("--variant", "basic", "--simulate-spec", copy, device=SPEC)

    assert set(finished.items("fail")) == expected
    assert finished.code == 1


def test_lint_and_the_catalogue_take_it_with_its_statements(command: Callable[..., Any]) -> None:
    linted = command("spec", "lint", SPEC)
    assert linted.code == 0, linted.err
    assert "good (10 statements)" in linted.out

    page = command("catalogue", SPEC, "--variant", "basic")
    assert page.code == 0, page.err
    assert "HB-04" in page.out
    assert "S-009" not in page.out


def test_it_goes_to_an_eds_and_comes_back(
    command: Callable[..., Any], judge: Callable[..., Any], tmp_path: Path
) -> None:
    eds, again = tmp_path / "rota.eds", tmp_path / "again.yaml"

    assert command("spec", "to-eds", SPEC, "--output", eds).code == 0
    assert command("spec", "diff", SPEC, eds).code == 0
    assert command("spec", "from-eds", eds, "--output", again).code == 0

    assert judge("--select", "OD-09 or OD-10 or TPDO", device=again).code == 0
