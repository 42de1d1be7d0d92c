"""Runs over a real line that are killed somewhere, and what `recover` makes of the device then."""

from __future__ import annotations

import random
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simulated_process import COMMAND, Process, simulating

from conformance.bench.given_back.journal import NAME

BENCH = """format: 1
what: One device behind an slcan adapter, which may be changed in every way and is given back.
interface: slcan
channel: {link}
options: {{sleep_after_open: 0.01}}
timestamp_jitter_ms: 0
power: none
allow: [reads, writes, resets, restores, non-volatile, node-id, bitrate, other-nodes]
"""
SELECTIONS = (
    "STO",
    "RST",
    "NID",
    "BIT",
    "LSS-15 or LSS-16 or LSS-19",
    "OD-10 or OD-11",
    "TPDO",
    "DEV",
)
"""What runs consist of; most of it changes the device for a while."""
LONGEST_S = 240
LONGEST_RUN_S = 8.0


@dataclass(frozen=True)
class Killed:
    """A run that was killed, and its device.

    Args:
        select: What was run.
        seconds: How long it had the node when it was killed.
        changed: It left the device changed.
        code: Exit code of `recover`.
        said: What it said.
        before: What the device held before the run.
        after: What it holds after the recovery.
    """

    select: str
    seconds: float
    changed: bool
    code: int
    said: str
    before: Any
    after: Any

    @property
    def recovered(self) -> bool:
        return self.code == 0 and self.before == self.after


def kill_one(device: str, seed: int, folder: Path) -> Killed:
    """Run a selection against a device, kill the run somewhere, recover; tell what became of it.

    Args:
        device: Name of the spec.
        seed: Of what is run, and of the place where it is killed.
        folder: Where the records go.
    """
    draw = random.Random(f"{device} {seed}")  # noqa: S311 - repeatable
    link, bench = folder / "tty", folder / "bench.yaml"
    bench.write_text(BENCH.format(link=link), encoding="utf-8")
    select = draw.choice(SELECTIONS)
    with simulating(device, "--slcan-pty", str(link)) as process:
        time.sleep(0.5)
        before = _holds(process)
        record, seconds = _run_and_kill(
            draw, folder, ["run", device, "--bench", str(bench), "--select", select]
        )
        changed = _holds(process) != before
        done = subprocess.run(
            [*COMMAND, "recover", record],
            capture_output=True,
            text=True,
            check=False,
            timeout=LONGEST_S,
        )
        return Killed(
            select=select,
            seconds=seconds,
            changed=changed,
            code=done.returncode,
            said=done.stdout + done.stderr,
            before=before,
            after=_holds(process),
        )


def _run_and_kill(
    draw: random.Random, folder: Path, arguments: Sequence[str]
) -> tuple[Path, float]:
    """Run until a run could be killed; return its record, and how long it had the node.

    One that ends before it was to be killed is no kill: the next is given less time than it took.
    """
    longest_s = LONGEST_RUN_S
    nth = 0
    while True:
        nth += 1
        record = folder / f"run-{nth}"
        run = subprocess.Popen(
            [*COMMAND, *arguments, "--report-dir", record],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        _wait_for(record / NAME, run)
        began_s = time.monotonic()
        seconds = draw.uniform(0, longest_s)
        try:
            run.wait(seconds)
        except subprocess.TimeoutExpired:
            run.send_signal(signal.SIGKILL)
            run.wait()
            return record, seconds
        assert (record / NAME).exists(), f"the run ended with {run.returncode} before it began"
        longest_s = time.monotonic() - began_s


def _holds(process: Process) -> Any:
    """Return what the device holds, apart from how often it was written to."""
    return process.call("held")


def _wait_for(path: Path, run: subprocess.Popen[bytes]) -> None:
    limit_s = time.monotonic() + LONGEST_S
    while not path.exists() and run.poll() is None and time.monotonic() < limit_s:
        time.sleep(0.02)
