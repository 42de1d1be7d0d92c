"""What a run leaves behind, read back by programs that are not ours."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from junitparser import Error, Failure, JUnitXml, Skipped

from conformance.report.junit import to_junit
from conformance.report.results import Item, Results

SPECS = Path(__file__).parents[2] / "device_specs"
VERDICTS = {"pass", "fail", "inconclusive", "skipped", "not_applicable"}


def test_junit_is_read_by_another_parser(judge: Callable[..., Any]) -> None:
    finished = judge("--fault", "heartbeat-slow-10-percent", "--serial", "4711")

    record = finished.record
    (suite,) = JUnitXml.fromfile(str(finished.folder / "junit.xml"))
    assert suite.name == "siko_ims360 4711"
    assert suite.tests == record["summary"]["items"]
    assert suite.failures == record["summary"]["fail"] == 3
    failed = [case for case in suite if case.result and isinstance(case.result[0], Failure)]
    assert {case.name for case in failed} == {
        "siko_ims360/HB-01/1017h/10ms",
        "siko_ims360/HB-01/1017h/100ms",
        "siko_ims360/HB-07/1017h/2000ms",
    }
    assert "IMS360 CANopen user manual 088/25, 6.2.3" in failed[0].result[0].text
    assert "trace.log:" in failed[0].result[0].text


def test_the_record_has_its_fixed_keys(judge: Callable[..., Any]) -> None:
    record = judge("--select", "BOOT").record

    assert set(record) == {"run", "device", "items", "summary", "manual"}
    for item in record["items"]:
        assert item["verdict"] in VERDICTS
        assert {
            "id",
            "requirement",
            "level",
            "source",
            "object",
            "verdict",
            "expected",
            "actual",
            "unit",
            "duration_s",
            "trace",
        } <= set(item)
    assert record["run"]["spec_sha256"]
    assert record["device"]["identity"]["1018h:01"] == "95 01 00 00"
    assert record["summary"]["verdict"] == "conforms"


def test_the_record_holds_what_was_measured_with_its_limits(judge: Callable[..., Any]) -> None:
    (item,) = judge("--select", "HB-01/1017h/100ms").record["items"]

    gaps, mean = item["measurements"]
    assert (gaps["quantity"], gaps["unit"]) == ("heartbeat period", "ms")
    assert len(gaps["values"]) > 5
    assert (gaps["least"], gaps["nominal"], gaps["most"]) == (93, 100, 107)
    assert mean["values"] == [pytest.approx(100, abs=0.1)]


def test_the_record_says_of_what_it_is_a_part(judge: Callable[..., Any]) -> None:
    assert judge("--select", "BOOT").record["run"]["select"] == "BOOT"
    assert judge("--repro", "OD-10/1017h").record["run"]["select"] == "OD-10/1017h"


def test_the_record_holds_what_the_manual_says_and_leaves_open(judge: Callable[..., Any]) -> None:
    manual = judge("--select", "BOOT").record["manual"]

    assert manual["statements_missing"] == ""
    said = next(it for it in manual["statements"] if "BOOT-01" in it["verified_by"])
    assert said["id"].startswith("S-")
    assert said["source"]
    assert said["says"]
    open_ = next(it for it in manual["ambiguities"] if it["id"] == "IMS-07")
    assert len(open_["readings"]) == 2


@pytest.mark.parametrize("text", [None, "format: 2\n", "format: 1\nstatements: []\n"])
def test_a_run_needs_no_statements(
    text: str | None, judge: Callable[..., Any], tmp_path: Path
) -> None:
    spec = tmp_path / "x.yaml"
    spec.write_bytes((SPECS / "siko_ims360.yaml").read_bytes())
    if text is not None:
        (tmp_path / "x.statements.yaml").write_text(text, encoding="utf-8")

    finished = judge("--select", "BOOT-01", device=spec)

    assert finished.code == 0
    assert finished.record["manual"]["statements"] == []
    assert finished.record["manual"]["statements_missing"]


def test_the_trace_is_read_by_python_can_and_holds_each_items_frames(
    judge: Callable[..., Any],
) -> None:
    finished = judge("--select", "HB-02 or OD-09")

    with can.CanutilsLogReader(finished.folder / "trace.log") as reader:
        messages = list(reader)
    assert len(messages) == finished.record["run"]["frames"]
    stamps = [message.timestamp for message in messages]
    assert stamps == sorted(stamps)
    item = next(i for i in finished.record["items"] if i["id"].endswith("OD-09/1000h"))
    first, last = map(int, item["trace"].partition(":")[2].split("-"))
    sent, received = messages[first - 1 : last]
    assert (sent.arbitration_id, sent.data.hex(), sent.is_rx) == (
        0x632,
        "4000100000000000",
        False,
    )
    assert (received.arbitration_id, received.data.hex(), received.is_rx) == (
        0x5B2,
        "430010009a010307",
        True,
    )


def test_a_run_is_repeated_frame_by_frame(command: Callable[..., Any], tmp_path: Path) -> None:
    traces = []
    for name in ("a", "b"):
        folder = tmp_path / name
        command("run", "siko_ims360", "--report-dir", folder, "--seed", "7")
        traces.append((folder / "trace.log").read_bytes())

    assert traces[0] == traces[1]


def test_text_that_xml_forbids_does_not_break_the_report() -> None:
    nasty = "a\x00b\x1b[31m<&>\ud800\ufffe"
    item = Item(
        id="x/OD-01/1008h",
        requirement="OD-01",
        sentence=nasty,
        level="manual",
        source=nasty,
        service="sdo",
        object="1008h",
        verdict="fail",
        expected=nasty,
        actual=nasty,
        quantity=nasty,
        deviations=({"quantity": nasty, "expected": nasty, "actual": nasty},),
    )
    results = Results({"started": nasty}, {"spec": nasty, "serial": nasty}, [item])

    (suite,) = JUnitXml.fromstring(to_junit(results).encode("utf-8"))

    assert suite.failures == 1


def test_inconclusive_is_an_error_and_skipped_is_skipped() -> None:
    items = [
        Item("x/A-01", "A-01", "", "manual", "", "sdo", "", verdict, reason="because")
        for verdict in ("inconclusive", "skipped", "not_applicable", "pass")
    ]
    results = Results({}, {"spec": "x", "serial": ""}, items, aborted="cable off")

    (suite,) = JUnitXml.fromstring(to_junit(results))

    kinds = [type(case.result[0]) if case.result else None for case in suite]
    assert kinds == [Error, Skipped, Skipped, None, Error]


@pytest.mark.parametrize(
    ("verdicts", "strict", "complete", "code"),
    [
        (["pass"], False, True, 0),
        (["pass", "skipped", "not_applicable"], False, True, 0),
        (["pass", "fail"], False, True, 1),
        (["pass", "inconclusive"], False, True, 2),
        (["fail", "inconclusive"], False, True, 1),
        (["pass", "should"], False, True, 0),
        (["pass", "should"], True, True, 1),
        (["pass"], False, False, 2),
        (["skipped"], False, True, 2),
        ([], False, True, 2),
    ],
)
def test_exit_code_follows_the_verdicts(
    verdicts: list[str], strict: bool, complete: bool, code: int
) -> None:
    items = [
        Item(
            "x/A-01",
            "A-01",
            "",
            "should" if verdict == "should" else "manual",
            "",
            "sdo",
            "",
            "fail" if verdict == "should" else verdict,  # type: ignore[arg-type]  # words of VERDICTS
        )
        for verdict in verdicts
    ]

    assert Results({}, {}, items, strict=strict, complete=complete).exit_code == code


def _has_items(record: Path) -> bool:
    return record.exists() and '"id"' in record.read_text("utf-8")


def _interrupted(folder: Path, number: signal.Signals, *arguments: str) -> tuple[int, str]:
    """Run in real time, send a signal in the middle of it, and return exit code and output."""
    command = Path(sys.executable).parent / "canopen-conformance"
    bench = ("--bench", "simulator-real-time", "--report-dir", str(folder))
    with subprocess.Popen(
        [str(command), "run", "siko_ims360", *bench, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    ) as process:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline and not _has_items(folder / "results.json"):
            time.sleep(0.05)
        time.sleep(1.5)
        process.send_signal(number)
        out, _ = process.communicate(timeout=60)
    assert "Traceback" not in out
    return process.returncode, out


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_a_killed_run_leaves_what_it_found(number: signal.Signals, tmp_path: Path) -> None:
    folder = tmp_path / "record"

    code, out = _interrupted(folder, number)

    record = json.loads((folder / "results.json").read_text("utf-8"))
    assert record["summary"]["complete"] is False
    assert (folder / "trace.log").stat().st_size > 0
    if number is not signal.SIGKILL:
        assert code == 2
        assert "interrupted by the user" in out
        assert "interrupted" in (folder / "junit.xml").read_text("utf-8")


def test_an_interrupted_check_is_undone(tmp_path: Path) -> None:
    folder = tmp_path / "record"

    _interrupted(folder, signal.SIGINT, "--select", "TPDO-02/1800h/100ms or RST-01/1017h")

    with can.CanutilsLogReader(folder / "trace.log") as reader:
        sent = [message for message in reader if not message.is_rx]
    downloads = {m.data[1:4].hex(): m.data[4:].hex() for m in sent if m.data[0] >> 5 == 1}
    assert downloads["001801"] == "b2010000"
    assert downloads["001805"] == "00000000"
    assert downloads["001a00"] == "08000000"
    commands = [m.data[0] for m in sent if m.arbitration_id == 0]
    assert commands[-4:] == [0x01, 0x80, 0x81, 0x80], "undone, then restarted to be compared"
