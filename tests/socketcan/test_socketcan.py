"""The suite and a device as two processes on a real SocketCAN, in a guest."""

from __future__ import annotations

import json
import os
import re
import sys
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
import vcan_guest
import vcan_run

RUNNING = Path(vcan_run.__file__).parent
LINE = re.compile(r"\([\d.]+\) \w+ ([0-9A-F]+#\w*)")
LONGEST_S = 900
DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")


def guest(script: str, *arguments: str, folder: Path) -> vcan_guest.Done:
    """Run a script of this folder in a guest; never skipped in CI."""
    if lacking := vcan_guest.missing():
        assert not os.environ.get("CI"), f"CI needs what is missing here: {lacking}"
        pytest.skip(f"no SocketCAN guest without {lacking} (Debian: user-mode-linux, can-utils)")
    folder.mkdir(exist_ok=True)
    command: list[str | Path] = [sys.executable, RUNNING / script, *arguments, folder]
    return vcan_guest.in_guest(command, folder, LONGEST_S)


def by_identifier(log: Path) -> dict[tuple[str, bool], list[str]]:
    """Return the frames of a log in candump's format, by their identifier, remote frames for themselves.

    Each is sent by one side alone; what both sides send at the same moment is noted in either order.
    """
    frames: dict[tuple[str, bool], list[str]] = defaultdict(list)
    for frame in LINE.findall(log.read_text("ascii")):
        identifier, _, data = frame.partition("#")
        frames[identifier, data.startswith("R")].append(frame)
    return frames


def undecided(folder: Path) -> list[dict[str, Any]]:
    record = json.loads((folder / "record" / "results.json").read_text("utf-8"))
    assert record["summary"]["aborted"] == ""
    assert record["summary"]["left_changed"] == ""
    return [it for it in record["items"] if it["verdict"] in ("fail", "inconclusive")]


@pytest.mark.timeout(3 * LONGEST_S)
def test_whole_runs_over_socketcan(tmp_path: Path) -> None:
    """Each device in a guest of its own, all at once: most of their time they wait."""
    with ThreadPoolExecutor() as pool:
        for left in pool.map(run_whole, DEVICES, [tmp_path / it for it in DEVICES]):
            assert left == ""
    for device in DEVICES:
        require_same_frames(tmp_path / device / "whole")


def run_whole(device: str, folder: Path) -> str:
    """Return what has not passed, in a second attempt neither, and is no matter of milliseconds.

    What stands for a device is a process on a busy machine: what was late proves nothing.
    """
    folder.mkdir()
    done = guest("vcan_run.py", device, "", folder=folder / "whole")
    left = undecided(folder / "whole")
    if left:
        guest("vcan_run.py", device, select(left), folder=folder / "again")
        left = [it for it in undecided(folder / "again") if not is_of_time(it)]
    return f"{select(left)}\n{done.out}" if left else ""


def is_of_time(item: dict[str, Any]) -> bool:
    words = " ".join((item["quantity"], item["expected"], item["actual"], item["reason"]))
    return re.search(r"\d m?s\b", words) is not None


def require_same_frames(folder: Path) -> None:
    """Require that candump saw the frames that the record has."""
    seen, ours = (by_identifier(folder / it) for it in ("candump.log", "record/trace.log"))
    assert sum(map(len, ours.values())) > 5000
    for identifier, frames in ours.items():
        first = seen[identifier].index(frames[0])
        assert seen[identifier][first : first + len(frames)] == frames


def select(items: Iterable[dict[str, Any]]) -> str:
    return " or ".join(it["id"] for it in items)


def test_an_slcan_line_as_an_interface_with_its_bit_rate(tmp_path: Path) -> None:
    done = guest("slcan_interface.py", "125000", folder=tmp_path / "job")
    assert done.code == 0, done.out
    assert "632   [8]  40 00 10 00 00 00 00 00" in done.out
    assert "5B2   [8]  43 00 10 00 9A 01 03 07" in done.out


def test_an_slcan_line_with_the_wrong_bit_rate(tmp_path: Path) -> None:
    done = guest("slcan_interface.py", "250000", folder=tmp_path / "job")
    assert done.code == 0, done.out
    assert "632   [8]" in done.out
    assert "5B2" not in done.out
