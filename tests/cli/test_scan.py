"""`run --scan`: what a user and the reports are told of objects that no manual names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from junitparser import JUnitXml, Skipped

SPEC = Path(__file__).parents[2] / "device_specs" / "siko_ims360.yaml"
HIDDEN = """
  0x20F0:
    {name: Hidden, type: VISIBLE_STRING, access: ro, kind: constant, default: "<b>&[/]", source: "0"}
"""


def test_a_scan_after_the_items_tells_a_remark(judge: Callable[..., Any], tmp_path: Path) -> None:
    before, _, after = SPEC.read_text(encoding="utf-8").partition("\nobjects:\n")
    model = tmp_path / "hidden.yaml"
    model.write_text(f"{before}\nobjects:{HIDDEN}{after}", encoding="utf-8")

    finished = judge("--select", "BOOT-01", "--scan", "--strict", "--simulate-spec", model)

    assert finished.code == 0
    sentence = "20F0h (manufacturer-specific): 7 octets, a text, 3C 62 3E 26 5B 2F 5D, '<b>&[/]'"
    assert "scan of 65536 indices" in finished.out
    assert "1 entry answers that the manual does not document" in finished.out
    assert f"  {sentence}" in finished.out
    scan = finished.record["scan"]
    assert (scan["complete"], scan["indices"]) == (True, 0x10000)
    (found,) = scan["undocumented"]
    assert (found["object"], found["index"], found["sub"]) == ("20F0h", 0x20F0, 0)
    assert (found["length"], found["hex"], found["text"]) == (7, "3C 62 3E 26 5B 2F 5D", "<b>&[/]")
    first, last = map(int, found["trace"].partition(":")[2].split("-"))
    lines = (finished.folder / "trace.log").read_text("ascii").splitlines()[first - 1 : last]
    assert [line.split()[2] for line in lines[:2]] == [
        "632#40F0200000000000",
        "5B2#41F0200007000000",
    ]
    (suite,) = JUnitXml.fromfile(str(finished.folder / "junit.xml"))
    (case,) = [case for case in suite if case.classname == "siko_ims360.scan"]
    assert case.name == "siko_ims360/scan/20F0h"
    assert isinstance(case.result[0], Skipped)
    assert case.result[0].message == f"remark: not documented: {sentence}"


def test_a_scan_that_cannot_be_completed_is_inconclusive(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "BOOT-01", "--scan", "--fault", "unknown-object-reads-zero")

    assert finished.code == 2
    assert "The run ended early: scan: 1000 entries that are not documented" in finished.out
    assert "… and 980 more in results.json" in finished.out
    assert finished.record["scan"]["complete"] is False


def test_without_the_option_nothing_is_scanned(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "BOOT-01")

    assert "scan" not in finished.record
    assert "scan" not in finished.out
