"""The surroundings of a simulated device in another process, through its control connection."""

from __future__ import annotations

import json
import socket
from typing import Any, Final

from conformance.errors import BenchError
from conformance.spec.error_services import BusError

ANSWER_S: Final = 5.0
"""Longest wait for the other process."""


class RemoteRig:
    """Power, tilt, temperature, supply voltage, lights and the bus of a `simulate` elsewhere.

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

    def power_off(self) -> None:
        """Take the supply from every simulated device."""
        self._call("power_off")

    def power_on(self) -> None:
        """Give it back."""
        self._call("power_on")

    def connect(self, count: int) -> bool:
        """Supply the first so many devices and no other; tell whether there are that many."""
        return bool(self._call("connect", count))

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        """Tilt every simulated device, in degrees."""
        self._call("set_tilt", x_deg, y_deg)

    def set_temperature(self, degc: float) -> None:
        """Set the temperature of every simulated device, in degrees Celsius."""
        self._call("set_temperature", degc)

    def set_supply_voltage(self, volt: float) -> None:
        """Supply every simulated device with a voltage, in volts."""
        self._call("set_supply_voltage", volt)

    def at_rest(self) -> None:
        """Bring tilt, temperature and supply voltage back to what they were at first."""
        self._call("at_rest")

    def lit(self, light: str) -> bool:
        """Tell whether a light of the first simulated device is lit now."""
        return bool(self._call("lit", light))

    def label(self) -> str:
        """Return the serial number on the label of the first simulated device."""
        return str(self._call("label"))

    def disturb(self, error: BusError) -> None:
        """Destroy frames of every simulated device until its error counters have come so far."""
        self._call("disturb", error)

    def end_disturbance(self) -> None:
        """Let frames be again, so that the error counters go back."""
        self._call("end_disturbance")

    def add_twin(self, serial_number: int) -> None:
        """Put another device like the first one on the bus, with its node-ID."""
        self._call("add_twin", serial_number)

    def remove_twin(self) -> None:
        """Take it away again."""
        self._call("remove_twin")

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
