"""The command line as users know it: what it prints, what it refuses, how it exits."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.catalogue import load_checks


def test_devices_lists_the_built_in_specs(command: Callable[..., Any]) -> None:
    finished = command("devices")

    assert finished.code == 0
    assert "siko_ims360" in finished.out
    assert "one-axis, two-axis" in finished.out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (
            ["run", "siko_ims36"],
            "DEVICE: expected a path or one of baumer_gim140r, danfoss_dst_x730, siko_ims360, got 'siko_ims36'",
        ),
        (["run", "nowhere/x.yaml"], "DEVICE: expected a readable file, got 'nowhere/x.yaml'"),
        (["run", "siko_ims360", "--variant", "three-axis"], "--variant: expected one of one-axis"),
        (["run", "siko_ims360", "--node-id", "128"], "--node-id: expected 1 to 127, got 128"),
        (["run", "siko_ims360", "--node-id", "0"], "--node-id: expected 1 to 127, got 0"),
        (["run", "siko_ims360", "--bench", "no"], "--bench: expected a path or one of"),
        (["run", "siko_ims360", "--fault", "no"], "--fault: expected a path or one of"),
        (["run", "siko_ims360", "--reading", "IMS-01"], "--reading: expected ID=N, got 'IMS-01'"),
        (["run", "siko_ims360", "--reading", "NO-01=1"], "--reading: expected an ambiguity"),
        (["run", "siko_ims360", "--reading", "IMS-01=99"], "--reading: expected 1 to"),
        (["run", "siko_ims360", "--select", "nothing-like-it"], "--select: expected a part of"),
        (["run", "siko_ims360", "--select", "(("], "--select: expected parts of ids"),
        (["run", "siko_ims360", "--simulate-spec", "no"], "--simulate-spec: expected"),
        (["run", "siko_ims360", "--bench", "socketcan", "--fault", "silent"], "--fault: expected"),
        (
            ["run", "siko_ims360", "--acceptance", "--select", "HB"],
            "as the spec has it, got --select",
        ),
        (["run", "siko_ims360", "--acceptance", "--repro", "HB-01"], "got --repro as well"),
        (["run", "siko_ims360", "--acceptance", "--fault", "silent"], "got --fault as well"),
        (["run", "siko_ims360", "--acceptance", "--reading", "IMS-88=2"], "got --reading as well"),
        (["run", "siko_ims360", "--acceptance", "--simulate-spec", "no"], "got --simulate-spec as"),
        (["run", "siko_ims360", "--acceptance", "--seed", "1", "--strict"], "--seed and --strict"),
        (["run", "x" * 5000], "DEVICE: expected a path or one of"),
        (["run"], "Missing argument"),
        (["run", "siko_ims360", "--nonsense"], "No such option"),
        (["spec", "show", "siko_ims360", "--format", "xml"], "Invalid value for '--format'"),
        (["spec", "lint", "no.yaml"], "no.yaml: expected a readable file"),
    ],
)
def test_a_mistake_gets_one_sentence_and_exit_code_3(
    arguments: list[str], sentence: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    finished = command(*arguments)

    assert finished.code == 3
    assert sentence in finished.err
    assert not (tmp_path / "reports").exists()


def test_a_bench_without_its_bus_is_blamed_itself(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    bench = tmp_path / "bench.yaml"
    bench.write_text(
        "format: 1\nwhat: none\ninterface: socketcan\nchannel: nosuchcan9\n", encoding="utf-8"
    )

    finished = command("run", "siko_ims360", "--bench", bench, "--report-dir", tmp_path / "record")

    assert finished.code == 2
    assert "cannot open the bus (interface socketcan, channel nosuchcan9)" in finished.out
    assert finished.record["items"] == []


def test_a_silent_node_stops_the_run(judge: Callable[..., Any]) -> None:
    finished = judge("--fault", "silent")

    assert finished.code == 2
    assert "node 50 does not answer" in finished.out
    assert finished.items("fail") == []


def test_a_node_that_answers_with_garbage_never_passes_sdo(judge: Callable[..., Any]) -> None:
    finished = judge("--fault", "garbage", "--select", "OD-01 or OD-02 or SDO")

    assert finished.code == 1
    assert finished.items("pass") == []


def test_a_node_that_answers_too_late_is_inconclusive(judge: Callable[..., Any]) -> None:
    finished = judge("--fault", "sdo-slow")

    assert finished.code == 2
    assert "does not answer any more within 1 s" in finished.out
    assert "came late or unasked" in finished.out


def test_an_ambiguity_lets_the_device_follow_either_reading(judge: Callable[..., Any]) -> None:
    finished = judge("--reading", "IMS-88=2", "--select", "1008h")

    assert finished.code == 0
    readings = [item["readings"] for item in finished.record["items"] if item["readings"]]
    assert {"IMS-88": 2} in readings


def test_a_node_id_of_the_users_choice_is_judged(judge: Callable[..., Any]) -> None:
    finished = judge("--node-id", "5", "--select", "BOOT or HB or 1800h or 1014h")

    assert finished.record["device"]["node_id"] == 5
    assert finished.items("fail") == []


def test_should_is_a_remark_unless_strict(judge: Callable[..., Any]) -> None:
    arguments = ("--fault", "nmt-obeys-wrong-length", "--select", "NMT-04")

    remark, strict = judge(*arguments), judge(*arguments, "--strict")

    assert (remark.code, strict.code) == (0, 1)
    assert "remark" in remark.out


def test_spec_show_prints_every_entry_as_json(command: Callable[..., Any]) -> None:
    finished = command(
        "spec", "show", "siko_ims360", "--variant", "two-axis", "--node-id", "5", "--format", "json"
    )

    shown = json.loads(finished.out)
    assert (shown["device"], shown["variant"], shown["node_id"]) == ("siko_ims360", "two-axis", 5)
    by_key = {(o["index"], o["sub"]): o for o in shown["objects"]}
    assert by_key[0x1000, 0]["default"] == 0x0704019A
    assert by_key[0x1800, 1]["default"] == 0x185
    assert by_key[0x1017, 0]["ranges"] == [[0, 0], [10, 65535]]
    assert by_key[0x2001, 0]["values"]["125000"]
    assert by_key[0x1018, 0]["default"] == 4
    fixed = {"index", "sub", "name", "type", "access", "default", "ranges", "values", "mappable"}
    assert all(fixed | {"persistent", "source"} <= set(o) for o in shown["objects"])
    assert shown["services"]["heartbeat_producer"]["min_ms"] == 10
    assert len(shown["ambiguities"]) > 80


def test_spec_show_prints_a_table(command: Callable[..., Any]) -> None:
    finished = command("spec", "show", "siko_ims360")

    assert "1017h" in finished.out
    assert "1018h:01" in finished.out


def test_spec_lint_reports_every_problem(command: Callable[..., Any], tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("format: 2\nvendor: x\n", encoding="utf-8")

    finished = command("spec", "lint", bad)

    assert finished.code == 3
    assert "bad.yaml:1: format: expected 1, got 2" in finished.err
    assert "bad.yaml:2: vendor: expected a known key, got 'vendor'" in finished.err
    assert "expected this key, got nothing" in finished.err


def test_catalogue_names_every_requirement_with_its_source(command: Callable[..., Any]) -> None:
    page = command("catalogue", "siko_ims360").out
    data = json.loads(command("catalogue", "siko_ims360", "--format", "json").out)

    known = load_checks()
    assert {r["id"] for r in data["requirements"]} == set(known)
    for requirement in known.values():
        assert f"| {requirement.id} | {requirement.sentence} |" in page
        assert requirement.level == "manual" or requirement.source


def _pytest(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments],
        capture_output=True,
        encoding="utf-8",
        cwd=folder,
        check=False,
        timeout=240,
    )


CHECKS = ("--pyargs", "conformance.checks", "--device", "siko_ims360")


def test_pytest_runs_the_checks_with_its_own_options(tmp_path: Path) -> None:
    done = _pytest(tmp_path, *CHECKS, "-k", "OD-10", "--fault", "wrong-heartbeat-default", "-x")

    assert done.returncode == 1
    assert "siko_ims360/OD-10/1017h" in done.stdout
    assert "expected  0 (0000h)" in done.stdout
    assert "stopping after 1 failures" in done.stdout


def test_pytest_collects_without_touching_a_bus(tmp_path: Path) -> None:
    done = _pytest(tmp_path, *CHECKS, "--bench", "socketcan", "--collect-only", "-q")

    assert done.returncode == 0
    assert "[siko_ims360/HB-01/1017h/10ms]" in done.stdout
    assert not (tmp_path / "reports").exists()


def test_pytest_tells_a_mistake_in_one_sentence(tmp_path: Path) -> None:
    done = _pytest(tmp_path, "--pyargs", "conformance.checks", "--device", "nothing")

    assert done.returncode == 4
    assert "DEVICE: expected a path or one of" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_plug_in_is_inert_in_other_peoples_tests(tmp_path: Path) -> None:
    (tmp_path / "test_other.py").write_text("def test_it():\n    assert True\n", encoding="utf-8")

    done = _pytest(tmp_path, "-q")

    assert done.returncode == 0
    assert "1 passed" in done.stdout
    assert not (tmp_path / "reports").exists()
