"""A run of which nothing was left to its user, and how a record says whether it is one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from junitparser import JUnitXml


def _property(folder: Path) -> str:
    (suite,) = JUnitXml.fromfile(str(folder / "junit.xml"))
    children = suite.properties()  # type: ignore[no-untyped-call]  # it has no types
    values = {it.name: it.value for it in children}
    return str(values["acceptance"])


def test_an_acceptance_run_judges_everything_and_says_so(judge: Callable[..., Any]) -> None:
    finished = judge("--acceptance", "--serial", "4711")

    run = finished.record["run"]
    assert finished.code == 0
    assert (run["acceptance"], run["select"], run["seed"], run["strict"]) == (True, "", 0, False)
    assert _property(finished.folder) == "True"
    assert "partial" not in finished.out


def test_any_other_run_is_partial_and_says_so(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "BOOT-01")

    assert finished.record["run"]["acceptance"] is False
    assert _property(finished.folder) == "False"
    assert "partial: the record of no acceptance run (see run --acceptance)" in finished.out
