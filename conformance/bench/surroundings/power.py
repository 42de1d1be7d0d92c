"""What switches the device's supply: the simulator, a person, a command line, SCPI, or other people's Python."""

from __future__ import annotations

import os
import shlex
import subprocess
import time
from collections.abc import Callable
from typing import Any, Final, Protocol

from conformance.bench.bus.link import Link
from conformance.bench.definition import BenchDefinition
from conformance.bench.surroundings.entry_points import called, made
from conformance.bench.surroundings.operator import Operator
from conformance.bench.surroundings.rig import Surroundings
from conformance.bench.who import PowerBy, ScpiSupply, SwitchCommand
from conformance.errors import BenchError, first_line

GROUP: Final = "canopen_conformance.power"
_PAUSE_S: Final = 0.05


class Power(Protocol):
    """Switches the supply of the device under test."""

    def off(self) -> None:
        """Take the supply away."""

    def on(self) -> None:
        """Give it back."""


class Supply:
    """The device's supply as checks use it.

    Args:
        power: What switches it.
        link: The link to the bus, which is heard meanwhile.
        off_s: How long the supply stays off.
        certain: What is switched off is off; else the node is asked.
    """

    def __init__(
        self, power: Power, link: Link, off_s: float = 0.0, *, certain: bool = False
    ) -> None:
        self.certain = certain
        self._power = power
        self._link = link
        self._off_s = off_s

    def off(self) -> None:
        """Take the supply away, long enough for the device to lose it.

        Raises:
            BenchError: It cannot be switched.
            SetupRefused: The person who switches it does not answer.
        """
        self._power.off()
        if self._off_s:
            self._link.listen(self._off_s, lambda _: False)

    def on(self) -> None:
        """Give it back.

        Raises:
            BenchError: It cannot be switched.
            SetupRefused: The person who switches it does not answer.
        """
        self._power.on()


def supply_of(
    definition: BenchDefinition, link: Link, operator: Callable[[], Operator]
) -> Supply | None:
    """Return the supply of a bench, None where checks may not switch it or nothing can.

    Raises:
        BenchError: What switches it is not there.
    """
    by = definition.power
    if not definition.switches_supply:
        return None
    if isinstance(by, PowerBy):
        return Supply(_described(by, link), link, by.off_s)
    if by == "operator":
        return Supply(_ByOperator(operator), link)
    return None if link.rig is None else Supply(_Simulated(link.rig), link, certain=True)


def _described(by: PowerBy, link: Link) -> Power:
    if by.command is not None:
        return _ByCommand(by.command, link)
    if by.scpi is not None:
        return _ByScpi(by.scpi)
    return _ByEntryPoint(by.entry_point or "")


class _Simulated:
    def __init__(self, rig: Surroundings) -> None:
        self.off, self.on = rig.power_off, rig.power_on


class _ByOperator:
    def __init__(self, operator: Callable[[], Operator]) -> None:
        self._operator = operator

    def off(self) -> None:
        self._operator().switch_supply(on=False)

    def on(self) -> None:
        self._operator().switch_supply(on=True)


class _ByCommand:
    def __init__(self, command: SwitchCommand, link: Link) -> None:
        self._command = command
        self._link = link

    def off(self) -> None:
        self._run(self._command.off)

    def on(self) -> None:
        self._run(self._command.on)

    def _run(self, line: str) -> None:
        deadline_s = time.monotonic() + self._command.timeout_s
        try:
            arguments: str | list[str] = line if os.name == "nt" else shlex.split(line)
            process = subprocess.Popen(  # noqa: S603 - what to run is what a bench file is for
                arguments,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except (OSError, ValueError) as error:
            raise BenchError(f"power: cannot run {line!r}: {first_line(error)}") from error
        with process:
            try:
                while process.poll() is None:
                    if time.monotonic() > deadline_s:
                        raise BenchError(
                            f"power: {line!r} did not end within {self._command.timeout_s:g} s"
                        )
                    self._link.drain()
                    time.sleep(_PAUSE_S)
            finally:
                process.kill()
        if process.returncode:
            raise BenchError(f"power: {line!r} ended with exit code {process.returncode}")


class _ByScpi:
    def __init__(self, supply: ScpiSupply) -> None:
        try:
            import pyvisa  # noqa: PLC0415 - an extra, for benches with such a supply alone
        except ImportError as error:
            raise BenchError(
                "power: a supply that takes SCPI needs PyVISA: "
                "pip install 'canopen-conformance[scpi]'"
            ) from error
        self._failures = (pyvisa.Error, OSError, ValueError)
        self._supply = supply
        try:
            self._manager: Any = pyvisa.ResourceManager(supply.backend)
        except self._failures as error:
            raise self._failed("no VISA library", error) from error
        self._write("")

    def off(self) -> None:
        self._write(self._supply.off)

    def on(self) -> None:
        self._write(self._supply.on)

    def _write(self, command: str) -> None:
        """Send a command, an empty one to see only whether the supply is there."""
        try:
            resource = self._manager.open_resource(
                self._supply.resource, open_timeout=int(1000 * self._supply.timeout_s)
            )
            if not resource.session:  # some backends do not raise what is wrong
                raise OSError("there is no such resource")
            with resource:
                resource.timeout = 1000 * self._supply.timeout_s
                if command:
                    resource.write(command)
        except self._failures as error:
            raise self._failed(command or "nothing sent yet", error) from error

    def _failed(self, what: str, error: Exception) -> BenchError:
        return BenchError(f"power: {self._supply.resource} ({what}): {first_line(error)}")


class _ByEntryPoint:
    def __init__(self, name: str) -> None:
        self._name = name
        self._power: Power = made(GROUP, name, ("off", "on"))

    def off(self) -> None:
        called(GROUP, self._name, self._power.off)

    def on(self) -> None:
        called(GROUP, self._name, self._power.on)
