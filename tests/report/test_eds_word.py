"""Which of manual, EDS and device stands alone, requirement by requirement."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from conformance.report.eds_word import AGAINST_DEVICE, AGAINST_MANUAL, ALL_DIFFER, EdsWord
from conformance.report.junit import explain
from conformance.report.results import Item
from conformance.spec.eds.reader import read_eds
from conformance.spec.load import load_spec

SPEC = """\
format: 1
device: {vendor: Nobody, name: Thing}
manual: {title: Thing manual}
factory: {node_id: 10, bitrate: 125000, source: "1"}
variants: {one: {title: One, source: "1"}}
services: {nmt: {source: "1"}}
objects:
  0x1014: {name: EMCY, type: UNSIGNED32, access: rw, kind: config, default: "0x80 + NODEID", source: "1"}
  0x2000: {name: A, type: UNSIGNED8, access: rw, kind: config, default: 1, ranges: [[0, 9]], source: "1"}
  0x2001: {name: B, type: VISIBLE_STRING, access: ro, kind: identity, default: x, source: "1"}
  0x2002: {name: C, type: UNSIGNED8, access: ro, kind: live, source: "1"}
"""
EDS = """\
[1014]
ParameterName=EMCY
DataType=7
AccessType=rw
DefaultValue=$NODEID+0x80
[2000]
ParameterName=A
DataType=6
AccessType=ro
DefaultValue=2
LowLimit=0
HighLimit=20
[2001]
ParameterName=B
DataType=9
AccessType=wo
DefaultValue=y
"""


def word(
    folder: Path, requirement: str, place: str, actual: str = "", quantity: str = ""
) -> dict[str, str]:
    spec, eds = folder / "spec.yaml", folder / "thing.eds"
    spec.write_text(SPEC, encoding="utf-8")
    eds.write_text(EDS, encoding="utf-8")
    witness = EdsWord(read_eds(eds), load_spec(spec).resolve())
    return witness.on(item(requirement, place, actual, quantity))


def item(requirement: str, place: str, actual: str = "", quantity: str = "") -> Item:
    return Item(
        id=f"thing/{requirement}/{place}",
        requirement=requirement,
        sentence="",
        level="manual",
        source="",
        service="",
        object=place,
        verdict="fail",
        actual=actual,
        quantity=quantity,
    )


@pytest.mark.parametrize(
    ("requirement", "place", "actual", "quantity", "stands"),
    [
        ("OD-01", "2000h", "", "", AGAINST_DEVICE),
        ("OD-01", "2002h", "", "", AGAINST_MANUAL),
        ("OD-15", "2000h", "", "", AGAINST_MANUAL),
        ("OD-16", "2000h", "", "upload of 2000h:01", AGAINST_DEVICE),
        ("OD-02", "2001h", "", "", AGAINST_MANUAL),
        ("OD-02", "2000h", "", "", AGAINST_DEVICE),
        ("OD-04", "2000h", "", "", AGAINST_MANUAL),
        ("OD-04", "1014h", "", "", AGAINST_DEVICE),
        ("OD-05", "2001h", "", "", AGAINST_MANUAL),
        ("OD-05", "2000h", "", "", AGAINST_DEVICE),
        ("OD-03", "2000h", "2 octets (00 00)", "", AGAINST_MANUAL),
        ("OD-03", "2000h", "4 octets (00 00 00 00)", "", ALL_DIFFER),
        ("OD-03", "1014h", "2 octets (00 00)", "", AGAINST_DEVICE),
        ("OD-09", "2001h", "'y'", "", AGAINST_MANUAL),
        ("OD-09", "2001h", "'z'", "", ALL_DIFFER),
        ("OD-10", "2000h", "2 (02h)", "", AGAINST_MANUAL),
        ("OD-10", "2000h", "3 (03h)", "", ALL_DIFFER),
        ("OD-10", "1014h", "139 (0000008Bh)", "", AGAINST_DEVICE),
        ("OD-11", "2000h", "abort", "download of 9 to 2000h", AGAINST_DEVICE),
        ("OD-13", "2000h", "confirmed", "download of 10 to 2000h", AGAINST_MANUAL),
        ("OD-13", "2000h", "confirmed", "download of 255 to 2000h", AGAINST_DEVICE),
        ("OD-13", "1014h", "confirmed", "download of 5 to 1014h", ""),
        ("OD-10", "2002h", "3 (03h)", "", ""),
        ("OD-06", "2000h", "0602 0000h", "", ""),
    ],
)
def test_who_stands_alone(
    requirement: str, place: str, actual: str, quantity: str, stands: str, tmp_path: Path
) -> None:
    assert word(tmp_path, requirement, place, actual, quantity)["stands"] == stands


def test_what_the_eds_says_comes_with_its_line(tmp_path: Path) -> None:
    said = word(tmp_path, "OD-10", "2000h")["says"]

    assert said == ("type UNSIGNED16, access ro, default 2, limits 0 to 20 (thing.eds, line 6)")
    assert word(tmp_path, "OD-10", "2002h")["says"] == "thing.eds does not list 2002h"


def test_a_deviation_about_no_object_has_no_word(tmp_path: Path) -> None:
    assert word(tmp_path, "NMT-01", "start/addressed") == {}


def test_the_word_stands_in_the_explanation() -> None:
    plain = item("OD-10", "2000h")
    heard = replace(plain, eds={"says": "default 2", "stands": ALL_DIFFER})

    assert "EDS" not in explain(plain)
    assert f"  EDS       default 2\n            {ALL_DIFFER}\n" in explain(heard)
