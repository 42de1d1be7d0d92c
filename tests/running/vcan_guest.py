"""A guest with the SocketCAN of a real Linux kernel, in which commands run over the host's files.

Debian's `user-mode-linux` is a Linux kernel as a program; it needs no rights and no CAN in the host's own
kernel. The host's files are its root, read-only but for one folder. By hand:

    python tests/running/vcan_guest.py FOLDER COMMAND [ARGUMENT...]

runs a command in a guest and in a folder that it may write to, and ends with its exit code.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

MODULES = Path("/usr/lib/uml/modules")
NEEDED = (
    *("net/can/can", "net/can/can-raw", "net/can/can-bcm"),
    *("drivers/net/can/dev/can-dev", "drivers/net/can/slcan/slcan", "drivers/net/can/vcan"),
)
PROGRAMS = ("linux.uml", "candump", "cansend", "slcand", "ip")
FINIT_MODULE = 313
POWER_OFF = 0x4321FEDC
MEMORY = "512M"
LONGEST_S = 3600
FIRST = "--first"
"""Says that this is the first process of a guest."""
HANDED_ON = ("PATH", "LANG", "VIRTUAL_ENV", "PYTHONPATH")


class NoGuestError(Exception):
    """There can be no guest here."""


@dataclass(frozen=True)
class Done:
    """A command that has run in a guest.

    Args:
        code: Its exit code.
        out: What it wrote, errors included.
    """

    code: int
    out: str


def missing() -> str:
    """Return what a guest needs and this machine lacks, empty when it has all."""
    lacking = [name for name in PROGRAMS if shutil.which(name) is None]
    if not lacking and not any(MODULES.glob(f"*/kernel/{NEEDED[0]}.ko")):
        lacking = [f"{MODULES}/*/kernel/{NEEDED[0]}.ko"]
    return ", ".join(lacking)


def in_guest(
    command: Sequence[str | Path], folder: Path, timeout_s: float, job: Path | None = None
) -> Done:
    """Run a command in a guest with the interface vcan0.

    Args:
        command: Program and arguments.
        folder: The one folder that the guest can write to; the command runs in it.
        timeout_s: After so long the guest is ended.
        job: Where the guest's own files go, in that folder; a new folder of it when None.

    Raises:
        NoGuestError: It did not start, or did not end in time.
    """
    if job is None:
        job = folder / "guest"
        job.mkdir()
    for name in ("tmp", "home"):
        (job / name).mkdir()
    kernel = next(MODULES.glob(f"*/kernel/{NEEDED[0]}.ko")).parents[2]
    task = {
        "command": [str(part) for part in command],
        "folder": str(folder),
        "modules": [str(kernel / f"{name}.ko") for name in NEEDED],
        "environment": {
            **{name: os.environ[name] for name in HANDED_ON if name in os.environ},
            "HOME": str(job / "home"),
            "TMPDIR": str(job / "tmp"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
    }
    (job / "task.json").write_text(json.dumps(task), encoding="ascii")
    first = job / "init"
    first.write_text(
        f"#!/bin/sh\nexec '{sys.executable}' '{__file__}' {FIRST} '{job}'\n", encoding="utf-8"
    )
    first.chmod(0o755)
    arguments = [
        *("linux.uml", f"mem={MEMORY}", "quiet", "loglevel=0", f"uml_dir={job}", "umid=u"),
        *("root=none", "rootfstype=hostfs", "rootflags=/", "ro", f"init={first}"),
        *("con=null", "con0=null,fd:1", "ssl=null"),
    ]
    environment = {name: it for name, it in os.environ.items() if name not in ("TMPDIR", "TMP")}
    try:
        ran = subprocess.run(
            arguments,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
            env=environment,
        )
    except subprocess.TimeoutExpired as error:
        raise NoGuestError(f"the guest did not end within {timeout_s:g} s") from error
    try:
        code = int((job / "code").read_text("ascii"))
    except OSError as error:
        raise NoGuestError(f"the guest did not come up: {ran.stdout}{ran.stderr}") from error
    return Done(code, (job / "out").read_text("utf-8", "replace"))


def _be_first(job: Path) -> None:
    """Be the first process of a guest: mount, load, run the command, switch off."""
    libc = ctypes.CDLL(None, use_errno=True)
    try:
        _run_task(job, libc)
    finally:
        os.sync()
        libc.reboot(POWER_OFF)


def _run_task(job: Path, libc: ctypes.CDLL) -> None:
    task = json.loads((job / "task.json").read_text("ascii"))
    _mount("proc", "proc", "/proc")
    _mount("sysfs", "sysfs", "/sys")
    Path("/dev/pts").mkdir(exist_ok=True)
    _mount("devpts", "devpts", "/dev/pts")
    folder = task["folder"]
    _mount("hostfs", "none", folder, "-o", folder)
    for module in task["modules"]:
        with Path(module).open("rb") as file:
            if libc.syscall(FINIT_MODULE, file.fileno(), b"", 0):
                raise OSError(ctypes.get_errno(), module)
    for words in (
        ("link", "set", "lo", "up"),
        ("link", "add", "dev", "vcan0", "type", "vcan"),
        ("link", "set", "vcan0", "up"),
    ):
        subprocess.run(("/usr/bin/env", "ip", *words), check=True)
    with (job / "out").open("wb") as out:
        done = subprocess.run(
            task["command"],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
            cwd=folder,
            env=task["environment"],
            check=False,
        )
    (job / "code").write_text(str(done.returncode), encoding="ascii")


def _mount(kind: str, source: str, place: str, *options: str) -> None:
    subprocess.run(("/bin/mount", "-t", kind, *options, source, place), check=True)


def _by_hand(folder: Path, command: Sequence[str]) -> int:
    if lacking := missing():
        sys.exit(f"needed and missing: {lacking} (Debian: user-mode-linux, can-utils, iproute2)")
    with tempfile.TemporaryDirectory(dir=folder) as job:
        done = in_guest(command, folder, LONGEST_S, Path(job))
    sys.stdout.write(done.out)
    return done.code


if __name__ == "__main__":
    if sys.argv[1] == FIRST:
        os.environ.setdefault("PATH", "/usr/sbin:/usr/bin:/sbin:/bin")
        _be_first(Path(sys.argv[2]))
    else:
        sys.exit(_by_hand(Path(sys.argv[1]).resolve(), sys.argv[2:]))
