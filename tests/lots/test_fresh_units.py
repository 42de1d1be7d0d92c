"""Units fresh from the box, all with one node-ID, that are commissioned while they are judged."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from simulated_process import COMMAND, LOOPBACK, simulating

LOT = """format: 1
part: Inclinometer
order: order 17
device: {device}
level: all
node_ids: 11-13
commission: true
select: {select}
"""
SEARCHED, NUMBERED, ALIKE = "baumer_gim140r", "siko_ims360", "danfoss_dst_x730"


def written(folder: Path, device: str, more: str, select: str = "OD-09 or HB-01") -> Path:
    path = folder / "lot.yaml"
    path.write_text(LOT.format(device=device, select=select) + more, encoding="utf-8")
    return path


def state(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "record/lot.json").read_text("ascii"))
    return content


def verdicts(folder: Path) -> dict[int, tuple[str, int]]:
    """Return each unit's verdict, and the node-ID at which it was judged."""
    return {
        it["unit"]: (it["verdict"], it["tries"][-1]["node_id"]) for it in state(folder)["units"]
    }


def commissioned(folder: Path, nth: int) -> list[tuple[int, str]]:
    """Return who was commissioned in a group, and how far each came."""
    content = json.loads((folder / f"record/commissioned/{nth}.json").read_text("ascii"))
    return [(it["identity"][3], it["state"]) for it in content["units"]]


@pytest.mark.parametrize(
    ("device", "units", "place"),
    [
        pytest.param(NUMBERED, "serials: [1, 2, 3, 4]", 50, id="by the serial numbers told"),
        pytest.param(ALIKE, "size: 4", 12, id="one by one"),
    ],
)
def test_units_of_one_node_id_are_judged_at_their_own(
    command: Callable[..., Any], tmp_path: Path, device: str, units: str, place: int
) -> None:
    faults = "\nsimulation: {faults: {2: [wrong-identity]}}\n"
    done = command(
        "inspect", written(tmp_path, device, units + faults), "--report-dir", tmp_path / "record"
    )
    assert done.code == 1, done.out + done.err
    assert verdicts(tmp_path) == {
        1: ("conforming", 11),
        2: ("nonconforming", place),
        3: ("conforming", 13),
        4: ("conforming", 11),
    }
    assert {it for it in commissioned(tmp_path, 1) if it[1] != "planned"} >= {
        (1, "undone"),
        (3, "undone"),
    }
    assert commissioned(tmp_path, 2) == [(4, "undone")]


def test_the_one_that_a_search_does_not_find_is_judged_where_it_is(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    faults = "size: 3\nsimulation: {faults: {2: [wrong-identity]}}\n"
    done = command(
        "inspect", written(tmp_path, SEARCHED, faults), "--report-dir", tmp_path / "record"
    )
    assert done.code == 1, done.out + done.err
    assert commissioned(tmp_path, 1) == [(1, "undone"), (3, "undone")]
    assert verdicts(tmp_path) == {
        1: ("conforming", 11),
        2: ("conforming", 12),
        3: ("nonconforming", 1),
    }
    assert "unit 2 is node 12 meanwhile (serial 3)" in done.out


def test_several_that_cannot_be_told_apart_are_judged_alone(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    faults = "serials: [1, 2, 3]\nsimulation: {faults: {2: [wrong-identity], 3: [wrong-identity]}}"
    done = command(
        "inspect", written(tmp_path, NUMBERED, faults), "--report-dir", tmp_path / "record"
    )
    assert done.code == 1, done.out + done.err
    assert verdicts(tmp_path) == {
        1: ("conforming", 11),
        2: ("nonconforming", 50),
        3: ("nonconforming", 50),
    }


@pytest.mark.parametrize(
    ("device", "more", "says"),
    [
        (NUMBERED, "node_ids: null", "expected node_ids to give beside commission, got none"),
        (NUMBERED, "node_ids: 49-51", "expected none that units have fresh from the box, got 50"),
        (
            NUMBERED,
            "bench: simulator-real-time",
            "commission: expected the simulator on its virtual clock, got 'simulator-real-time'",
        ),
    ],
)
def test_a_lot_file_that_cannot_be_followed(
    command: Callable[..., Any], tmp_path: Path, device: str, more: str, says: str
) -> None:
    path = written(tmp_path, device, "size: 2\n")
    key = more.partition(":")[0]
    lines = [it for it in path.read_text("utf-8").splitlines() if not it.startswith(key)]
    path.write_text("\n".join([*lines, more, ""]), encoding="utf-8")
    done = command("inspect", path, "--report-dir", tmp_path / "record")
    assert done.code == 3
    assert says in " ".join(done.err.split())
    assert not (tmp_path / "record").exists()


BENCH = """format: 1
what: The inspection desk.
interface: socketcand
channel: can0
options: {{host: 127.0.0.1, port: {port}, tcp_tune: true}}
power: none
"""


def ended(folder: Path, unit: int) -> dict[str, Any]:
    """Return what a unit's run came to, once it is over."""
    path = folder / f"record/units/{unit}-1/results.json"
    deadline_s = time.monotonic() + 60
    while time.monotonic() < deadline_s:
        content = json.loads(path.read_text("utf-8")) if path.exists() else {"run": {}}
        if "finished" in content["run"]:
            return dict(content["summary"])
        time.sleep(0.05)
    raise TimeoutError(path)


def test_a_person_connects_them_and_a_killed_inspection_tells_how_they_are_brought_back(
    tmp_path: Path,
) -> None:
    with simulating(SEARCHED, "--count", "2", "--socketcand", f"{LOOPBACK}:0") as process:
        bench = BENCH.format(port=process.port("socketcand"))
        (tmp_path / "bench.yaml").write_text(bench, encoding="utf-8")
        lot = written(tmp_path, SEARCHED, "size: 2\nbench: ./bench.yaml\n", "OD")
        arguments: list[str | Path] = ["inspect", lot, "--report-dir", tmp_path / "record"]
        with subprocess.Popen(
            [*COMMAND, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as person:
            assert person.stdin is not None
            assert person.stdout is not None
            person.stdin.write("\n")
            person.stdin.flush()
            said = ""
            while "unit 2 is node" not in said:
                line = person.stdout.readline()
                assert line, said
                said += line
            assert "connect unit 1, unit 2 fresh from the box, and no other" in said
            begun = [tmp_path / f"record/units/{unit}-1/trace.log" for unit in (1, 2)]
            while not all(it.exists() for it in begun):
                time.sleep(0.05)
            time.sleep(0.5)
            person.send_signal(signal.SIGKILL)
        for unit in (1, 2):
            assert ended(tmp_path, unit)["aborted"].startswith("interrupted")
        assert commissioned(tmp_path, 1) == [(1, "given"), (2, "given")]
        told = subprocess.run(
            [*COMMAND, *arguments],
            input="q\n",
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
        )
        assert "units are not back where they were" in told.stderr
        undo: list[str | Path] = ["commission", "--undo", tmp_path / "record/commissioned/1.json"]
        assert " ".join(map(str, undo)) in " ".join(told.stderr.split()).replace("/ ", "/")
        back = subprocess.run(
            [*COMMAND, *undo], capture_output=True, text=True, check=False, timeout=120
        )
        assert back.returncode == 0, back.stderr
        assert commissioned(tmp_path, 1) == [(1, "undone"), (2, "undone")]
