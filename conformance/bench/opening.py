"""Opens a bus of python-can, and says in a sentence what is missing where it cannot be opened."""

from __future__ import annotations

import errno
import json
import subprocess
import sys
from collections.abc import Mapping
from typing import Any, Final

import can

from conformance.bench.bus.trouble import enlarge_queue
from conformance.bench.definition import BenchDefinition
from conformance.errors import BenchError, SpecError, first_line

NEEDED: Final[Mapping[str, str]] = {
    "socketcan": "Linux with SocketCAN (modprobe can)",
    "slcan": 'pip install "python-can[serial]"',
    "pcan": 'PCAN-Basic of PEAK\'s driver, and pip install "python-can[pcan]"',
    "kvaser": "CANlib of Kvaser's driver (linuxcan on Linux)",
    "ixxat": "the VCI driver of HMS Ixxat, on Windows",
    "vector": "the XL Driver Library of Vector's driver set-up, on Windows",
    "gs_usb": 'pip install "python-can[gs-usb]", and libusb',
}
"""What interfaces of python-can need beside python-can."""

SILENT: Final[Mapping[str, Mapping[str, Any]]] = {
    "canopen_simulator": {},
    "slcan": {"listen_only": True},
    "vector": {"listen_only": True},
    "kvaser": {"driver_mode": False},
    "pcan": {"state": can.BusState.PASSIVE},
}
"""How interfaces are told to listen without a dominant bit, so that a wrong bit rate disturbs nobody."""

_ASK_S: Final = 8.0
_ASK: Final = (
    "import can, json, sys; "
    "found = can.detect_available_configs([sys.argv[1]], timeout=5); "
    "print(json.dumps([str(it.get('channel')) for it in found]))"
)
_FOUND_BY: Final[Mapping[str, str]] = {"slcan": "serial"}
"""Interface that knows the channels of another."""


def open_bus(
    definition: BenchDefinition, bitrate: int, options: Mapping[str, Any] | None = None
) -> can.BusABC:
    """Open the bus of a bench.

    Args:
        definition: The bench.
        bitrate: In bit/s.
        options: Arguments of the interface beyond those in the bench's file.

    Raises:
        BenchError: The interface cannot be opened.
    """
    arguments = {
        "interface": definition.interface,
        "channel": definition.channel,
        "bitrate": bitrate,
        **definition.options,
        **(options or {}),
    }
    try:
        bus = can.Bus(ignore_config=True, **arguments)
    except SpecError:
        raise
    except Exception as error:
        raise BenchError(
            f"cannot open the bus (interface {definition.interface}, channel "
            f"{arguments['channel']}): {first_line(error)}"
        ) from error
    enlarge_queue(bus)
    return bus


def why_closed(definition: BenchDefinition, error: BenchError) -> str:
    """Return what to look at where a bus could not be opened: the driver, or the channel.

    Args:
        definition: The bench.
        error: What `open_bus` raised.
    """
    interface = definition.interface
    if interface not in can.VALID_INTERFACES:
        return (
            f"python-can has no interface {interface!r}; it has: "
            f"{', '.join(sorted(can.VALID_INTERFACES))}"
        )
    if _lacks_driver(error.__cause__):
        needed = NEEDED.get(interface, "a driver or package that is not there")
        return f"the driver of interface {interface} is missing: it needs {needed} ({error})"
    found = ", ".join(channels(interface)) or "none that it could name"
    return f"{error}; channels that python-can finds here: {found}"


def channels(interface: str) -> list[str]:
    """Return the channels that python-can finds, in a process that cannot take this one with it."""
    try:
        done = subprocess.run(  # noqa: S603 - this Python, and nothing that a user typed
            [sys.executable, "-c", _ASK, _FOUND_BY.get(interface, interface)],
            capture_output=True,
            text=True,
            check=True,
            timeout=_ASK_S,
        )
        found: list[str] = json.loads(done.stdout.strip().splitlines()[-1])
    except (subprocess.SubprocessError, OSError, ValueError, IndexError):
        return []
    return found


def _lacks_driver(error: BaseException | None) -> bool:
    """Tell whether an error is that of a library which is not there."""
    if isinstance(error, can.CanInterfaceNotImplementedError | ImportError | NameError):
        return True
    if isinstance(error, OSError) and error.errno == errno.EAFNOSUPPORT:
        return True
    text = str(error).lower()
    return type(error).__name__ == "NoBackendError" or ("library" in text and "not found" in text)
