"""SDO transfers per second: ours over the simulated bus, python-canopen's over python-can's virtual one."""

from __future__ import annotations

import time
from collections.abc import Iterator

import can
import canopen
import pytest
from canopen.objectdictionary import ObjectDictionary, ODVariable
from canopen.objectdictionary.datatypes import UNSIGNED16
from canopen.sdo.client import SdoClient
from pytest_benchmark.fixture import BenchmarkFixture

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.spec.load import load_spec

INDEX = 0x1017
TRANSFERS = 1000
PERIOD = (0).to_bytes(2, "little")


@pytest.fixture
def node() -> Iterator[Node]:
    """Return a simulated IMS360."""
    path = resources.find("device_specs", "siko_ims360", "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    bench = Bench.open(definition, load_spec(path).resolve(), {"channel": str(path)}, None)
    yield bench.node()
    bench.close()


@pytest.fixture
def sdo() -> Iterator[SdoClient]:
    """Return a client of python-canopen's LocalNode."""
    dictionary = ObjectDictionary()  # type: ignore[no-untyped-call]  # canopen is partly untyped
    period = ODVariable("Producer heartbeat time", INDEX)
    period.data_type = UNSIGNED16
    dictionary.add_object(period)
    channel = f"benchmark-{time.monotonic_ns()}"
    sides = [can.Bus(interface="virtual", channel=channel, ignore_config=True) for _ in range(2)]
    with canopen.Network(sides[0]) as near, canopen.Network(sides[1]) as far:
        near.connect()
        far.connect()
        far.add_node(canopen.LocalNode(1, dictionary))
        yield near.add_node(1, dictionary).sdo


@pytest.mark.benchmark(group="SDO transfers")
def test_transfers_over_the_simulated_bus(benchmark: BenchmarkFixture, node: Node) -> None:
    def transfers() -> None:
        for _ in range(TRANSFERS // 2):
            node.write(INDEX, 0, PERIOD)
            node.upload(INDEX, 0)

    benchmark.pedantic(transfers, rounds=5, warmup_rounds=1)  # type: ignore[no-untyped-call]

    assert node.upload(INDEX, 0) == PERIOD


@pytest.mark.benchmark(group="SDO transfers")
def test_transfers_of_python_canopen(benchmark: BenchmarkFixture, sdo: SdoClient) -> None:
    def transfers() -> None:
        for _ in range(TRANSFERS // 2):
            sdo.download(INDEX, 0, PERIOD)
            sdo.upload(INDEX, 0)

    benchmark.pedantic(transfers, rounds=5, warmup_rounds=1)  # type: ignore[no-untyped-call]

    assert sdo.upload(INDEX, 0) == PERIOD
