"""A simulated device in another process: its surroundings are a bench's as those of one in this process."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from simulated_process import LOOPBACK, Process, simulating

from conformance.bench.surroundings.remote_rig import RemoteRig
from conformance.errors import BenchError

BENCH = """format: 1
what: A simulated device in another process.
interface: socketcand
channel: can0
options: {{host: 127.0.0.1, port: {port}}}
control: 127.0.0.1:{control}
timestamp_jitter_ms: 0
power: simulator
stimulus: {{tilt: simulator, temperature: simulator, supply: simulator}}
operator: simulator
second_node: simulator
bus_errors: simulator
allow: [reads, writes, resets, restores, power, non-volatile, node-id, other-nodes]
"""


@pytest.fixture
def process() -> Iterator[Process]:
    with simulating("siko_ims360", "--socketcand", f"{LOOPBACK}:0") as process:
        yield process


@pytest.fixture
def rig(process: Process) -> Iterator[RemoteRig]:
    rig = RemoteRig(f"{LOOPBACK}:{process.port('control')}")
    yield rig
    rig.close()


def test_the_surroundings_are_those_of_the_other_process(rig: RemoteRig) -> None:
    assert rig.label() == "1"
    rig.power_off()
    assert not rig.lit("green")
    rig.power_on()
    for call in (rig.at_rest, rig.end_disturbance):
        call()
    rig.set_tilt(10, 0)
    rig.set_temperature(40)
    rig.set_supply_voltage(24)
    rig.add_twin(7)
    rig.remove_twin()
    rig.disturb("error-passive")


def test_what_needs_power_tilt_and_a_person_is_judged_over_a_line(
    process: Process, judge: Callable[..., Any], tmp_path: Path
) -> None:
    path = tmp_path / "bench.yaml"
    ports = {"port": process.port("socketcand"), "control": process.port("control")}
    path.write_text(BENCH.format(**ports), encoding="utf-8")
    done = judge("--bench", path, "--select", "BOOT-02 or DEV-01 or LED-01 or SDO-25")
    assert done.code == 0, done.out
    assert done.requirements("pass") >= {"BOOT-02", "DEV-01", "LED-01", "SDO-25"}
    assert done.items("skipped") == ["SDO-25/remote"]
    assert "the interface carries no remote frames" in done.out


def test_nobody_there_is_the_bench_that_failed(judge: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "bench.yaml"
    with socket.create_server((LOOPBACK, 0)) as free:
        control = free.getsockname()[1]
    text = BENCH.replace("interface: socketcand", "interface: virtual")
    path.write_text(text.format(port=1, control=control), encoding="utf-8")
    done = judge("--bench", path)
    assert done.code == 2
    assert f"control: nobody answers at {LOOPBACK}:{control}" in done.out


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (b"", "ended the connection"),
        (b"hello\n", "answers what is no JSON"),
        (b'{"error": "no such call"}\n', "no such call"),
    ],
)
def test_an_answer_that_is_none_is_the_bench_that_failed(answer: bytes, said: str) -> None:
    with socket.create_server((LOOPBACK, 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(1000)
                connection.sendall(answer)

        serving = threading.Thread(target=serve)
        serving.start()
        rig = RemoteRig(f"{LOOPBACK}:{server.getsockname()[1]}")
        with pytest.raises(BenchError, match=said):
            rig.label()
        serving.join()
        rig.close()
