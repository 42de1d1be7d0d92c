"""`recover` gives a device back as a run that was cut short had found it."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from killed_runs import BENCH, Killed, kill_one
from simulated_process import COMMAND, Process, simulating

from conformance.bench.given_back.journal import NAME, Found, Journal

KILLS = int(os.environ.get("KILLS", "1"))
"""Of each device; `make kills` has more."""

DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")
TIMER = (0x1800, 5)
LOSES = """format: 1
what: An answer to a store is among those that are lost.
inject: {sdo_loses_every: 8}
"""
LOSING = """format: 1
what: A simulated device that loses answers.
interface: canopen_simulator
channel: siko_ims360
options: {{faults: {fault}}}
allow: [reads, writes, resets, non-volatile]
"""
NODE_ID = 50


def said(killed: Killed) -> str:
    return f"{killed.select}, {killed.seconds} s: {killed.said}\nbefore {killed.before}\nafter  {killed.after}"


@pytest.mark.parametrize("seed", range(KILLS))
@pytest.mark.parametrize("device", DEVICES)
def test_a_run_that_was_killed_leaves_nothing_changed(
    device: str, seed: int, tmp_path: Path
) -> None:
    killed = kill_one(device, seed, tmp_path)
    assert killed.recovered, said(killed)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "bench.yaml").write_text(BENCH.format(link=tmp_path / "tty"), encoding="utf-8")
    return tmp_path


def recover(folder: Path) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [*COMMAND, "recover", folder], capture_output=True, text=True, check=False, timeout=240
    )
    assert "Traceback" not in done.stderr
    return done


def simulated(folder: Path, *arguments: str) -> Any:
    return simulating("siko_ims360", "--slcan-pty", str(folder / "tty"), *arguments)


def journal(folder: Path, settings: dict[tuple[int, int], bytes], **changes: Any) -> None:
    """Write a journal by which the device held some settings."""
    spec = Path(__file__).parents[2] / "device_specs" / "siko_ims360.yaml"
    made = Journal(str(spec), "one-axis", str(folder / "bench.yaml"), NODE_ID, 125_000, **changes)
    made.keep(folder / NAME, Found(settings, settings))


def wait_until(true: Callable[[], bool]) -> None:
    limit_s = time.monotonic() + 10
    while not true():
        assert time.monotonic() < limit_s
        time.sleep(0.05)


def changed(process: Process) -> dict[str, Any]:
    (held,) = process.call("held")
    content: dict[str, Any] = held["changed"]
    return content


def test_a_setting_is_stored_again(folder: Path) -> None:
    journal(folder, {TIMER: b"\x2c\x01"})
    with simulated(folder) as process:
        done = recover(folder)
        assert (done.returncode, done.stdout) == (0, "given back as it was found: 1 settings\n")
        assert process.call("held")[0]["memory"]["values"] == {"1800h:05": 300}
        assert json.loads((folder / NAME).read_text("ascii"))["given_back"] is True
        assert "nothing to recover" in recover(folder).stdout
    assert (folder / "recover.log").read_text("ascii").count("\n") > 5


def test_a_node_that_was_moved_is_found_and_brought_home(folder: Path) -> None:
    journal(folder, {(0x2001, 0): b"\x48\xe8\x01\0", (0x2002, 0): b"\x32"})
    with simulated(folder, "--node-id", "77", "--bitrate", "500000") as process:
        done = recover(folder)
        (held,) = process.call("held")
        assert done.returncode == 0, done.stdout + done.stderr
        assert (held["node_id"], held["bitrate"]) == (NODE_ID, 125_000)


def test_a_node_that_would_move_when_it_restarts_is_kept_home(folder: Path) -> None:
    """By LSS it was given a node-ID that is to be in force after the next reset."""
    journal(folder, {(0x2002, 0): b"\x32"})
    link = str(folder / "tty")
    with simulated(folder) as process:
        with can.Bus(link, "slcan", bitrate=125_000, sleep_after_open=0.5) as bus:
            for data in (b"\x04\x01", b"\x11\x33", b"\x04\x00"):
                message = can.Message(0, 0x7E5, is_extended_id=False, data=data.ljust(8, b"\0"))
                bus.send(message)
                bus.recv(0.2)
        done = recover(folder)
        assert done.returncode == 0, done.stdout + done.stderr
        with can.Bus(link, "slcan", bitrate=125_000, sleep_after_open=0.1) as bus:
            bus.send(can.Message(0, 0, is_extended_id=False, data=[129, 0]))
            heard = {message.arbitration_id for message in iter(lambda: bus.recv(1), None)}
        assert heard == {0x700 + NODE_ID}
        assert process.call("held")[0]["node_id"] == NODE_ID


def test_what_the_node_does_not_take_is_told(folder: Path) -> None:
    journal(folder, {TIMER: b"\x2c\x01"})
    with simulated(folder, "--fault", "store-refused"):
        done = recover(folder)
    assert done.returncode == 2
    assert "does not take everything back: set it by hand" in done.stderr
    assert "1800h:05" in done.stdout
    assert "2C 01" in done.stdout


def test_nothing_is_said_but_our_own_sentences(folder: Path) -> None:
    """Python-canopen has a word of its own for each answer that does not come."""
    journal(folder, {TIMER: b"\x2c\x01"})
    fault = folder / "fault.yaml"
    fault.write_text(LOSES, encoding="utf-8")
    (folder / "bench.yaml").write_text(LOSING.format(fault=fault), encoding="utf-8")
    done = recover(folder)
    assert done.returncode == 2
    assert "no usable SDO response to download 1010h:01" in done.stdout
    assert [line[:6] for line in done.stderr.splitlines()] == ["error:"]


def test_a_bench_that_is_gone_is_told(folder: Path) -> None:
    journal(folder, {})
    done = recover(folder)
    assert done.returncode == 2
    assert "cannot open the bus" in done.stderr


def test_a_journal_of_another_spec_is_told(folder: Path) -> None:
    journal(folder, {(0x2FFF, 1): b"\0"})
    done = recover(folder)
    assert done.returncode == 3
    assert "expected the spec that the run was judged by, got one without 2FFFh:01" in done.stderr


def test_a_folder_without_a_journal_is_told(folder: Path) -> None:
    done = recover(folder)
    assert done.returncode == 3
    assert "JOURNAL: expected the folder of a run" in done.stderr
