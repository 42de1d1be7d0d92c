"""`inspect` with a person at a bench, sensors in another process, and what a killed inspection leaves."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from pathlib import Path
from typing import IO, Any

import pytest
from simulated_process import COMMAND, LOOPBACK, Process, simulating

IMS = "siko_ims360"
BENCH = """format: 1
what: The inspection desk.
interface: socketcand
channel: can0
options: {{host: 127.0.0.1, port: {port}, tcp_tune: true}}
power: none
"""
LOT = "format: 1\npart: Inclinometer\norder: order 17\ndevice: siko_ims360\nlevel: all\n"


def written(folder: Path, text: str, process: Process | None = None) -> Path:
    if process is not None:
        bench = BENCH.format(port=process.port("socketcand"))
        (folder / "bench.yaml").write_text(bench, encoding="utf-8")
        text += "bench: bench.yaml\n"
        text = text.replace("bench.yaml", "./bench.yaml")
    path = folder / "lot.yaml"
    path.write_text(LOT + text, encoding="utf-8")
    return path


def inspecting(lot: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*COMMAND, "inspect", lot, "--report-dir", lot.parent / "record"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=lot.parent,
    )


def read_until(stream: IO[str] | None, text: str) -> str:
    assert stream is not None
    said = ""
    while text not in said:
        character = stream.read(1)
        assert character, said
        said += character
    return said


def state(lot: Path) -> dict[str, Any]:
    text = (lot.parent / "record" / "lot.json").read_text("ascii")
    content: dict[str, Any] = json.loads(text)
    return content


def test_a_person_connects_one_unit_after_the_other_and_stops_between(tmp_path: Path) -> None:
    with simulating(IMS, "--socketcand", f"{LOOPBACK}:0") as process:
        lot = written(tmp_path, "serials: [1, 2]\nselect: OD-09\n", process)
        with inspecting(lot) as person:
            assert person.stdin is not None
            asked = read_until(person.stdout, "(q: stop here)")
            assert "connect unit 1, and no other" in asked
            person.stdin.write("\n")
            person.stdin.flush()
            said = read_until(person.stdout, "connect unit 2, and no other")
            assert "1/2  1  conforming" in said
            _, errors = person.communicate("q\n", timeout=60)
        assert person.returncode == 2
        assert "not decided yet" in errors
        assert [it["verdict"] for it in state(lot)["units"]] == ["conforming", None]

        with inspecting(lot) as person:  # the same sensor again, instead of unit 2
            said, errors = person.communicate("\n", timeout=60)
        assert person.returncode == 2, errors
        assert "connect unit 2" in said
        assert "connect unit 1" not in said
        assert "2/2  2  undecided  the sensor on the bus is 1, not 2" in said


def test_units_on_one_bus_are_judged_at_their_node_ids(tmp_path: Path) -> None:
    with simulating(IMS, "--nodes", "10-11", "--socketcand", f"{LOOPBACK}:0") as process:
        lot = written(tmp_path, "serials: [1, 2]\nnode_ids: 10-11\nselect: OD-01\n", process)
        with inspecting(lot) as person:
            said, errors = person.communicate("\n", timeout=60)
        assert person.returncode == 0, said + errors
        assert "connect unit 1 as node 10, unit 2 as node 11, and no other" in said
        tries = [it["tries"][0] for it in state(lot)["units"]]
        assert [(it["node_id"], it["serial"]) for it in tries] == [(10, "1"), (11, "2")]


def test_where_nobody_connects_a_unit_the_bench_has_failed(tmp_path: Path) -> None:
    with simulating(IMS, "--socketcand", f"{LOOPBACK}:0") as process:
        lot = written(tmp_path, "size: 2\nselect: OD-09\n", process)
        with inspecting(lot) as person:
            _, errors = person.communicate("", timeout=60)
    assert person.returncode == 2
    assert "nobody is there to connect the units" in errors


def test_a_second_process_keeps_off_an_inspection_that_goes_on(tmp_path: Path) -> None:
    with simulating(IMS, "--socketcand", f"{LOOPBACK}:0") as process:
        lot = written(tmp_path, "size: 2\nselect: OD-09\n", process)
        with inspecting(lot) as first:
            read_until(first.stdout, "(q: stop here)")
            with inspecting(lot) as second:
                said, errors = second.communicate(timeout=60)
            first.communicate("q\n", timeout=60)
    assert second.returncode == 2
    assert said == ""
    assert "goes on in another window or process" in " ".join(errors.split())
    assert "Traceback" not in errors


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGINT])
def test_an_inspection_that_is_ended_in_a_run_goes_on_with_that_unit(
    tmp_path: Path, end: signal.Signals
) -> None:
    lot = written(tmp_path, "size: 3\nselect: HB or TPDO or OD\n")
    with inspecting(lot) as first:
        read_until(first.stdout, "1/3  1  conforming")
        while not (tmp_path / "record/units/2-1/results.json").exists():
            time.sleep(0.01)
        first.send_signal(end)
        _, errors = first.communicate(timeout=60)
    assert first.returncode == (2 if end is signal.SIGINT else -signal.SIGKILL)
    assert ("interrupted: inspect the lot again" in errors) == (end is signal.SIGINT)
    before = state(lot)
    assert [len(it["tries"]) for it in before["units"]] == [1, 0, 0]
    assert before["running"] == [{"unit": 2, "folder": "units/2-1"}]

    with inspecting(lot) as second:
        said, errors = second.communicate(timeout=120)
    assert second.returncode == 0, said + errors
    assert "the run of unit 2 was broken off, and is run again" in errors
    after = state(lot)
    assert after["units"][0] == before["units"][0]
    assert after["units"][1]["tries"][0]["folder"] == "units/2-1-again"
    assert after["verdict"]["word"] == "accepted"
