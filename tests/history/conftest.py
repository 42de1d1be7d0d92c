"""Databases to keep the history in: SQLite, and a PostgreSQL server of its own."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

UNPRIVILEGED = "postgres"


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    """Return the URL of a PostgreSQL server on loopback, started by its own binaries."""
    binaries = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    if not binaries:
        pytest.skip("no PostgreSQL server: apt-get install postgresql")
    folder = Path(tempfile.mkdtemp(prefix="pg-"))
    user = None
    if os.geteuid() == 0:  # the server refuses to run with all rights
        user = UNPRIVILEGED
        known = pwd.getpwnam(user)
        os.chown(folder, known.pw_uid, known.pw_gid)
    initdb = binaries[-1]
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


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Return the URL of an empty database."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'history.sqlite'}"
    base: str = request.getfixturevalue("server")
    name = f"h{time.monotonic_ns()}"
    create = ["psql", "-q", f"{base}/postgres", "-c", f"create database {name}"]
    subprocess.run(create, check=True, capture_output=True)
    return f"{base}/{name}"
