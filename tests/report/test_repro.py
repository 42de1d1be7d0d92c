"""How to see an item again: made from a record alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from conformance.errors import BenchError
from conformance.report.repro import command, script

TRACE = """\
(1.000000) can0 632#4000100000000000 T
(1.002000) can0 5B2#4300100019010200 R
(1.003000) can0 632#2B1710000A000000 T
(1.004000) can0 181#0102 R
(1.005000) can0 5B2#6017100000000000 R
(1.015000) can0 732#7F R
(1.020000) can0 7FF#05 R
(1.025000) can0 732#7F R
(1.036000) can0 732#04 R
(1.100000) can0 080#R1 T
(1.101000) can0 632#2B17100000000000 T
"""
ITEM = {
    "id": "a/HB-01/1017h",
    "sentence": "A rule.",
    "trace": "trace.log:1-10",
    "begins": 3,
    "verdict": "fail",
    "reason": "",
    "quantity": "period",
    "expected": "10 ms",
    "actual": "11 ms",
    "deviations": [{"quantity": "period", "expected": "10 ms", "actual": "11 ms"}],
}


def write(folder: Path, **changes: Any) -> Path:
    record = {
        "run": {"arguments": ["my device.yaml", "--seed", "1"]},
        "device": {"node_id": 0x32},
        "items": [{**ITEM, **changes}],
    }
    (folder / "results.json").write_text(json.dumps(record), encoding="utf-8")
    (folder / "trace.log").write_text(TRACE, encoding="ascii")
    return folder


def test_what_a_shell_would_take_apart_is_quoted() -> None:
    arguments = ["my device.yaml", "--fault", "objects/0x2FFE={name: X, source: '-'}"]

    line = command(arguments, "a/EMCY-24/4000h=0")

    assert line == (
        "canopen-conformance run 'my device.yaml' --fault "
        "'objects/0x2FFE={name: X, source: '\"'\"'-'\"'\"'}' --select a/EMCY-24/4000h=0"
    )


def test_frames_are_told_apart_and_only_those_of_the_device_are_shown(tmp_path: Path) -> None:
    assert script(write(tmp_path), "a/HB-01/1017h").splitlines() == [
        "# a/HB-01/1017h: A rule.",
        "# canopen-conformance run 'my device.yaml' --seed 1 --select a/HB-01/1017h",
        "# set-up",
        "cansend can0 632#4000100000000000",
        "#   got 5B2#4300100019010200",
        "# the check",
        "cansend can0 632#2B1710000A000000",
        "#   got 5B2#6017100000000000",
        "#   got 732#7F",
        "#   got 2 more on 732, at last 732#04",
        "sleep 0.097",
        "cansend can0 080#R1",
        "# period",
        "#   expected: 10 ms",
        "#   got:      11 ms",
        "# fail",
    ]


def test_a_node_that_is_asked_at_another_node_id_is_shown(tmp_path: Path) -> None:
    folder = write(tmp_path)
    with (folder / "trace.log").open("a", encoding="ascii") as trace:
        trace.write("(2.000000) can0 605#4000100000000000 T\n(2.001000) can0 585#43 R\n")
    record = json.loads((folder / "results.json").read_text("utf-8"))
    record["items"][0] |= {"trace": "trace.log:12-13", "begins": 12}
    (folder / "results.json").write_text(json.dumps(record), encoding="utf-8")

    assert "#   got 585#43" in script(folder, "a/HB-01/1017h")


@pytest.mark.parametrize(
    ("changes", "last"),
    [
        (
            {"verdict": "not_applicable", "reason": "none", "expected": ""},
            "# not applicable (none)",
        ),
        ({"verdict": "pass"}, "# pass"),
    ],
)
def test_an_item_that_did_not_fail_is_shown_too(
    changes: dict[str, Any], last: str, tmp_path: Path
) -> None:
    folder = write(tmp_path, trace="", deviations=[], **changes)

    lines = script(folder, "a/HB-01/1017h").splitlines()

    assert "# no frame" in lines
    assert lines[-1] == last


def test_what_is_no_record_is_said_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(BenchError, match="cannot read the record"):
        script(tmp_path, "a/HB-01/1017h")
    with pytest.raises(BenchError, match="no item a/HB-02"):
        script(write(tmp_path), "a/HB-02")
