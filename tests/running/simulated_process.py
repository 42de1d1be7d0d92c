"""The command `simulate` as a process of its own, and calls on its control connection."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

COMMAND = (sys.executable, "-c", "from conformance.cli import main; main()")
LOOPBACK = "127.0.0.1"
ENDS_WITHIN_S = 20


@dataclass(frozen=True)
class Process:
    """A running `simulate`.

    Args:
        process: The process.
        said: Its line when it was ready.
    """

    process: subprocess.Popen[str]
    said: str

    def port(self, name: str) -> int:
        """Return the port of a server: socketcand or control."""
        found = re.search(rf"{name} \S+:(\d+)", self.said)
        assert found is not None
        return int(found[1])

    def call(self, name: str, *arguments: Any) -> Any:
        """Call the control connection."""
        answer = self.ask({"call": name, "args": list(arguments)})
        assert "error" not in answer, answer
        return answer["result"]

    def ask(self, request: object) -> dict[str, Any]:
        """Send a line to the control connection and return what comes back."""
        with socket.create_connection((LOOPBACK, self.port("control")), timeout=10) as connection:
            connection.sendall(json.dumps(request).encode() + b"\n")
            with connection.makefile("rb") as lines:
                answer: dict[str, Any] = json.loads(lines.readline())
        return answer

    def end(self) -> tuple[int, str]:
        """Terminate it; return its exit code and what it wrote to standard error."""
        self.process.send_signal(signal.SIGTERM)
        _, errors = self.process.communicate(timeout=ENDS_WITHIN_S)
        return self.process.returncode, errors


@contextmanager
def simulating(*arguments: str) -> Iterator[Process]:
    """Run `simulate` with some arguments and a control connection."""
    process = subprocess.Popen(
        [*COMMAND, "simulate", *arguments, "--control", f"{LOOPBACK}:0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        said = process.stdout.readline()
        assert said, process.communicate()[1]
        yield Process(process, said)
    finally:
        process.kill()
        process.communicate()
