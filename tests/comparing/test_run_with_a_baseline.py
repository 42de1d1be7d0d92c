"""A run with a baseline ends by what nobody knows; its record keeps what it found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from junitparser import Failure, JUnitXml, Skipped

from conformance.report.results import Item, Results

SLOW = ("--select", "HB-01", "--fault", "heartbeat-slow-10-percent")
DEVIATING = ("siko_ims360/HB-01/1017h/10ms", "siko_ims360/HB-01/1017h/100ms")


def _baseline(path: Path, *items: str, expires: str = "9999-12-31") -> Path:
    entries = "".join(
        f"  - {{item: {item}, owner: me, reason: later, expires: {expires}}}\n" for item in items
    )
    path.write_text(f"format: 1\ndeviations:\n{entries}", encoding="utf-8")
    return path


def _words(folder: Path) -> list[type]:
    (suite,) = JUnitXml.fromfile(str(folder / "junit.xml"))
    return [type(case.result[0]) for case in suite if case.result]


def test_what_is_known_does_not_decide_and_stays_a_deviation(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    finished = judge(*SLOW, "--baseline", _baseline(tmp_path / "known.yaml", *DEVIATING))

    assert finished.code == 0
    assert "DEVIATES" in finished.out
    assert "2 of 2 deviations" in finished.out
    record = finished.record
    assert (record["summary"]["verdict"], record["summary"]["known"]) == ("deviates", 2)
    failed = [item for item in record["items"] if item["verdict"] == "fail"]
    assert [item["known"] for item in failed] == ["me: later (until 9999-12-31)"] * 2
    assert _words(finished.folder) == [Skipped, Skipped]


def test_one_that_nobody_knows_decides(judge: Callable[..., Any], tmp_path: Path) -> None:
    finished = judge(*SLOW, "--baseline", _baseline(tmp_path / "known.yaml", DEVIATING[0]))

    assert finished.code == 1
    assert sorted(it.__name__ for it in _words(finished.folder)) == ["Failure", "Skipped"]


def test_an_expired_entry_is_told_and_counts_no_more(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    path = _baseline(tmp_path / "known.yaml", *DEVIATING, expires="2020-01-01")

    finished = judge(*SLOW, "--baseline", path)

    assert finished.code == 1
    assert f"expired in the baseline, and deviates: {DEVIATING[0]}" in finished.out
    assert _words(finished.folder) == [Failure, Failure]


def test_an_entry_that_passes_is_told(judge: Callable[..., Any], tmp_path: Path) -> None:
    path = _baseline(tmp_path / "known.yaml", *DEVIATING)

    finished = judge("--select", "HB-01", "--baseline", path)

    assert finished.code == 0
    assert f"in the baseline, and passes: {DEVIATING[1]}" in finished.out
    assert finished.record["run"]["baseline"]["no_longer"] == list(DEVIATING)


def test_a_wrong_baseline_is_refused_before_anything_is_sent(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    finished = judge("--baseline", tmp_path / "none.yaml")

    assert finished.code == 3
    assert "none.yaml" in finished.err
    assert not finished.folder.exists()


def test_an_acceptance_run_knows_no_baseline(judge: Callable[..., Any], tmp_path: Path) -> None:
    finished = judge("--acceptance", "--baseline", _baseline(tmp_path / "known.yaml", *DEVIATING))

    assert finished.code == 3
    assert "--baseline as well" in finished.err


@pytest.mark.parametrize(
    ("more", "complete", "code"), [("pass", True, 0), ("inconclusive", True, 2), ("pass", False, 2)]
)
def test_what_is_undecided_stays_so_beside_what_is_known(
    more: Any, complete: bool, code: int
) -> None:
    known = Item("x/A-01", "A-01", "", "manual", "", "s", "", "fail", known="me")
    other = Item("x/A-02", "A-02", "", "manual", "", "s", "", more)

    results = Results({}, {}, [known, other], complete=complete)

    assert (results.exit_code, results.verdict) == (code, "deviates")


def test_a_run_is_entered_into_the_history(
    judge: Callable[..., Any], command: Callable[..., Any], tmp_path: Path
) -> None:
    url = f"sqlite:///{tmp_path / 'site' / 'history.sqlite'}"
    asked = ("--select", "BOOT-01", "--serial", "4711", "--history", "--database", url)

    assert judge(*asked).code == 0

    told = command("history", "4711", "--database", url)
    assert told.code == 0
    assert "conforms" in told.out
    (line,) = [it for it in told.out.splitlines() if it.startswith("1 ")]
    assert "BOOT-01" in line


def test_a_history_that_cannot_be_is_told_before_the_run(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "BOOT-01", "--history", "--database", "nonsense")

    assert finished.code == 3
    assert not finished.folder.exists()
