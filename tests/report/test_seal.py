"""What `verify` tells of a record that was changed, and of one that was not."""

from __future__ import annotations

import json
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

SEALED = ("results.json", "trace.log", "junit.xml", "report.html")


@pytest.fixture
def folder(judge: Callable[..., Any]) -> Path:
    made: Path = judge("--select", "BOOT-01").folder
    return made


def test_a_record_holds_the_hashes_of_its_spec_and_its_trace(folder: Path) -> None:
    run = json.loads((folder / "results.json").read_bytes())["run"]

    assert run["trace_sha256"] == sha256((folder / "trace.log").read_bytes()).hexdigest()
    assert len(run["spec_sha256"]) == 64


def test_a_record_is_unchanged(folder: Path, command: Callable[..., Any]) -> None:
    finished = command("verify", folder)

    assert finished.code == 0
    assert "unchanged: results.json, trace.log, junit.xml, report.html" in finished.out
    assert sha256((folder / "seal.json").read_bytes()).hexdigest() in finished.out


@pytest.mark.parametrize("name", SEALED)
def test_a_file_that_was_changed_is_named(
    name: str, folder: Path, command: Callable[..., Any]
) -> None:
    with (folder / name).open("ab") as file:
        file.write(b" ")

    finished = command("verify", folder)

    assert finished.code == 1
    assert finished.out == f"{name} was changed since the record was sealed\n"


def test_a_file_that_is_missing_is_named(folder: Path, command: Callable[..., Any]) -> None:
    (folder / "trace.log").unlink()

    finished = command("verify", folder)

    assert (finished.code, finished.out) == (1, "trace.log is missing\n")


def test_a_trace_of_another_run_is_found_under_a_new_seal(
    folder: Path, command: Callable[..., Any]
) -> None:
    trace = folder / "trace.log"
    trace.write_bytes(trace.read_bytes() + b"(9.000000) can0 000#8100 T\n")
    seal = json.loads((folder / "seal.json").read_bytes())
    seal["files"]["trace.log"] = sha256(trace.read_bytes()).hexdigest()
    (folder / "seal.json").write_text(json.dumps(seal), encoding="ascii")

    finished = command("verify", folder)

    assert finished.code == 1
    assert "trace.log is not the one that results.json was made with" in finished.out


def test_a_report_made_anew_is_sealed_with_the_rest(
    folder: Path, command: Callable[..., Any]
) -> None:
    (folder / "report.html").unlink()

    command("report", folder)
    command("certificate", folder)

    finished = command("verify", folder)
    assert finished.code == 0
    assert "certificate.pdf" in finished.out


def test_a_report_made_anew_hides_no_change_of_the_record(
    folder: Path, command: Callable[..., Any]
) -> None:
    record = folder / "results.json"
    record.write_bytes(record.read_bytes().replace(b'"pass"', b'"fail"'))

    command("report", folder)

    finished = command("verify", folder)
    assert finished.code == 1
    assert "results.json was changed" in finished.out


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "seal.json: expected the seal of a record, got No such file"),
        ("{", "seal.json: expected JSON, got what is none"),
        ("{}", "seal.json: files: expected results.json and others"),
        ('{"files": {"results.json": 5}}', "files.results.json: expected 64 hexadecimal digits"),
        ('{"files": {"results.json": "", "../x": ""}}', "expected 64 hexadecimal digits, got ''"),
    ],
)
def test_what_is_no_seal_gets_one_sentence(
    content: str | None, sentence: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    if content is not None:
        (tmp_path / "seal.json").write_text(content, encoding="ascii")

    finished = command("verify", tmp_path)

    assert finished.code == 3
    assert sentence in finished.err.replace("\n", " ")
