"""`inspect` as a user types it, on simulated lots."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from conformance.report.seal import verify

FAST = "select: OD-09 or HB-01\n"
HEAD = "format: 1\npart: Inclinometer\norder: order 17\ndevice: siko_ims360\nseed: 1\n"

Inspected = Callable[..., Any]


@pytest.fixture
def inspect(command: Callable[..., Any], tmp_path: Path) -> Inspected:
    """Inspect a lot that is written into a file."""

    def run(text: str, *arguments: str, order: int = 17) -> Any:
        path = tmp_path / f"{order}.yaml"
        path.write_text(HEAD.replace("17", str(order)) + text, encoding="utf-8")
        done = command("inspect", path, "--report-dir", tmp_path / str(order), *arguments)
        return replace(done, folder=tmp_path / str(order))

    return run


def state(done: Any) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((done.folder / "lot.json").read_text("ascii"))
    return content


def test_a_lot_of_fifty_with_three_bad_units_is_inspected_whole(inspect: Inspected) -> None:
    serials = list(range(40_001, 40_051))
    faults = (
        "{40004: [heartbeat-slow-10-percent], 40020: [wrong-identity], 40044: [wrong-identity]}"
    )
    lot = f"serials: {serials}\nlevel: all\n{FAST}simulation: {{faults: {faults}}}\n"
    done = inspect(lot)
    assert done.code == 1, done.out + done.err
    kept = state(done)
    bad = [it["unit"] for it in kept["units"] if it["verdict"] == "nonconforming"]
    assert bad == [40_004, 40_020, 40_044]
    assert (kept["verdict"]["conforming"], kept["verdict"]["word"]) == (47, "not accepted")
    assert kept["statistics"]["by_requirement"] == {"OD-09": 2, "HB-01": 1}
    assert kept["statistics"]["by_object"] == {"1018h:01": 2, "1017h": 1}
    assert [it["tries"][0]["serial"] for it in kept["units"]] == [str(it) for it in serials]
    periods = [it for it in kept["statistics"]["quantities"] if it["item"] == "HB-01/1017h/100ms"]
    assert [it["outliers"] for it in periods] == [[40_004], [40_004]]
    assert "NOT ACCEPTED: 3 of 50 units nonconforming, which is Re 1 or more" in done.out
    page = (done.folder / "lot.html").read_text("utf-8")
    assert "not accepted" in page
    record = json.loads((done.folder / "units/40020-1/results.json").read_text("utf-8"))
    assert record["device"]["serial"] == "40020"
    assert '<a href="units/40020-1/report.html">nonconforming</a>' in page
    assert "OD-09" in (done.folder / "units/40020-1/report.html").read_text("utf-8")
    assert set(verify(done.folder / "units/40020-1").same) == {
        "results.json",
        "trace.log",
        "junit.xml",
        "report.html",
    }

    again = inspect(lot)
    assert again.code == 1
    assert len(list((again.folder / "units").iterdir())) == 50, "nothing is judged twice"


def test_a_lot_is_entered_into_the_history(
    inspect: Inspected, command: Callable[..., Any], tmp_path: Path
) -> None:
    where = "--database", f"sqlite:///{tmp_path / 'history.db'}"
    lot = f"serials: [7, 8, 9]\nlevel: all\n{FAST}simulation: {{faults: {{8: [wrong-identity]}}}}\n"
    done = inspect(lot, "--history", *where)
    assert done.code == 1, done.out + done.err

    told = command("history", "--lot", "17", *where)
    assert told.code == 0
    rows = [line.split() for line in told.out.splitlines()]
    assert [row[:3] for row in rows if row[:1] in (["1"], ["2"], ["3"])] == [
        ["1", "siko_ims360", "7"],
        ["2", "siko_ims360", "8"],
        ["3", "siko_ims360", "9"],
    ]
    assert "not accepted" in told.out


def test_a_sample_is_drawn_by_the_plan_and_the_lot_accepted(inspect: Inspected) -> None:
    done = inspect(f"size: 50\naql: 6.5\nlevel: S-4\n{FAST}")
    kept = state(done)
    assert done.code == 0, done.out + done.err
    assert "code letter C, table 2-A, whose arrow leads to D: 8 units, Ac 1, Re 2" in done.out
    drawn = [it["unit"] for it in kept["units"]]
    assert len(drawn) == 8
    assert set(drawn) <= set(range(1, 51))
    assert "ACCEPTED: 0 of 8 units nonconforming, which is not more than Ac 1" in done.out


def test_a_dry_run_tells_no_units_that_are_thrown_only_later(
    inspect: Inspected, command: Callable[..., Any], tmp_path: Path
) -> None:
    known = inspect("size: 50\naql: 6.5\n", "--dry-run")
    assert "units drawn (seed 1), by places: " in known.out
    path = tmp_path / "17.yaml"
    path.write_text(path.read_text("utf-8").replace("seed: 1\n", ""), encoding="utf-8")
    thrown = command("inspect", path, "--dry-run")
    assert thrown.code == 0
    assert "which units are drawn is thrown when the inspection begins" in thrown.out
    assert not (tmp_path / "reports").exists()


def test_a_run_that_was_killed_is_run_again_and_nothing_is_lost(inspect: Inspected) -> None:
    lot = f"size: 4\nlevel: all\n{FAST}simulation: {{faults: {{2: [wrong-identity]}}}}\n"
    first = inspect(lot)
    kept = state(first)
    for unit in kept["units"][2:]:
        unit["tries"].clear()
    kept["running"] = [{"unit": 3, "folder": "units/3-1"}]
    (first.folder / "lot.json").write_text(json.dumps(kept), encoding="ascii")

    done = inspect(lot)
    assert done.code == 1
    assert "the run of unit 3 was broken off, and is run again" in done.err
    words = [it["verdict"] for it in state(done)["units"]]
    assert words == ["conforming", "nonconforming", "conforming", "conforming"]
    assert state(done)["units"][2]["tries"][0]["folder"] == "units/3-1-again"
    assert state(done)["units"][0]["tries"] == kept["units"][0]["tries"]
    assert state(done)["running"] == []


def test_a_unit_that_is_not_the_one_drawn_leaves_the_lot_undecided(inspect: Inspected) -> None:
    done = inspect(f"serials: [7, 8]\nlevel: all\n{FAST}simulation: {{serials: {{8: 7}}}}\n")
    assert done.code == 2
    assert "8  undecided  the sensor on the bus is 7, not 8" in done.out
    assert "serial numbers told by more than one unit: 7" in done.out
    assert "NOT DECIDED: 0 of 2 units nonconforming, and 1 undecided" in done.out


def test_a_sensor_connected_twice_is_seen_where_no_list_tells_serial_numbers(
    inspect: Inspected,
) -> None:
    done = inspect(f"size: 2\nlevel: all\n{FAST}simulation: {{serials: {{2: 1}}}}\n")
    assert done.code == 2
    assert "2  undecided  the sensor on the bus is 1, as that of another unit was" in done.out


def test_an_undecided_unit_is_judged_again_and_both_results_are_kept(inspect: Inspected) -> None:
    lot = f"size: 2\nlevel: all\n{FAST}simulation: {{faults: {{2: [silent]}}}}\n"
    done = inspect(lot)
    assert done.code == 2
    assert [it["verdict"] for it in state(done)["units"][1]["tries"]] == ["undecided"] * 2
    again = inspect(lot, "--retest", "2")
    assert again.code == 2
    assert len(state(again)["units"][1]["tries"]) == 4


def test_two_units_in_a_row_that_cannot_be_reached_stop_the_inspection(inspect: Inspected) -> None:
    faults = "{1: [silent], 2: [silent]}"
    done = inspect(f"size: 3\nlevel: all\nretests: 0\n{FAST}simulation: {{faults: {faults}}}\n")
    assert done.code == 2
    assert "2 units in a row could not be judged; look at the bench: " in done.err
    assert state(done)["units"][2]["verdict"] is None
    again = inspect(f"size: 3\nlevel: all\nretests: 0\n{FAST}simulation: {{faults: {faults}}}\n")
    assert again.code == 2
    assert [len(it["tries"]) for it in state(again)["units"]] == [2, 2, 0], "they are tried again"
    assert "units that told no serial number, so that nothing shows which they are: 2" in again.out


def test_the_series_tells_the_severity_of_the_next_lot(inspect: Inspected) -> None:
    lot = f"size: 20\naql: 10\nlevel: S-1\nseries: series.json\n{FAST}"
    bad = ", ".join(f"{unit}: [wrong-identity]" for unit in range(1, 21))
    for order in (1, 2):
        done = inspect(f"{lot}simulation: {{faults: {{{bad}}}}}\n", order=order)
        assert done.code == 1, done.out + done.err
        assert "normal inspection" in done.out
    done = inspect(lot, "--dry-run", order=3)
    assert done.code == 0
    assert "tightened inspection" in done.out
    assert not done.folder.exists()


def test_a_lot_that_was_resubmitted_is_left_out_of_the_series(inspect: Inspected) -> None:
    done = inspect(f"size: 20\naql: 10\nlevel: S-1\nseries: series.json\nresubmitted: true\n{FAST}")
    assert done.code == 0
    assert not done.folder.with_name("series.json").exists()


@pytest.mark.parametrize(
    ("text", "arguments", "said"),
    [
        ("size: 2\nlevel: all\nbench: nowhere\n", (), "bench: expected a path or one of "),
        ("size: 2\nlevel: all\nsimulation: {faults: {1: [nothing]}}\n", (), "--fault: expected a"),
        ("size: 2\nlevel: all\nselect: nothing\n", (), "select: expected a part of an item's id"),
        ("size: 2\nlevel: all\n", ("--retest", "3"), "--retest: expected a unit that was drawn"),
        (
            "size: 2\nlevel: all\nbench: socketcan\nsimulation: {serials: {1: 2}}\n",
            (),
            "simulation: expected the simulator as bench, got 'socketcan'",
        ),
    ],
)
def test_mistakes_are_told_in_a_sentence(
    inspect: Inspected, text: str, arguments: tuple[str, ...], said: str
) -> None:
    done = inspect(text, *arguments)
    assert done.code == 3, done.out + done.err
    assert said in done.err


def test_another_lot_file_does_not_go_on_with_an_inspection(inspect: Inspected) -> None:
    inspect(f"size: 2\nlevel: all\n{FAST}")
    done = inspect(f"size: 3\nlevel: all\n{FAST}")
    assert done.code == 3
    assert "expected the lot file that the inspection in " in done.err


def test_a_lot_file_may_be_mended_before_anything_was_judged(inspect: Inspected) -> None:
    assert inspect("size: 2\nlevel: all\nselect: nothing\n").code == 3
    assert inspect(f"size: 2\nlevel: all\n{FAST}").code == 0


def test_a_damaged_state_is_told(inspect: Inspected) -> None:
    done = inspect(f"size: 2\nlevel: all\n{FAST}")
    (done.folder / "lot.json").write_text('{"format": 1', encoding="ascii")
    again = inspect(f"size: 2\nlevel: all\n{FAST}")
    assert again.code == 3
    assert "expected the state of an inspection, got what is none" in again.err
