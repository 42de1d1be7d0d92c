"""A broken bench is blamed itself, never the device; what was found before is kept."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest

from conformance.errors import BenchError
from conformance.options import RunOptions
from conformance.run import Run
from conformance.runner import run
from conformance.simulator.interface import SimulatorBus


class PulledPlug(SimulatorBus):
    """Works for some frames, then fails in one way."""

    frames_left = 1500
    failing: str = "recv"

    def recv(self, timeout: float | None = None) -> can.Message | None:
        self.frames_left -= 1
        if self.frames_left < 0 and self.failing == "recv":
            raise can.CanOperationError("device disconnected")
        if self.frames_left < 0 and self.failing == "os":
            raise OSError(19, "No such device")
        return super().recv(timeout)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if self.frames_left < 0 and self.failing == "send":
            raise can.CanOperationError("transmit buffer full")
        super().send(msg, timeout)


@pytest.mark.parametrize(
    ("failing", "sentence"),
    [
        ("recv", "the adapter stopped receiving: device disconnected"),
        ("os", "the adapter stopped receiving: [Errno 19] No such device"),
        ("send", "the adapter did not send"),
    ],
)
def test_a_pulled_plug_ends_the_run_with_one_sentence(
    failing: str,
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def opened(*, ignore_config: bool, interface: str, **arguments: Any) -> PulledPlug:
        assert ignore_config
        assert interface == "canopen_simulator"
        bus = PulledPlug(**arguments)
        bus.failing = failing
        return bus

    monkeypatch.setattr(can, "Bus", opened)

    code = run(Run(RunOptions("siko_ims360", report_dir=tmp_path)))

    record = json.loads((tmp_path / "results.json").read_text("utf-8"))
    assert code == record["summary"]["exit_code"] == 2
    assert sentence in record["summary"]["aborted"]
    assert record["summary"]["complete"] is False
    assert record["summary"]["fail"] == 0
    assert record["summary"]["pass"] > 5
    assert sentence in capsys.readouterr().out


def test_a_full_disk_is_the_bench_that_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)

    code = run(Run(RunOptions("siko_ims360", report_dir=tmp_path, select="BOOT")))

    assert code == 2


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    made = Run(RunOptions("siko_ims360", report_dir=tmp_path / "file" / "below"))

    with pytest.raises(BenchError, match="cannot make"):
        made.open(1, ())


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "expected a bench definition, got an empty file"),
        ("format: 1\nwhat: x\n", "interface: expected this key, got nothing"),
        ("format: 1\nwhat: x\ninterface: virtual\nnode_id: 200\n", "bench.yaml:4: node_id:"),
        ("format: 1\nwhat: x\ninterface: virtual\nallow: [fly]\n", "bench.yaml:4: allow.0:"),
        (
            "format: 1\nwhat: x\ninterface: virtual\nbaud: 5\n",
            "bench.yaml:4: baud: expected a known",
        ),
    ],
)
def test_a_wrong_bench_file_gets_a_sentence(
    text: str, sentence: str, tmp_path: Path, command: Callable[..., Any]
) -> None:
    bench = tmp_path / "bench.yaml"
    bench.write_text(text, encoding="utf-8")

    finished = command("run", "siko_ims360", "--bench", bench)

    assert finished.code == 3
    assert sentence in finished.err


def test_what_a_bench_does_not_allow_is_skipped_and_said(
    tmp_path: Path, judge: Callable[..., Any]
) -> None:
    bench = tmp_path / "careful.yaml"
    bench.write_text(
        "format: 1\nwhat: read only\ninterface: canopen_simulator\nallow: [reads]\n",
        encoding="utf-8",
    )

    finished = judge("--bench", bench, "--select", "OD or BOOT")

    assert finished.code == 0
    assert {"OD-04", "OD-10", "OD-11", "BOOT-01"} <= finished.requirements("skipped")
    assert "skipped: the bench does not allow writes" in finished.out
    writes = [
        line
        for line in (finished.folder / "trace.log").read_text("ascii").splitlines()
        if " 632#2" in line
    ]
    assert writes == []
