"""The suite finds the deviations of devices that nobody here wrote, all of them true, and no others.

What they are, and the frames that show them, is in `reports/samples`. A requirement that appears here
or disappears is a new check that finds something, which wants its frames read and `make samples`, or
a false alarm of the suite.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from samples import LIBRARIES, Judged, document_of, judge, listed

FOLLOWS = {
    "OD-14": "see OD-13",
    "SDO-17": "see OD-16",
    "SDO-33": "see SDO-30",
    "TPDO-17": "see TPDO-16",
    "TPDO-41": "see TPDO-40",
}
"""What is undecided only because something else fails."""

QUICK = "OD-16 or SDO-01 or SDO-21 or SDO-25"


@pytest.fixture(scope="module", params=LIBRARIES)
def device(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    return name


@pytest.fixture(scope="module")
def judged(device: str, tmp_path_factory: pytest.TempPathFactory) -> Judged:
    return judge(device, tmp_path_factory.mktemp(device))


def _objects(judged: Judged, verdict: str) -> dict[str, set[str]]:
    found: dict[str, set[str]] = defaultdict(set)
    for item in judged.items(verdict):
        found[item["requirement"]].add(item["object"])
    return dict(found)


def test_each_deviation_is_found_and_no_other(device: str, judged: Judged) -> None:
    assert judged.code == 1, judged.printed
    assert _objects(judged, "fail") == listed(device)


def test_what_is_undecided_follows_from_a_deviation(judged: Judged) -> None:
    undecided = judged.items("inconclusive")

    assert undecided
    for item in undecided:
        assert item["reason"].endswith(FOLLOWS[item["requirement"]]), item


def test_the_run_is_complete_and_orderly(judged: Judged) -> None:
    assert judged.record["summary"]["complete"]
    assert judged.record["run"]["clock"] == "virtual"
    assert judged.record["run"]["unsolicited_sdo_responses"] == 0
    assert not re.search(r"Traceback|Warning|Exception", judged.printed)


def test_nothing_is_left_changed(judged: Judged) -> None:
    assert judged.record["run"]["as_found"]["differences"] == []
    assert json.loads((judged.folder / "changed.json").read_text("utf-8")) == {}


def test_the_document_names_what_it_is_about(device: str) -> None:
    text = document_of(device).read_text("utf-8")

    assert re.search(rf"^{LIBRARIES[device]} \d+\.\d+\.\d+, python-can \d", text, re.MULTILINE)


def test_in_real_time_the_same_is_found(device: str, tmp_path: Path) -> None:
    judged = judge(device, tmp_path, "--real-time", "--select", QUICK)

    assert judged.record["run"]["clock"] == "real", judged.printed
    failed = _objects(judged, "fail")
    known: dict[str, Any] = listed(device)
    assert failed == {name: known[name] for name in failed}
    assert failed.keys() == {"OD-16", "SDO-21", "SDO-25"}
    assert judged.items("inconclusive") == []
