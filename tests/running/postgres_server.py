"""A PostgreSQL server on loopback, started by its own binaries without any rights."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

UNPRIVILEGED = "postgres"
MISSING = "no PostgreSQL server: apt-get install postgresql"


def is_installed() -> bool:
    """Tell whether Debian's package is there."""
    return bool(_binaries())


def _binaries() -> list[Path]:
    return sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))


@contextmanager
def running() -> Iterator[str]:
    """Start a server in a folder of its own and return its URL."""
    folder = Path(tempfile.mkdtemp(prefix="pg-"))
    user = None
    if os.geteuid() == 0:  # the server refuses to run with all rights
        user = UNPRIVILEGED
        known = pwd.getpwnam(user)
        os.chown(folder, known.pw_uid, known.pw_gid)
    initdb = _binaries()[-1]
    data = folder / "data"
    made = [str(initdb), "-D", str(data), "-U", "tester", "-A", "trust", "-E", "UTF8", "--no-sync"]
    subprocess.run(made, check=True, capture_output=True, user=user, cwd=folder)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    started = [
        str(initdb.with_name("postgres")),
        "-D",
        str(data),
        "-p",
        str(port),
        "-k",
        str(folder),
    ]
    with (
        (folder / "log").open("wb") as log,
        subprocess.Popen(
            [*started, "-h", "127.0.0.1"], stdout=log, stderr=log, user=user, cwd=folder
        ) as process,
    ):
        try:
            ready = initdb.with_name("pg_isready")
            asked = [str(ready), "-q", "-h", "127.0.0.1", "-p", str(port)]
            while subprocess.run(asked, check=False).returncode:
                assert process.poll() is None, (folder / "log").read_text()
                time.sleep(0.1)
            yield f"postgresql://tester@127.0.0.1:{port}"
        finally:
            process.terminate()
            process.wait(60)
            shutil.rmtree(folder)


def new_database(server: str) -> str:
    """Make an empty database on a server and return its URL."""
    name = f"h{time.monotonic_ns()}"
    create = ["psql", "-q", f"{server}/postgres", "-c", f"create database {name}"]
    subprocess.run(create, check=True, capture_output=True)
    return f"{server}/{name}"
