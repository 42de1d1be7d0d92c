"""What is said of a bus that cannot be opened, or is open and in error."""

from __future__ import annotations

import errno
import subprocess
from typing import Any

import can
import pytest

from conformance.bench import opening
from conformance.bench.definition import BenchDefinition
from conformance.commands.examination import Examination
from conformance.errors import BenchError

PCAN = BenchDefinition(format=1, what="x", interface="pcan", channel="PCAN_USBBUS1")


def closed(monkeypatch: pytest.MonkeyPatch, error: Exception) -> str:
    def refuse(**_: object) -> can.BusABC:
        raise error

    monkeypatch.setattr(can, "Bus", refuse)
    with pytest.raises(BenchError) as refused:
        opening.open_bus(PCAN, 125_000)
    return opening.why_closed(PCAN, refused.value)


@pytest.mark.parametrize(
    "error",
    [
        ImportError("No module named 'uptime'"),
        NameError("name 'canGetNumberOfChannels' is not defined"),
        can.CanInterfaceNotImplementedError("only on Windows"),
        OSError("pcanbasic library not found."),
        OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol"),
    ],
)
def test_a_missing_driver_is_named(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    said = closed(monkeypatch, error)
    assert "the driver of interface pcan is missing: it needs PCAN-Basic" in said
    assert 'pip install "python-can[pcan]"' in said


def test_an_unknown_channel_is_told_with_those_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opening, "channels", lambda _: ["PCAN_USBBUS2", "PCAN_USBBUS3"])
    said = closed(monkeypatch, can.CanInitializationError("a parameter is invalid"))
    assert "channel PCAN_USBBUS1): a parameter is invalid" in said
    assert said.endswith("finds here: PCAN_USBBUS2, PCAN_USBBUS3")


def test_a_driver_that_hangs_or_crashes_names_no_channel(monkeypatch: pytest.MonkeyPatch) -> None:
    def hang(*_: object, **__: object) -> None:
        raise subprocess.TimeoutExpired("x", 8)

    monkeypatch.setattr(subprocess, "run", hang)
    assert opening.channels("pcan") == []


class Erring(can.BusABC):
    """A bus that gives error frames, and then nothing."""

    def __init__(self, errors: int, data: bytes, kind: int) -> None:
        super().__init__(channel="x")
        self._left = [
            can.Message(arbitration_id=kind, is_error_frame=True, data=data) for _ in range(errors)
        ]

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:  # noqa: ARG002 - python-can calls it so
        return (self._left.pop() if self._left else None), False

    def send(self, msg: can.Message, timeout: float | None = None) -> None:  # noqa: ARG002 - as above
        raise AssertionError("nothing is sent")


@pytest.mark.parametrize(
    ("kind", "said"), [(0x08, "the bus is in error"), (0x40, "the adapter went bus-off")]
)
def test_a_bus_in_error(kind: int, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = BenchDefinition(format=1, what="x", interface="socketcan", channel="can0")
    buses: list[Any] = [Erring(300, bytes(8), kind)]
    monkeypatch.setattr("conformance.commands.examination.open_bus", lambda *_: buses.pop())
    monkeypatch.setattr("conformance.commands.examination.overshoot", lambda _: None)
    found = Examination(bench, 125_000, {}, 0.05, ask=True).look()
    assert said in found.problem
    assert found.asked is None
