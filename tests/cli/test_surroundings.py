"""What surrounds a run: folders, other tests, terminals, a second run beside it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from junitparser import JUnitXml

from conformance.catalogue import load_checks

COMMAND = Path(sys.executable).parent / "canopen-conformance"
CHECKS = ("--pyargs", "conformance.checks", "--device", "siko_ims360")


def _pytest(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments],
        capture_output=True,
        encoding="utf-8",
        cwd=folder,
        check=False,
        timeout=240,
    )


@pytest.mark.parametrize("select", [(), ("--select", "HB")])
def test_a_folder_that_cannot_be_made_is_the_benchs_fault(
    select: tuple[str, ...], command: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")

    finished = command("run", "siko_ims360", "--report-dir", tmp_path / "file", *select)

    assert finished.code == 2
    assert "cannot make" in finished.err


def test_pytest_fails_when_the_record_has_no_place(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")

    done = _pytest(tmp_path, *CHECKS, "--report-dir", "file", "-k", "BOOT")

    assert done.returncode == 2
    assert "cannot make file" in done.stdout


def test_two_runs_in_one_second_keep_their_records_apart(tmp_path: Path) -> None:
    arguments = [str(COMMAND), "run", "siko_ims360", "--select", "BOOT-01"]
    running = [
        subprocess.Popen(arguments, cwd=tmp_path, stdout=subprocess.DEVNULL) for _ in range(3)
    ]
    assert [process.wait(timeout=60) for process in running] == [0, 0, 0]

    records = list(tmp_path.glob("reports/runs/*/results.json"))
    assert len(records) == 3
    for record in records:
        assert json.loads(record.read_text("utf-8"))["summary"]["complete"]


def test_a_folder_used_again_holds_nothing_of_the_old_run(judge: Callable[..., Any]) -> None:
    judge("--select", "BOOT")

    second = judge("--select", "BOOT", "--fault", "silent")

    assert second.code == 2
    assert second.record["items"] == []
    assert second.record["summary"]["complete"] is False
    (suite,) = JUnitXml.fromfile(str(second.folder / "junit.xml"))
    assert (suite.tests, suite.errors) == (1, 1)


def test_a_remark_fails_no_build(judge: Callable[..., Any]) -> None:
    arguments = ("--fault", "nmt-obeys-wrong-length", "--select", "NMT-04")

    remark = judge(*arguments)
    (suite,) = JUnitXml.fromfile(str(remark.folder / "junit.xml"))
    remarks = len(remark.items("fail"))
    assert remarks
    assert (remark.code, suite.failures, suite.skipped) == (0, 0, remarks)

    strict = judge(*arguments, "--strict")
    (suite,) = JUnitXml.fromfile(str(strict.folder / "junit.xml"))
    assert (strict.code, suite.failures) == (1, remarks)


def test_other_tests_may_run_beside_the_checks(tmp_path: Path) -> None:
    (tmp_path / "test_other.py").write_text("def test_it():\n    assert True\n", encoding="utf-8")

    done = _pytest(tmp_path, ".", *CHECKS, "-k", "BOOT or test_it", "--report-dir", "record")

    assert done.returncode == 0, done.stdout
    record = json.loads((tmp_path / "record" / "results.json").read_text("utf-8"))
    assert record["summary"]["complete"]


def test_the_checks_ask_for_a_device(tmp_path: Path) -> None:
    done = _pytest(tmp_path, "--pyargs", "conformance.checks")

    assert done.returncode == 4
    assert "expected --device NAME" in done.stdout + done.stderr


def test_several_processes_on_one_bus_are_refused(tmp_path: Path) -> None:
    done = _pytest(tmp_path, *CHECKS, "-n", "2")

    assert done.returncode == 4
    assert "one bus, one process" in done.stderr


def test_a_row_of_a_table_stays_on_its_line_in_a_pipe(command: Callable[..., Any]) -> None:
    finished = command("spec", "show", "siko_ims360")

    (line,) = [line for line in finished.out.splitlines() if line.startswith("1800h:05 ")]
    assert "UNSIGNED16" in line
    assert "7.2.13" in line


def test_control_characters_do_not_reach_the_terminal(judge: Callable[..., Any]) -> None:
    finished = judge("--serial", "\x1b[31mred", "--select", "BOOT-01")

    assert "\x1b[31m" not in finished.out
    assert "serial \\x1b[31mred" in finished.out


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_progress_is_seen_on_a_terminal(tmp_path: Path) -> None:
    import pty  # noqa: PLC0415 - not on every system

    main, terminal = pty.openpty()
    with subprocess.Popen(
        [COMMAND, "run", "siko_ims360", "--select", "OD-0"],
        cwd=tmp_path,
        stdout=terminal,
        stderr=terminal,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    ) as process:
        os.close(terminal)
        seen = b""
        while True:
            try:
                chunk = os.read(main, 65536)
            except OSError:  # the other end is closed
                break
            seen += chunk
    os.close(main)

    assert process.returncode == 0
    assert seen.count(b"/") > 3
    assert b"CONFORMS" in seen


def test_the_changelog_names_every_requirement() -> None:
    changelog = (Path(__file__).parents[2] / "CHANGELOG.md").read_text("utf-8")
    services: dict[str, int] = {}
    for identifier in load_checks():
        service, number = identifier.split("-")
        services[service] = max(services.get(service, 0), int(number))
    for service, last in services.items():
        assert f"{service}-{last:02d}" in changelog
