"""Block transfers of a simulated device that offers them; frames by hand (CiA 301 v4.2.0, 7.2.4.3.8 to .16)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import can
import pytest

from conformance.simulator.interface import SimulatorBus

ROTA = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"
NAME = b"ROTA-M 58 mm, stainless, IP67"
Bus = Callable[..., SimulatorBus]


@pytest.fixture
def rota(open_bus: Bus) -> Bus:
    """The device that offers block transfers, just booted."""

    def opened(*faults: str) -> SimulatorBus:
        bus = open_bus(str(ROTA), faults=faults)
        while bus.recv(0.3) is not None:
            pass
        return bus

    return opened


def told(bus: SimulatorBus, *requests: str) -> list[str]:
    """Send requests to node 20h and return what it answers."""
    for request in requests:
        bus.send(
            can.Message(arbitration_id=0x620, is_extended_id=False, data=bytes.fromhex(request))
        )
    answers = []
    while (message := bus.recv(0.05)) is not None:
        if message.arbitration_id == 0x5A0:
            answers.append(bytes(message.data).hex(" ").upper())
    return answers


def test_an_object_is_uploaded_in_blocks(rota: Bus) -> None:
    bus = rota()
    assert told(bus, "A4 08 10 00 03 00 00 00") == ["C6 08 10 00 1D 00 00 00"]
    first = told(bus, "A3 00 00 00 00 00 00 00")
    assert [answer[:2] for answer in first] == ["01", "02", "03"]
    again = told(bus, "A2 02 03 00 00 00 00 00")
    assert [answer[:2] for answer in again] == ["01", "02", "83"], "the third did not come through"
    data = b"".join(bytes.fromhex(answer)[1:] for answer in (*first[:2], *again))
    assert data[: len(NAME)] == NAME
    assert told(bus, "A2 03 03 00 00 00 00 00") == ["D9 62 06 00 00 00 00 00"]
    assert told(bus, "A1 00 00 00 00 00 00 00") == []
    assert told(bus, "A1 00 00 00 00 00 00 00") == ["80 00 00 00 01 00 04 05"]


def test_an_object_is_downloaded_in_blocks(rota: Bus) -> None:
    bus = rota()
    assert told(bus, "C6 0B 00 00 00 00 00 00") == ["80 0B 00 00 00 00 02 06"]
    assert told(bus, "C6 10 20 0B 08 00 00 00") == ["A4 10 20 0B 7F 00 00 00"]
    assert told(bus, "01 01 00 00 00 00 00 00") == []
    assert told(bus, "82 00 00 00 00 00 00 00") == ["A2 02 7F 00 00 00 00 00"]
    assert told(bus, "D9 64 DD 00 00 00 00 00") == ["80 10 20 0B 04 00 04 05"], "wrong CRC"
    told(bus, "C6 17 10 00 02 00 00 00", "81 64 00 00 00 00 00 00")
    assert told(bus, "D5 EE C7 00 00 00 00 00") == ["A1 00 00 00 00 00 00 00"]
    assert told(bus, "40 17 10 00 00 00 00 00") == ["4B 17 10 00 64 00 00 00"]


@pytest.mark.parametrize(
    ("requests", "code"),
    [
        pytest.param(["A0 00 10 00 80 00 00 00"], "02 00 04 05", id="block of 128"),
        pytest.param(["A0 00 10 00 00 00 00 00"], "02 00 04 05", id="block of none"),
        pytest.param(
            ["A0 00 10 00 14 00 00 00", "A2 15 14 00 00 00 00 00"], "03 00 04 05", id="more acked"
        ),
        pytest.param(
            ["A0 00 10 00 14 00 00 00", "A1 00 00 00 00 00 00 00"], "01 00 04 05", id="early end"
        ),
        pytest.param(
            ["C6 17 10 00 02 00 00 00", "82 64 00 00 00 00 00 00"], "03 00 04 05", id="first lost"
        ),
        pytest.param(["C6 17 10 00 04 00 00 00"], "12 00 07 06", id="too long"),
        pytest.param(
            ["C4 17 10 00 00 00 00 00", "01 64 00 00 00 00 00 00", "02 00 00 00 00 00 00 00"],
            "12 00 07 06",
            id="does not end",
        ),
        pytest.param(["C6 00 10 00 04 00 00 00"], "02 00 01 06", id="read-only"),
    ],
)
def test_a_wrong_block_transfer_is_aborted(rota: Bus, requests: list[str], code: str) -> None:
    multiplexer = requests[0][3:11]
    bus = rota()
    assert told(bus, *requests)[-1] == f"80 {multiplexer} {code}"
    assert told(bus, "40 18 10 00 00 00 00 00") == ["4F 18 10 00 04 00 00 00"]


def test_a_client_ends_a_block_transfer_by_an_abort_or_another_request(rota: Bus) -> None:
    bus = rota()
    told(bus, "C6 17 10 00 02 00 00 00")
    assert told(bus, "80 17 10 00 00 00 00 08") == []
    assert told(bus, "40 18 10 00 00 00 00 00") == ["4F 18 10 00 04 00 00 00"]
    told(bus, "A0 00 10 00 14 00 00 00")
    assert told(bus, "40 18 10 00 00 00 00 00") == ["4F 18 10 00 04 00 00 00"]
    assert told(bus, "A3 00 00 00 00 00 00 00") == ["80 00 00 00 01 00 04 05"]


def test_its_faults_show_in_the_begin_and_in_the_end(rota: Bus) -> None:
    bus = rota("sdo-takes-any-block-size")
    assert told(bus, "A0 00 10 00 80 00 00 00") == ["C6 00 10 00 04 00 00 00"]
    bus.shutdown()
    bus = rota("sdo-wrong-crc")
    told(bus, "A4 08 10 00 14 00 00 00", "A3 00 00 00 00 00 00 00")
    assert told(bus, "A2 05 14 00 00 00 00 00") == ["D9 63 06 00 00 00 00 00"]
