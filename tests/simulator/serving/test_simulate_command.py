from __future__ import annotations

import subprocess
import time
from pathlib import Path
from typing import Any

import can
import canopen
import pytest
from simulated_process import COMMAND, LOOPBACK, Process, simulating

DEVICE = "siko_ims360"
DEVICE_TYPE = 117637530
NODE_ID = 50
SETTLED_S = 1.0


def sdo_upload(bus: can.BusABC, node_id: int, index: int, sub: int = 0) -> int:
    """Return what an object holds, asked for again while the node still starts."""
    data = [0x40, index & 0xFF, index >> 8, sub, 0, 0, 0, 0]
    limit_s = time.monotonic() + 20
    while time.monotonic() < limit_s:
        bus.send(can.Message(arbitration_id=0x600 + node_id, data=data, is_extended_id=False))
        while (message := bus.recv(0.5)) is not None:
            if message.arbitration_id == 0x580 + node_id:
                assert message.data[0] != 0x80, f"{index:04X}h: abort"
                return int.from_bytes(message.data[4:], "little")
    pytest.fail(f"node {node_id} does not answer")


def boot_up(bus: can.BusABC, node_id: int = NODE_ID) -> can.Message | None:
    limit_s = time.monotonic() + 5
    while time.monotonic() < limit_s:
        message = bus.recv(0.5)
        if message is not None and message.arbitration_id == 0x700 + node_id:
            return message
    return None


def test_a_device_on_an_slcan_line(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with simulating(DEVICE, "--slcan-pty", str(link)) as process:
        assert f"slcan {link}" in process.said
        with can.Bus(str(link), "slcan", bitrate=125_000, sleep_after_open=0.1) as bus:
            assert sdo_upload(bus, NODE_ID, 0x1000) == DEVICE_TYPE
        with can.Bus(str(link), "slcan", bitrate=250_000, sleep_after_open=0.1) as bus:
            bus.send(can.Message(arbitration_id=0, data=[129, 0], is_extended_id=False))
            assert boot_up(bus) is None
        assert process.end() == (0, "")
    assert not link.is_symlink()


def test_devices_of_a_socketcand_server() -> None:
    with simulating(DEVICE, "--nodes", "1,5-6", "--socketcand", f"{LOOPBACK}:0") as process:
        assert "3 nodes, 1 to 6" in process.said
        port = process.port("socketcand")
        with can.Bus("can0", "socketcand", host=LOOPBACK, port=port) as bus:
            for node_id in (1, 5, 6):
                assert sdo_upload(bus, node_id, 0x1000) == DEVICE_TYPE
            with can.Bus("can0", "socketcand", host=LOOPBACK, port=port) as other:
                assert [sdo_upload(it, 5, 0x1018, 4) for it in (bus, other)] == [2, 2]
        assert process.end() == (0, "")


def test_other_programs_speak_with_it(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with simulating(DEVICE, "--slcan-pty", str(link)) as process:
        network = canopen.Network()
        network.connect(interface="slcan", channel=str(link), bitrate=125_000, sleep_after_open=0.1)
        try:
            dictionary: Any = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
            node = network.add_node(canopen.RemoteNode(NODE_ID, dictionary))
            node.sdo.RESPONSE_TIMEOUT, node.sdo.MAX_RETRIES = 1, 10
            assert node.sdo.upload(0x1000, 0) == DEVICE_TYPE.to_bytes(4, "little")
            node.nmt.state = "RESET"
            node.nmt.wait_for_bootup(5)
        finally:
            network.disconnect()
        assert process.end() == (0, "")


def test_its_power_tilt_and_faults_are_set_from_outside(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with (
        simulating(DEVICE, "--slcan-pty", str(link)) as process,
        can.Bus(str(link), "slcan", bitrate=125_000, sleep_after_open=0.1) as bus,
    ):
        process.call("set_tilt", 90, 0)
        assert sdo_upload(bus, NODE_ID, 0x6110) == 9000
        process.call("set_tilt", 0, 0)
        time.sleep(SETTLED_S)
        assert sdo_upload(bus, NODE_ID, 0x6110) == 0
        process.call("power_off")
        process.call("power_on")
        assert boot_up(bus) is not None
        process.call("use_faults", ["wrong-device-type"])
        assert boot_up(bus) is not None
        assert sdo_upload(bus, NODE_ID, 0x1000) != DEVICE_TYPE
        process.call("use_faults", [])
        assert boot_up(bus) is not None
        assert sdo_upload(bus, NODE_ID, 0x1000) == DEVICE_TYPE
        assert process.call("label") == "1"


def test_what_a_device_holds_can_be_read(tmp_path: Path) -> None:
    with simulating(DEVICE, "--slcan-pty", str(tmp_path / "tty")) as process:
        (held,) = process.call("held")
    assert (held["node_id"], held["bitrate"]) == (NODE_ID, 125_000)
    assert held["memory"]["serial_number"] == 1
    assert held["changed"] == {}


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({"call": "explode"}, "expected one of power_off"),
        ({"call": "set_tilt", "args": ["steep", 0]}, "set_tilt: 0: "),
        ({"call": "set_tilt", "args": [1]}, "set_tilt: y_deg: "),
        ({"call": "set_tilt", "args": 5}, "expected a list"),
        ({"call": "use_faults", "args": [["no-such-fault"]]}, "no-such-fault"),
        ({"call": "disturb", "args": ["lightning"]}, "disturb: 0: "),
        ([], 'expected {"call"'),
        (7, 'expected {"call"'),
    ],
)
def test_mistakes_at_the_control_connection_are_told(
    one_process: Process, request_: object, said: str
) -> None:
    assert said in one_process.ask(request_)["error"]
    assert one_process.call("label") == "1"


def test_on_a_python_can_bus_it_is_a_device_too() -> None:
    """The simulated bus stands for any interface of python-can: one process, two devices on it."""
    arguments = ("--interface", "virtual", "--channel", "bench")
    with simulating(DEVICE, *arguments) as process:
        assert "virtual bench" in process.said
        assert process.call("held")[0]["node_id"] == NODE_ID
        assert process.end() == (0, "")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "expected either --interface"),
        (("--slcan-pty", "x", "--interface", "virtual"), "expected either --interface"),
        (("--socketcand", "nowhere"), "--socketcand: expected HOST:PORT, got 'nowhere'"),
        (("--socketcand", "h:99999"), "--socketcand: expected HOST:PORT"),
        (("--nodes", "0-4", "--slcan-pty", "x"), "--nodes: expected node-IDs from 1 to 127"),
        (("--nodes", "4,4", "--slcan-pty", "x"), "--nodes: expected each node-ID once"),
        (
            ("--nodes", "4", "--node-id", "4", "--slcan-pty", "x"),
            "no --node-id and no --count beside it",
        ),
        (("--fault", "no-such", "--slcan-pty", "x"), "no-such"),
    ],
)
def test_a_mistake_gets_one_sentence(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [*COMMAND, "simulate", DEVICE, *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 3
    assert said in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--slcan-pty", "missing/tty"), "cannot make"),
        (("--interface", "no_such", "--channel", "x"), "cannot open the bus"),
        (("--socketcand", "192.0.2.1:1"), "cannot listen on 192.0.2.1:1"),
    ],
)
def test_a_line_that_cannot_be_had_is_told(
    arguments: tuple[str, ...], said: str, tmp_path: Path
) -> None:
    done = subprocess.run(
        [*COMMAND, "simulate", DEVICE, *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 2
    assert said in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr


def test_a_file_in_the_place_of_the_link_is_kept(tmp_path: Path) -> None:
    (tmp_path / "tty").write_text("precious", encoding="ascii")
    done = subprocess.run(
        [*COMMAND, "simulate", DEVICE, "--slcan-pty", "tty"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 2
    assert (tmp_path / "tty").read_text("ascii") == "precious"
