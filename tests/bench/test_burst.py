"""A burst of frames: as much as adapters hold, at the bus's full load, and over when it is over."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import can
import pytest

from conformance.bench.definition import load_bench
from conformance.bench.node.node import Node
from conformance.bench.services.burst import AHEAD, FRAMES, send_burst, send_load
from conformance.bench.session import Bench
from conformance.errors import SetupRefused
from conformance.resources import data
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import load_spec
from conformance.wire.frame import bit_length


@pytest.fixture
def node(tmp_path: Path) -> Iterator[Node]:
    path = data("device_specs") / "siko_ims360.yaml"
    definition = load_bench(data("fixtures/benches") / "simulator.yaml")
    options = {"channel": str(path)}
    bench = Bench.open(definition, load_spec(path).resolve(), options, tmp_path / "trace.log")
    bench.find_node()
    yield bench.node()
    bench.close()


def test_the_bus_is_full_and_the_adapter_is_not(
    node: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = node.link.rig
    assert isinstance(bus, SimulatorBus)
    waiting = []
    send = bus.send

    def record(message: can.Message) -> None:
        send(message)
        waiting.append(len(bus._client.pending))

    monkeypatch.setattr(bus, "send", record)
    mark, start_s = node.link.mark(), node.link.now()

    send_burst(node)

    frames = node.link._frames[mark:]
    assert len(waiting) == FRAMES
    assert max(waiting) <= AHEAD + 1
    busy_s = sum(bit_length(it.frame) for it in frames) / node.link.bus_time.bitrate
    assert busy_s > 0.95 * (frames[-1].time_s - start_s)


def test_a_load_lasts_and_lets_the_node_have_the_bus(node: Node) -> None:
    node.download(0x1017, 0, 20)
    mark, start_s = node.link.mark(), node.link.now()

    send_load(node, 0.5)

    beats = [it.time_s for it in node.link.since(mark, node.is_error_control)]
    last_s = max(it.time_s for it in node.link._frames[mark:] if not it.received)
    assert 0.5 < last_s - start_s < 0.7, "answers come on top"
    assert len([it for it in beats if it < last_s]) > 0.5 / 0.02
    assert max(later - former for former, later in pairwise(beats)) < 0.022


def test_no_answer_is_taken_for_a_later_one(node: Node) -> None:
    send_burst(node)

    assert node.number(0x1000) == node.spec.entries[0x1000, 0].default
    assert node.channel.unsolicited == 0


def test_an_adapter_that_is_too_slow_decides_nothing(
    node: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_message: can.Message) -> None:
        raise can.CanOperationError("transmit buffer full")

    monkeypatch.setattr(node.link.rig, "send", refuse)

    with pytest.raises(SetupRefused, match="too fast for the bench"):
        send_burst(node)
