"""SDO round trips over an slcan line and a socketcand server, and the suite's own share of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from simulated_process import LOOPBACK, Process, simulating

from conformance import resources
from conformance.bench.definition import BenchDefinition
from conformance.bench.session import Bench
from conformance.spec.load import load_spec
from conformance.wire import cob_id
from conformance.wire.frame import Frame, bit_length
from conformance.wire.sdo import InitiateUpload, encode

DEVICE = "siko_ims360"
INDEX = 0x1017
MANY, FEW = 2000, 20
LINES = ("slcan", "socketcand")


class Timed:
    """A bus of python-can, and when requests were handed to it and it had the answers.

    Args:
        bus: The bus.
        node_id: Whose SDO transfers.

    Attributes:
        trips_s: From each request to its answer.
        own_s: From each answer to the next request.
        looked_s: How much of that the library took to find that nothing else had come.
    """

    def __init__(self, bus: can.BusABC, node_id: int) -> None:
        self._bus = bus
        self._answers = cob_id.sdo_response(node_id)
        self._asked_s = self._answered_s = 0.0
        self.trips_s: list[float] = []
        self.own_s: list[float] = []
        self.looked_s = 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        self._asked_s = time.perf_counter()
        if self._answered_s:
            self.own_s.append(self._asked_s - self._answered_s)
        self._bus.send(message, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        began_s = time.perf_counter()
        message = self._bus.recv(timeout)
        if message is None and self._answered_s > self._asked_s:
            self.looked_s += time.perf_counter() - began_s
        if message is not None and message.arbitration_id == self._answers:
            self._answered_s = time.perf_counter()
            self.trips_s.append(self._answered_s - self._asked_s)
        return message


def bench_of(line: str, link: Path, process: Process) -> BenchDefinition:
    if line == "slcan":
        more: dict[str, Any] = {"channel": str(link), "options": {"sleep_after_open": 0.1}}
    else:
        options = {"host": LOOPBACK, "port": process.port("socketcand")}
        more = {"channel": "can0", "options": options}
    return BenchDefinition.model_validate({"format": 1, "what": "-", "interface": line, **more})


def at(times_s: list[float], share: float) -> float:
    """Return the time that so large a share of some times does not exceed, in ms."""
    return 1000 * sorted(times_s)[int(share * (len(times_s) - 1))]


@pytest.mark.benchmark(group="SDO round trips")
@pytest.mark.parametrize("line", LINES)
def test_round_trips(
    benchmark: BenchmarkFixture,
    tell: Callable[[str], None],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    line: str,
) -> None:
    transfers = FEW if benchmark.disabled else MANY
    link = tmp_path / "tty"
    spec = load_spec(resources.find("device_specs", DEVICE, "DEVICE")).resolve()
    served = ("--slcan-pty", str(link), "--socketcand", f"{LOOPBACK}:0")
    with simulating(DEVICE, *served) as process:
        bench = Bench.open(bench_of(line, link, process), spec, {}, None)
        bench.find_node()
        node = bench.node()
        timed = Timed(bench.link._bus, spec.node_id)
        monkeypatch.setattr(bench.link, "_bus", timed)

        def ask() -> None:
            for _ in range(transfers):
                assert node.sdo.upload(INDEX, 0).confirmed

        benchmark.pedantic(ask, rounds=1)  # type: ignore[no-untyped-call]
        bench.close()

    assert len(timed.trips_s) == transfers
    assert len(timed.own_s) == transfers - 1
    request = Frame(cob_id.sdo_request(spec.node_id), encode(InitiateUpload(INDEX, 0)))
    frames_ms = 2 * 1000 * bit_length(request) / spec.bitrate
    trip_ms, own_ms = at(timed.trips_s, 0.5), at(timed.own_s, 0.5)
    p99_ms, all_s = at(timed.trips_s, 0.99), sum(timed.own_s) + sum(timed.trips_s)
    tell(
        f"{line:>10}: {transfers} round trips, median {trip_ms:.2f} ms ({trip_ms / frames_ms:.2f} of what "
        f"two frames take at {spec.bitrate / 1000:g} kbit/s), p99 {p99_ms:.2f} ms ({p99_ms / trip_ms:.2f} of that)"
    )
    tell(
        f"{line:>10}: from answer to next request median {own_ms:.3f} ms, p99 {at(timed.own_s, 0.99):.3f} ms, "
        f"{sum(timed.own_s) / all_s:.1%} of the time; {timed.looked_s / all_s:.1%} python-can's look for more"
    )
