"""`commission` as a user types it, against simulated sensors in another process."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import pytest
from simulated_process import COMMAND, LOOPBACK, Process, simulating

BENCH = """format: 1
what: Sensors fresh from the box.
interface: socketcand
channel: can0
options: {{host: 127.0.0.1, port: {port}, tcp_tune: true}}
power: none
"""
DST, IMS = "danfoss_dst_x730", "siko_ims360"


def bench_of(process: Process, folder: Path) -> Path:
    path = folder / "bench.yaml"
    path.write_text(BENCH.format(port=process.port("socketcand")), encoding="utf-8")
    return path


def node_ids(process: Process) -> list[int]:
    return [it["node_id"] for it in process.call("held")]


def read_until(stream: IO[str], text: str) -> str:
    said = ""
    while text not in said:
        character = stream.read(1)
        assert character, said
        said += character
    return said


def test_a_person_connects_one_after_the_other_and_all_are_brought_back(tmp_path: Path) -> None:
    with simulating(DST, "--count", "2", "--socketcand", f"{LOOPBACK}:0") as process:
        process.call("connect", 0)
        bench = bench_of(process, tmp_path)
        with subprocess.Popen(
            [*COMMAND, "commission", DST, "--bench", bench, "--node-ids", "5,9,11"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
        ) as person:
            assert person.stdin is not None
            assert person.stdout is not None
            assert person.stderr is not None
            for nth, answer in enumerate(("\n", "\n", "\n", "q\n")):
                asked = read_until(person.stdout, "(q: no more): ")
                assert "fresh from the box" in asked
                process.call("connect", nth)  # the first Enter comes too early: nothing is there
                time.sleep(0.2)
                person.stdin.write(answer)
                person.stdin.flush()
            said, errors = person.communicate(timeout=60)
        assert person.returncode == 0, said + errors
        assert "node 127 does not answer" in errors
        assert node_ids(process) == [5, 9]
        record = json.loads((tmp_path / "commission.json").read_text("ascii"))
        assert [unit["state"] for unit in record["units"]] == ["given", "given"]

        back = subprocess.run(
            [*COMMAND, "commission", "--undo", "commission.json"],
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
            cwd=tmp_path,
        )

        assert back.returncode == 0, back.stdout + back.stderr
        assert node_ids(process) == [127, 127]


WRONG: list[tuple[tuple[str, ...], str]] = [
    ((), "DEVICE: expected a path or one of"),
    ((IMS, "--node-ids", "0-5"), "--node-ids: expected node-IDs from 1 to 127"),
    ((IMS, "--to-bitrate", "7"), "--to-bitrate: expected one of"),
    ((DST, "--to-bitrate", "7"), "--to-bitrate: expected one of"),
    ((IMS, "--bench", "socketcand", "--to-bitrate", "500000"), "is set up by others"),
    ((IMS, "--record", "nowhere/r.json"), "--record: expected a file in a folder that is there"),
    (("--undo", "none.json"), "--undo: expected the commission.json of a commissioning"),
]


@pytest.mark.parametrize(("arguments", "said"), WRONG)
def test_mistakes_get_a_sentence(
    arguments: tuple[str, ...], said: str, command: Callable[..., Any]
) -> None:
    done = command("commission", *arguments)

    assert done.code == 3
    assert said in done.err
    assert done.err.count("\n") == 1


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": 2}', '{"format": 1, "units": [{}]}'])
def test_a_damaged_record_gets_a_sentence(
    text: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "r.json").write_text(text, encoding="ascii")

    done = command("commission", "--undo", str(tmp_path / "r.json"))

    assert done.code == 3
    assert "r.json: " in done.err
    assert "expected a commissioning" in done.err


def test_a_record_is_not_written_over(command: Callable[..., Any], tmp_path: Path) -> None:
    place = {"node_id": 5, "bitrate": 125_000}
    unit = {"identity": [1, 2, 3, 4], "found": place, "given": place, "state": "given"}
    record = {"format": 1, "device": "d", "variant": "", "bench": "b", "units": [unit]}
    (tmp_path / "r.json").write_text(json.dumps(record), encoding="ascii")

    done = command("commission", IMS, "--record", str(tmp_path / "r.json"))

    assert done.code == 3
    assert "tells of sensors that were not brought back" in done.err
    assert json.loads((tmp_path / "r.json").read_text("ascii")) == record


def test_the_simulator_has_a_sensor_to_try_it_with(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    done = command("commission", "baumer_gim140r", "--record", str(tmp_path / "r.json"))

    assert done.code == 0
    assert "node-ID 2 at 250 kbit/s" in done.out
    assert "undo it with" in done.out


def test_ctrl_c_is_told_and_keeps_what_was_done(tmp_path: Path) -> None:
    with simulating(DST, "--socketcand", f"{LOOPBACK}:0") as process:
        bench = bench_of(process, tmp_path)
        with subprocess.Popen(
            [*COMMAND, "commission", DST, "--bench", bench],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
        ) as person:
            assert person.stdin is not None
            assert person.stdout is not None
            read_until(person.stdout, "(q: no more): ")
            person.stdin.write("\n")
            person.stdin.flush()
            read_until(person.stdout, "Connect sensor 2")
            person.send_signal(signal.SIGINT)
            said, errors = person.communicate(timeout=60)
        assert person.returncode == 2, said + errors
        assert errors.strip() == "error: interrupted"
        record = json.loads((tmp_path / "commission.json").read_text("ascii"))
        assert [unit["state"] for unit in record["units"]] == ["given"]
