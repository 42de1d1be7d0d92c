"""An adapter that misbehaves on command: whatever it does, no sensor fails for it."""

from __future__ import annotations

import json
import math
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import can
import pytest
from simulated_process import LOOPBACK

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.session import Bench
from conformance.errors import BenchError
from conformance.options import RunOptions
from conformance.run import Run
from conformance.runner import run
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import load_spec

DEVICE = "siko_ims360"
FRAMES = 2500
"""So many may come before something happens: some items are over by then."""
A_WHILE_S = 2.5
A_MOMENT_S = 0.3
NO_ACKNOWLEDGE = 0x20
BUS_OFF = 0x40
CONTROLLER = 0x04
PROTOCOL = 0x08


class Adapter(SimulatorBus):
    """Works for some frames; then something happens to it."""

    trick: Trick

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.frames = 0
        self.looks = 0
        self.spared = FRAMES
        self.cut_s, self.cut_for_s = -1.0, 0.0

    def recv(self, timeout: float | None = None) -> can.Message | None:
        self.looks += 1
        happened = self.trick(self) if self.frames > self.spared else None
        if happened is not None:
            return happened
        message = super().recv(timeout)
        self.frames += message is not None
        return None if self.is_cut else message

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        if not self.is_cut:
            super().send(msg, timeout)

    @property
    def is_cut(self) -> bool:
        """The cable is off."""
        return self.cut_s >= 0 and self.now() < self.cut_s + self.cut_for_s

    def cut(self, for_s: float = math.inf) -> None:
        if self.cut_s < 0:
            self.cut_s, self.cut_for_s = self.now(), for_s


Trick: TypeAlias = Callable[[Adapter], can.Message | None]


def error(kind: int, *data: int) -> can.Message:
    octets = bytes(data).ljust(8, b"\0")
    return can.Message(arbitration_id=kind, data=octets, is_error_frame=True, dlc=8)


def bus_off(_: Adapter) -> can.Message:
    return error(BUS_OFF)


def overflow(_: Adapter) -> can.Message:
    return error(CONTROLLER, 0, 1)


def noise(adapter: Adapter) -> can.Message | None:
    return error(PROTOCOL) if adapter.looks % 50 == 0 else None


def unacknowledged(adapter: Adapter) -> can.Message | None:
    """The cable is off, and the adapter says that nobody acknowledges what it sends."""
    adapter.cut()
    return error(NO_ACKNOWLEDGE) if adapter.is_cut and adapter.looks % 3 == 0 else None


def unacknowledged_for_a_while(adapter: Adapter) -> can.Message | None:
    adapter.cut(A_WHILE_S)
    return unacknowledged(adapter)


def cable_off(adapter: Adapter) -> None:
    """The adapter says nothing of it."""
    adapter.cut()


def cable_off_for_a_while(adapter: Adapter) -> None:
    adapter.cut(A_WHILE_S)


@dataclass(frozen=True)
class Ended:
    code: int
    record: dict[str, Any]
    out: str

    @property
    def summary(self) -> dict[str, Any]:
        content: dict[str, Any] = self.record["summary"]
        return content


Play: TypeAlias = Callable[..., Ended]


@pytest.fixture
def play(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Play:
    """Run the suite over an adapter to which something happens."""

    def do(
        trick: Trick, interface: str = "canopen_simulator", select: str = "", fault: str = ""
    ) -> Ended:
        def opened(*, ignore_config: bool, interface: str, **arguments: Any) -> Adapter:
            assert ignore_config
            assert interface
            bus = Adapter(**{"channel": DEVICE, "faults": fault, **arguments})
            bus.trick = trick
            if trick is noise:
                bus.spared = 0
            return bus

        monkeypatch.setattr(can, "Bus", opened)
        text = resources.find("fixtures/benches", "simulator", "--bench").read_text("utf-8")
        bench = tmp_path / "bench.yaml"
        bench.write_text(text.replace("canopen_simulator", interface), encoding="utf-8")
        if interface != "canopen_simulator":
            bench.write_text(
                bench.read_text("utf-8") + f"channel: {DEVICE}\ntimestamp_jitter_ms: 0\n",
                encoding="utf-8",
            )
        options = RunOptions(
            DEVICE,
            bench=str(bench),
            report_dir=tmp_path / "record",
            select=select,
            faults=(fault,) if fault and interface == "canopen_simulator" else (),
        )
        code = run(Run(options))
        record = json.loads((tmp_path / "record" / "results.json").read_text("utf-8"))
        failed = sum(it["verdict"] == "fail" for it in record["items"])
        assert failed == record["summary"]["fail"]
        return Ended(code, record, " ".join(capsys.readouterr().out.split()))

    return do


@pytest.mark.parametrize(
    ("trick", "said"),
    [
        (bus_off, "the adapter went bus-off: check bit rate, wiring and termination"),
        (overflow, "the adapter lost frames, its buffer was full"),
        (unacknowledged, "does not answer any more"),
        (cable_off, "does not answer any more"),
    ],
)
@pytest.mark.parametrize("interface", ["canopen_simulator", "slcan"])
def test_what_ends_a_run_is_said_in_a_sentence(
    play: Play, trick: Trick, said: str, interface: str
) -> None:
    ended = play(trick, interface, "OD or SDO or HB")
    assert ended.code == 2
    assert said in ended.summary["aborted"]
    assert said in ended.out
    assert ended.summary["complete"] is False
    assert ended.summary["fail"] == 0
    assert ended.summary["pass"] > 5


@pytest.mark.parametrize(
    ("trick", "interface"),
    [
        (unacknowledged_for_a_while, "canopen_simulator"),
        (cable_off_for_a_while, "slcan"),
    ],
)
def test_a_cable_that_was_off_for_a_while_fails_nothing(
    play: Play, trick: Trick, interface: str
) -> None:
    ended = play(trick, interface, "SDO or OD")
    assert ended.code == 2
    assert ended.summary["fail"] == 0
    assert ended.summary["inconclusive"] > 0


@pytest.mark.parametrize("spared", range(200, 2600, 400))
def test_a_cable_that_was_off_for_a_moment_fails_nothing(play: Play, spared: int) -> None:
    def cable_off_for_a_moment(adapter: Adapter) -> None:
        if adapter.frames > FRAMES + spared:
            adapter.cut(A_MOMENT_S)

    ended = play(cable_off_for_a_moment, "slcan", "HB or TPDO or BOOT")
    assert ended.summary["fail"] == 0
    assert ended.code in (0, 2)


def test_a_deviation_that_is_there_twice_fails(play: Play) -> None:
    ended = play(lambda _: None, "slcan", "HB-01", fault="heartbeat-slow-10-percent")
    assert ended.code == 1
    assert ended.summary["fail"] > 0
    ids = [it["id"] for it in ended.record["items"]]
    assert len(set(ids)) == len(ids)


def test_nothing_is_blamed_on_a_device_while_frames_are_destroyed(play: Play) -> None:
    """The device is bad indeed; but what was seen of it does not prove that."""
    ended = play(noise, select="HB-01", fault="heartbeat-slow-10-percent")
    assert ended.code == 2
    assert ended.summary["fail"] == 0
    reasons = {it["reason"] for it in ended.record["items"] if it["verdict"] == "inconclusive"}
    assert any("the adapter tells of frames on the bus: " in it for it in reasons)
    assert any("destroyed: check cable and termination" in it for it in reasons)


def test_an_adapter_that_is_alright_is_no_trouble(play: Play) -> None:
    ended = play(lambda _: None, "slcan", "SDO or HB-01")
    assert ended.code == 0, ended.out


def opened(monkeypatch: pytest.MonkeyPatch, **more: Any) -> Bench:
    """Open a bench with one simulated IMS360, its adapter as some arguments say."""
    library = can.Bus

    def bus(**arguments: Any) -> can.BusABC:
        return library(**{**arguments, **more})

    monkeypatch.setattr(can, "Bus", bus)
    path = resources.find("device_specs", DEVICE, "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    return Bench.open(definition, load_spec(path).resolve(), {"channel": str(path)}, None)


def test_two_nodes_with_one_node_id_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = opened(monkeypatch)
    assert bench.link.rig is not None
    bench.link.rig.add_twin(7)
    bench.link.listen(0.5, lambda _: False)
    with pytest.raises(BenchError, match="two nodes answer as node 50, one with another serial"):
        bench.find_node()
    bench.close()


def test_a_wrong_bit_rate_is_suspected(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = opened(monkeypatch, bitrate=500_000)
    with pytest.raises(BenchError, match=r"heard on the bus: nothing.*check .* bit rate"):
        bench.find_node()
    bench.close()


def test_a_server_that_hangs_up_is_not_silence() -> None:
    """python-can's socketcand takes the end of a connection for a bus on which nothing comes."""
    with socket.create_server((LOOPBACK, 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall(b"< hi >")
                for _ in ("open", "rawmode"):
                    connection.recv(100)
                    connection.sendall(b"< ok >")

        serving = threading.Thread(target=serve)
        serving.start()
        port = server.getsockname()[1]
        arguments = {"interface": "socketcand", "channel": "can0", "bitrate": 125_000}
        definition = load_bench(resources.find("fixtures/benches", "socketcan", "--bench"))
        options = {"host": LOOPBACK, "port": port}
        changed = definition.model_copy(update={**arguments, "options": options})
        spec = load_spec(resources.find("device_specs", DEVICE, "DEVICE")).resolve()
        bench = Bench.open(changed, spec, {}, None)
        serving.join()
        with pytest.raises(BenchError, match="the socketcand server has ended the connection"):
            bench.find_node()
        bench.close()
