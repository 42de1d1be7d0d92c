"""EDS on the command line: in and out, diff, and a run against one."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from conformance.resources import data, names
from conformance.spec.eds.to_spec import import_eds
from conformance.spec.eds.writer import to_eds
from conformance.spec.load import load_spec

DEVICES = names("device_specs")
FIRST = "siko_ims360"


def exported(folder: Path, device: str = FIRST) -> Path:
    eds = folder / "device.eds"
    file = load_spec(data("device_specs") / f"{device}.yaml")
    eds.write_bytes(to_eds(file, None, None, eds.name, datetime.now(UTC)).encode())
    return eds


def replaced(path: Path, old: str, new: str) -> None:
    text = path.read_bytes().decode()
    assert re.search(old, text)
    path.write_bytes(re.sub(old, new, text, count=1).encode())


def imported(folder: Path, device: str) -> Path:
    spec = folder / "imported.yaml"
    spec.write_text(import_eds(exported(folder, device)).text, encoding="utf-8")
    return spec


@pytest.mark.parametrize("device", DEVICES)
def test_a_device_as_its_eds_says_conforms_to_it(
    device: str, judge: Callable[..., Any], tmp_path: Path
) -> None:
    spec = imported(tmp_path, device)

    finished = judge(device=spec)

    assert finished.items("fail") == finished.items("inconclusive") == []
    assert finished.code == 0
    assert finished.record["device"]["manual"] == "EDS device.eds 1.0"


def test_a_deviation_from_an_imported_spec_cites_the_line(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    spec = imported(tmp_path, FIRST)

    finished = judge("--select", "OD-10/1017h", "--fault", "wrong-heartbeat-default", device=spec)

    (item,) = finished.record["items"]
    line = int(re.fullmatch(r"EDS device.eds 1.0, line (\d+)", item["source"])[1])  # type: ignore[index]  # None fails as well
    assert (tmp_path / "device.eds").read_text("utf-8").split("\n")[line - 1] == "[1017]"


def test_the_device_of_the_manual_conforms_to_its_eds(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    spec = imported(tmp_path, FIRST)

    finished = judge("--simulate-spec", FIRST, "--node-id", "50", device=spec)

    assert finished.items("fail") == []
    undecided = finished.items("inconclusive")
    assert "HB-01/1017h/3ms" in undecided
    assert {item.split("/")[1] for item in undecided} == {"1017h"}, "whose minimum no EDS holds"


def test_from_eds_writes_a_new_file_and_warns_by_line(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    eds, spec = tmp_path / "a.eds", tmp_path / "a.yaml"
    eds.write_bytes(b"[1000]\nParameterName=T\xfcr\nDataType=7\nAccessType=RO\nDefaultValue=010\n")

    first = command("spec", "from-eds", eds, "--output", spec)
    again = command("spec", "from-eds", eds, "--output", spec)

    assert (first.code, first.out) == (0, "")
    assert f"warning: {eds}:5: 1000.DefaultValue: expected a number without" in first.err
    assert 'name: "Tür"' in spec.read_text("utf-8")
    assert again.code == 3
    assert "--output: expected a new file, got" in again.err


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["spec", "from-eds", "empty.eds"], "empty.eds:1: expected a section such as"),
        (["spec", "diff", FIRST, "empty.eds"], "empty.eds:1: expected a section such as"),
        (["spec", "to-eds", FIRST, "--node-id", "128"], "--node-id: expected 1 to 127, got 128"),
        (["spec", "to-eds", FIRST, "--output", "no/such.eds"], "--output: cannot write no/such"),
        (["run", FIRST, "--eds", "empty.eds"], "empty.eds:1: expected a section such as"),
    ],
)
def test_a_mistake_gets_one_sentence_and_exit_code_3(
    arguments: list[str], sentence: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "empty.eds").write_text("\n", encoding="utf-8")

    finished = command(*arguments)

    assert finished.code == 3
    assert sentence in finished.err
    assert finished.err.count("error:") == 1
    assert not (tmp_path / "reports").exists()


def test_diff_tells_a_doctored_eds_from_the_manual(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    eds = exported(tmp_path)
    replaced(eds, r"(?s)(\[1017\].*?)DataType=0x0006", r"\1DataType=0x0007")

    table = command("spec", "diff", FIRST, eds)
    page = command("spec", "diff", FIRST, eds, "--format", "json")

    assert table.code == page.code == 1
    assert re.search(r"1017h +type +UNSIGNED16 +7.2.11 +UNSIGNED32 +\d+ *\n", table.out)
    (row,) = json.loads(page.out)["differences"]
    assert (row["object"], row["manual"], row["eds"]) == ("1017h", "UNSIGNED16", "UNSIGNED32")
    assert "DataType=0x0007" in eds.read_text("utf-8").split("\n")[row["line"] - 1]


def test_run_with_an_eds_says_who_stands_alone(judge: Callable[..., Any], tmp_path: Path) -> None:
    eds = exported(tmp_path)
    arguments = ("--select", "OD-10/1017h", "--fault", "wrong-heartbeat-default", "--eds", eds)

    device_alone = judge(*arguments)
    replaced(eds, r"(?s)(\[1017\].*?)DefaultValue=0", r"\1DefaultValue=1000")
    manual_alone = judge(*arguments)

    assert device_alone.code == manual_alone.code == 1
    assert "manual and EDS agree: the device stands alone" in device_alone.out
    assert "device and EDS agree: the manual stands alone" in manual_alone.out
    (item,) = manual_alone.record["items"]
    assert "default 1000 (3E8h)" in item["eds"]["says"]
    junit = (manual_alone.folder / "junit.xml").read_text("utf-8")
    assert "default 1000 (3E8h)" in junit
    assert "the manual stands alone" in junit
    assert manual_alone.record["run"]["eds"] == "device.eds"


def test_without_an_eds_no_word_is_recorded(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "OD-10/1017h", "--fault", "wrong-heartbeat-default")

    assert [item["eds"] for item in finished.record["items"]] == [{}]


def test_to_eds_from_eds_and_diff_fit_together(command: Callable[..., Any], tmp_path: Path) -> None:
    spec, eds, back = tmp_path / "own.yaml", tmp_path / "own.eds", tmp_path / "back.yaml"
    spec.write_bytes((data("device_specs") / f"{FIRST}.yaml").read_bytes())

    assert command("spec", "to-eds", spec, "--output", eds).code == 0
    assert "FileName=own.eds" in eds.read_text("utf-8")
    assert command("spec", "diff", spec, eds).code == 0
    assert command("spec", "from-eds", eds, "--output", back).code == 0
    assert command("spec", "lint", back).code == 0
