"""Recordings of simulated devices, judged: sound and defective ones, and files that are none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from junitparser import JUnitXml
from recorded_session import session, write

DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")
SHOWN = {"BOOT-01", "HB-01", "HB-05", "OD-01", "OD-03", "OD-05", "OD-09", "SDO-29", "TPDO-01"}
SHOWN |= {"TPDO-02", "TPDO-05"}


@pytest.mark.parametrize("ending", [".log", ".asc", ".blf"])
@pytest.mark.parametrize("device", DEVICES)
def test_nothing_fails_on_a_recording_of_a_sound_device(
    device: str, ending: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    recording = write(session(device), tmp_path / f"customer{ending}")

    finished = command("judge", recording, "--device", device, "--report-dir", tmp_path / "record")

    assert finished.code == 0
    assert finished.requirements("pass") >= SHOWN
    run = finished.record["run"]
    assert run["recording"] == f"customer{ending}"
    assert run["timestamps"] == {"by": "recording, origin unknown", "late_ms": 1.0}
    (suite,) = JUnitXml.fromfile(str(finished.folder / "junit.xml"))
    assert suite.failures == 0
    page = (finished.folder / "report.html").read_text(encoding="utf-8")
    assert "the recording does not show all cases" in page


@pytest.mark.parametrize(
    ("device", "fault", "requirements"),
    [
        ("siko_ims360", "heartbeat-slow-10-percent", {"HB-01"}),
        ("siko_ims360", "heartbeat-wrong-state", {"HB-05", "NMT-01"}),
        ("siko_ims360", "boot-up-twice", {"BOOT-01"}),
        ("siko_ims360", "sdo-wrong-size", {"SDO-01"}),
        ("baumer_gim140r", "accepts-read-only", {"OD-05"}),
        ("siko_ims360", "tpdo-timer-slow-10-percent", {"TPDO-02"}),
        ("danfoss_dst_x730", "tpdo-in-stopped", {"TPDO-01"}),
        ("baumer_gim140r", "tpdo-short", {"TPDO-05"}),
    ],
)
def test_a_defect_fails_the_requirement_it_offends(
    device: str,
    fault: str,
    requirements: set[str],
    command: Callable[..., Any],
    tmp_path: Path,
) -> None:
    recording = write(session(device, [fault]), tmp_path / "customer.log")

    finished = command("judge", recording, "--device", device, "--report-dir", tmp_path / "record")

    assert finished.code == 1
    assert finished.requirements("fail") == requirements


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("nothing.log", None, "expected a readable file, got No such file"),
        ("empty.log", b"", "expected CAN frames, got none"),
        ("text.log", b"what a day\n", "expected a candump log, got what cannot be read after 0"),
        ("time.log", b"(nan) can0 732#05 R\n", "frame 1: expected a time, got nan"),
        (
            "two.log",
            b"(1.0) can0 732#05\n(1.1) can1 732#05\n",
            "expected --channel, one of can0, can1",
        ),
        ("noise.blf", b"LOGG" + bytes(300), "expected "),
        ("noise.asc", b"\x00\xff\xfe" * 50, "expected "),
        (
            "recording.txt",
            b"",
            "expected a recording as candump log (.log), ASC (.asc), BLF (.blf)",
        ),
    ],
)
def test_a_file_that_is_no_recording_gets_one_sentence(
    name: str, content: bytes | None, sentence: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)

    finished = command("judge", path, "--device", "siko_ims360")

    assert finished.code == 3
    assert sentence in finished.err.replace("\n", " ")
    assert not (tmp_path / "reports").exists()


def test_a_recording_of_nothing_that_matters_decides_nothing(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    recording = tmp_path / "other.log"
    recording.write_text("(1.0) can0 701#05\n(1.1) can0 701#05\n", encoding="ascii")

    finished = command(
        "judge", recording, "--device", "siko_ims360", "--report-dir", tmp_path / "record"
    )

    assert finished.code == 2
    assert "what the recording shows does not decide it" in finished.err
