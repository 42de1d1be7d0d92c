"""Python-can's own can_logger, can_player and can_viewer on the simulated device's lines."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import can
import pytest
from simulated_process import LOOPBACK, Process, simulating

DEVICE = "siko_ims360"
RESET = "000#8132"
ASK = "632#4000100000000000"
BEAT = "632#2B17100064000000"
BOOT_UP = "732#00"
PRE_OPERATIONAL = "732#7F"
ANSWER = "5B2#430010009A010307"
HEARTBEATS = 20
"""So many later a logger on a busy machine has written what came before."""

LIMIT_S = 60
INTERRUPTIBLE = """
import runpy, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
runpy.run_module(sys.argv.pop(1), run_name="__main__", alter_sys=True)
"""
"""A background job of a shell ignores SIGINT, and so would what it starts."""

Arguments = Callable[[Process, Path], Sequence[str]]


def on_socketcand(process: Process, _link: Path) -> Sequence[str]:
    server = [f"host={LOOPBACK}", f"port={process.port('socketcand')}"]
    return ["-i", "socketcand", "-c", "can0", "--bus-kwargs", *server]


def on_slcan(_process: Process, link: Path) -> Sequence[str]:
    return ["-i", "slcan", "-c", str(link), "-b", "125000"]


@contextmanager
def tool(
    name: str, *arguments: str, terminal: int | None = None
) -> Iterator[subprocess.Popen[str]]:
    """Run one of python-can's programs, in a terminal or with its output to be read."""
    out = subprocess.PIPE if terminal is None else terminal
    with subprocess.Popen(
        [sys.executable, "-u", "-c", INTERRUPTIBLE, f"can.{name}", *arguments],
        stdin=subprocess.DEVNULL if terminal is None else terminal,
        stdout=out,
        stderr=out if terminal is not None else subprocess.STDOUT,
        text=True,
        env=os.environ | {"TERM": "xterm", "LINES": "40", "COLUMNS": "120"},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def play(process: Process, link: Path, folder: Path, *frames: str) -> None:
    """Have can_player send frames, one each half second."""
    file = folder / "played.log"
    lines = [f"({nth / 2:.6f}) can0 {frame}\n" for nth, frame in enumerate(frames)]
    file.write_text("".join(lines), encoding="ascii")
    with tool("player", *on_socketcand(process, link), "--", str(file)) as player:
        said, _ = player.communicate(timeout=LIMIT_S)
    assert player.returncode == 0, said


def heard_until(bus: can.BusABC, last: str, count: int = 1) -> list[str]:
    """Return the frames on the bus until one came so many times, as candump has them."""
    heard: list[str] = []
    limit_s = time.monotonic() + LIMIT_S
    while heard.count(last) < count:
        assert time.monotonic() < limit_s, heard
        message = bus.recv(1)
        if message is not None:
            heard.append(f"{message.arbitration_id:03X}#{message.data.hex().upper()}")
    return heard


def since_reset(frames: list[str]) -> list[str]:
    """Return the frames from the reset to the answer."""
    return frames[frames.index(RESET) : frames.index(ANSWER) + 1]


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[Process, Path]]:
    link = tmp_path / "tty"
    lines = ["--slcan-pty", str(link), "--socketcand", f"{LOOPBACK}:0"]
    with simulating(DEVICE, *lines) as process:
        yield process, link


@pytest.mark.parametrize("line", [on_socketcand, on_slcan])
def test_the_logger_writes_what_the_device_sends(
    served: tuple[Process, Path], tmp_path: Path, line: Arguments
) -> None:
    process, link = served
    log = tmp_path / "logged.log"
    witness = can.Bus("can0", "socketcand", host=LOOPBACK, port=process.port("socketcand"))
    with witness, tool("logger", "-f", str(log), *line(process, link)) as logger:
        assert logger.stdout is not None
        started = any("Can Logger (Started" in it for it in iter(logger.stdout.readline, ""))
        assert started
        play(process, link, tmp_path, RESET)
        heard = heard_until(witness, RESET) + heard_until(witness, BOOT_UP)
        play(process, link, tmp_path, ASK, BEAT)
        heard += heard_until(witness, PRE_OPERATIONAL, HEARTBEATS)
        logger.send_signal(signal.SIGINT)
        assert logger.wait(LIMIT_S) == 0, logger.stdout.read()

    logged = re.findall(r"\S+#\S*", log.read_text("ascii"))
    assert since_reset(logged) == since_reset(heard)


def test_the_viewer_shows_what_the_device_sends(
    served: tuple[Process, Path], tmp_path: Path
) -> None:
    process, link = served
    ours, its = pty.openpty()
    with tool("viewer", *on_socketcand(process, link), terminal=its) as viewer:
        os.set_blocking(ours, False)
        shown, limit_s, again_s = "", time.monotonic() + LIMIT_S, 0.0
        wanted = ("0x5B2", "9A 01 03 07")
        while not all(it in shown for it in wanted):
            assert time.monotonic() < limit_s, shown
            assert viewer.poll() is None, shown
            try:
                shown += os.read(ours, 65536).decode("ascii", "replace")
            except BlockingIOError:
                time.sleep(0.1)
            if "Count" in shown and time.monotonic() > again_s:
                play(process, link, tmp_path, ASK)
                again_s = time.monotonic() + 5
        os.write(ours, b"q")
        assert viewer.wait(LIMIT_S) == 0
    os.close(its)
    os.close(ours)
