"""`doctor` and `benches` as users know them, on buses that are well and on those that are not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from simulated_process import LOOPBACK, simulating

DEVICE = "siko_ims360"
NODE_ID = 50


def write_bench(folder: Path, text: str) -> Path:
    path = folder / "bench.yaml"
    path.write_text(f"format: 1\nwhat: made for a test\n{text}\n", "utf-8")
    return path


def test_benches_are_listed(command: Callable[..., Any]) -> None:
    finished = command("benches")
    assert finished.code == 0
    assert "candlelight" in finished.out
    assert "gs_usb" in finished.out


def test_the_simulator_is_well(command: Callable[..., Any]) -> None:
    finished = command("doctor", "--device", DEVICE, "--ask")
    assert finished.code == 0, finished.err
    assert f"node {NODE_ID} answers" in finished.out
    assert DEVICE in finished.out


def test_the_simulator_needs_a_device(command: Callable[..., Any]) -> None:
    finished = command("doctor")
    assert finished.code == 3
    assert "--device: expected" in finished.err


def test_a_wrong_bit_rate_is_suspected_with_evidence(command: Callable[..., Any]) -> None:
    finished = command("doctor", "--device", DEVICE, "--bitrate", "250000")
    assert finished.code == 2
    assert "wrong bit rate: nothing was heard at 250000 bit/s" in finished.err
    assert "give --bitrate 125000" in finished.err


def test_a_silent_bus(command: Callable[..., Any], tmp_path: Path) -> None:
    bench = write_bench(tmp_path, "interface: virtual\nchannel: nobody")
    finished = command("doctor", "--bench", bench, "--seconds", "0.2", "--json")
    assert finished.code == 2
    assert "the bus is silent" in finished.err
    facts = json.loads(finished.out)
    assert facts["heard"]["frames"] == 0
    assert facts["allow"] == ["reads", "writes", "resets"]
    assert facts["waits"]["longest"] >= facts["waits"]["p50"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("interface: no_such", "python-can has no interface 'no_such'; it has: "),
        ("interface: gs_usb\nchannel: 0", "the driver of interface gs_usb is missing"),
        ("interface: slcan\nchannel: /dev/no-such-tty", "channels that python-can finds here"),
    ],
)
def test_a_bus_that_cannot_be_opened(
    text: str, said: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    finished = command("doctor", "--bench", write_bench(tmp_path, text))
    assert finished.code == 2
    assert said in finished.err


def test_a_node_behind_socketcand(command: Callable[..., Any], tmp_path: Path) -> None:
    with simulating(DEVICE, "--socketcand", f"{LOOPBACK}:0") as process:
        where = f"{{host: {LOOPBACK}, port: {process.port('socketcand')}}}"
        text = f"interface: socketcand\nchannel: can0\noptions: {where}"
        bench = write_bench(tmp_path, text)
        finished = command(
            "doctor", "--bench", bench, "--device", DEVICE, "--seconds", "0.5", "--ask", "--json"
        )
    assert finished.code == 0, finished.err
    facts = json.loads(finished.out)
    assert any(kind.startswith(DEVICE) for kind in facts["kinds"][str(NODE_ID)])
    assert facts["asked"][str(NODE_ID)]["1018h:04"] == "00000001h"
    assert facts["skipped"]["runs"] > 0
    assert len(facts["skipped"]) > 1


def test_a_wrong_bit_rate_of_an_slcan_adapter(command: Callable[..., Any], tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with simulating(DEVICE, "--slcan-pty", str(link)):
        text = f"interface: slcan\nchannel: {link}\noptions: {{sleep_after_open: 0.1}}"
        finished = command(
            "doctor",
            "--bench",
            write_bench(tmp_path, text),
            "--bitrate",
            "250000",
            "--seconds",
            "0.3",
        )
    assert finished.code == 2
    assert "silent" in finished.err or "give --bitrate 125000" in finished.err
