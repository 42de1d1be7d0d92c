"""The surroundings of a simulated device in another process, through its control connection."""

from __future__ import annotations

import json
import socket
from typing import Any, Final

from conformance.errors import BenchError
from conformance.rig_calls import RigCalls

ANSWER_S: Final = 5.0
"""Longest wait for the other process."""


class RemoteRig(RigCalls):
    """Rig of a `simulate` elsewhere.

    Args:
        address: ``HOST:PORT`` of its control connection.

    Raises:
        BenchError: Nobody listens there.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        host, _, port = address.rpartition(":")
        try:
            self._socket = socket.create_connection((host, int(port)), timeout=ANSWER_S)
        except OSError as error:
            raise BenchError(
                f"control: nobody answers at {address}: {error}; is `simulate --control` running?"
            ) from error
        self._lines = self._socket.makefile("rb")

    def close(self) -> None:
        """End the connection."""
        self._lines.close()
        self._socket.close()

    def _call(self, name: str, *arguments: object) -> Any:
        request = json.dumps({"call": name, "args": arguments}).encode("ascii") + b"\n"
        try:
            self._socket.sendall(request)
            line = self._lines.readline()
        except OSError as error:
            raise BenchError(f"control: {self._address} does not answer: {error}") from error
        if not line:
            raise BenchError(f"control: {self._address} ended the connection")
        try:
            answer = json.loads(line)
        except ValueError as error:
            raise BenchError(f"control: {self._address} answers what is no JSON") from error
        if "error" in answer:
            raise BenchError(f"control: {answer['error']}")
        return answer.get("result")
