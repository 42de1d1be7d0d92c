"""The samples are what a run leaves behind today, and belong together.

What the checks judge, and when the samples were made, is not compared: a new check or another key
makes no sample wrong. What a reader relies on is: files, keys that are fixed, and reports that are of
the record beside them.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pypdf
import pytest
from junitparser import JUnitXml
from sample_runs import BAD, LARGEST_TRACE, LOT, SAMPLES, make, make_lot

from conformance.report.record import read_record
from conformance.report.results import Item
from conformance.resources import data

PLACE = data("reports") / "samples"
VERDICTS = {
    "heartbeat-slow": "deviates",
    "baumer_gim140r": "conforms",
    "danfoss_dst_x730": "conforms",
}


def content(folder: Path) -> dict[str, Any]:
    made: dict[str, Any] = json.loads((folder / "results.json").read_text("utf-8"))
    return made


def text_of(path: Path) -> list[str]:
    return [" ".join(page.extract_text().split()) for page in pypdf.PdfReader(path).pages]


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_is_a_record_of_today(name: str) -> None:
    record = read_record(PLACE / name)

    assert record.summary.verdict == VERDICTS[name]
    assert record.summary.complete
    known = {field.name for field in fields(Item)}
    assert all(set(item) <= known for item in content(PLACE / name)["items"])


@pytest.mark.parametrize("name", SAMPLES)
def test_its_reports_are_of_its_record(name: str) -> None:
    folder = PLACE / name
    record = read_record(folder)

    sha256 = hashlib.sha256((folder / "results.json").read_bytes()).hexdigest()
    assert sha256 in (folder / "report.html").read_text("utf-8")
    assert all(sha256 in page for page in text_of(folder / "certificate.pdf"))
    (suite,) = JUnitXml.fromfile(str(folder / "junit.xml"))
    assert {case.name for case in suite} >= {item.id for item in record.items}


def test_all_of_them_are_in_one_certificate() -> None:
    first, *pages = text_of(PLACE / "certificate-of-three.pdf")

    assert "3 units: 2 conform, 1 deviates, 0 are undecided." in first
    for name in SAMPLES:
        record = read_record(PLACE / name)
        assert record.device.serial in first
        assert any(record.sha256 in page for page in pages)


def test_the_acceptance_alone_is_not_partial() -> None:
    partial = {name: "PARTIAL" in text_of(PLACE / name / "certificate.pdf")[0] for name in SAMPLES}

    assert partial == {"heartbeat-slow": True, "baumer_gim140r": True, "danfoss_dst_x730": False}


@pytest.mark.parametrize("name", SAMPLES)
def test_the_readme_says_what_made_it(name: str) -> None:
    told = (PLACE / "README.md").read_text("utf-8")

    assert f"`{name}/`" in told
    assert f"`{SAMPLES[name]}`" in told
    assert (PLACE / name / "trace.log").exists() == (name == "heartbeat-slow")


def test_the_command_makes_the_same_files_and_verdict_today(tmp_path: Path) -> None:
    name = "heartbeat-slow"

    make(name, tmp_path / name)

    kept = {path.name for path in (PLACE / name).iterdir()}
    assert {path.name for path in (tmp_path / name).iterdir()} == kept
    made, sample = content(tmp_path / name), content(PLACE / name)
    assert made["summary"]["verdict"] == sample["summary"]["verdict"]
    assert set(made) >= set(sample)
    assert set(made["run"]) >= set(sample["run"])
    assert set(made["items"][0]) >= set(sample["items"][0])
    assert str(tmp_path) not in (tmp_path / name / "summary.txt").read_text("utf-8")
    assert (PLACE / name / "trace.log").stat().st_size <= LARGEST_TRACE


def test_the_lot_is_not_accepted_for_its_bad_units() -> None:
    lot = json.loads((PLACE / LOT / "lot.json").read_text("ascii"))

    bad = {it["unit"] for it in lot["units"] if it["verdict"] == "nonconforming"}
    assert bad
    assert bad == {it["unit"] for it in lot["units"]} & set(BAD)
    assert lot["verdict"]["word"] == "not accepted"
    assert "NOT ACCEPTED" in (PLACE / LOT / "summary.txt").read_text("utf-8")
    assert "not accepted" in (PLACE / LOT / "lot.html").read_text("utf-8")
    assert f"`{LOT}/`" in (PLACE / "README.md").read_text("utf-8")


def test_the_command_makes_the_same_lot_today(tmp_path: Path) -> None:
    make_lot(tmp_path / LOT)

    kept = {path.name for path in (PLACE / LOT).iterdir()}
    assert {path.name for path in (tmp_path / LOT).iterdir()} == kept
    assert (tmp_path / LOT / "lot.yaml").read_bytes() == (PLACE / LOT / "lot.yaml").read_bytes()
    assert str(tmp_path) not in (tmp_path / LOT / "summary.txt").read_text("utf-8")
