"""The control connection of a process of simulated devices: a call as JSON on a line, its result on another."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, Final

from pydantic import ValidationError, validate_call

from conformance.errors import ConformanceError
from conformance.simulator.rig import SimulatorRig

MOST: Final = 1 << 16
"""Octets of a line; what is longer is none."""

CALLS: Final = (
    "power_off",
    "power_on",
    "connect",
    "set_tilt",
    "set_temperature",
    "set_supply_voltage",
    "at_rest",
    "lit",
    "label",
    "disturb",
    "end_disturbance",
    "add_twin",
    "remove_twin",
    "raise_error",
    "clear_error",
    "use_faults",
    "bus_load",
    "held",
)
"""What can be called, with the arguments that the rig's method of that name has."""


class ControlSession:
    """One connection; each line in is answered by one line out.

    A call is ``{"call": "set_tilt", "args": [10, 0]}``, answered by ``{"result": null}`` or
    ``{"error": "…"}``.

    Args:
        rig: What is controlled.
    """

    def __init__(self, rig: SimulatorRig) -> None:
        self._calls: Mapping[str, Callable[..., Any]] = {
            name: validate_call(getattr(rig, name)) for name in CALLS
        }
        self._buffer = b""

    def feed(self, data: bytes) -> bytes:
        """Take octets of the connection and return what goes back."""
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        answers = [self._answer(line) for line in lines if line.strip()]
        if len(self._buffer) > MOST:
            self._buffer = b""
            answers.append({"error": "a line too long"})
        return b"".join(json.dumps(answer).encode("ascii") + b"\n" for answer in answers)

    def _answer(self, line: bytes) -> dict[str, Any]:
        try:
            request = json.loads(line)
            call, arguments = request["call"], request.get("args", [])
        except (ValueError, TypeError, KeyError, AttributeError):
            return {"error": 'expected {"call": NAME, "args": [...]}'}
        if call not in self._calls:
            return {"error": f"expected one of {', '.join(CALLS)}, got {call!r}"}
        if not isinstance(arguments, list):
            return {"error": "args: expected a list"}
        try:
            return {"result": self._calls[call](*arguments)}
        except ValidationError as error:
            first = error.errors()[0]
            return {"error": f"{call}: {'.'.join(map(str, first['loc']))}: {first['msg']}"}
        except (ConformanceError, IndexError) as error:
            return {"error": f"{call}: {error}"}
