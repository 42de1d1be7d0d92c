"""Other nodes on the simulated bus: how much of it they take, with which identifiers, and when."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from conformance.errors import SpecError
from conformance.simulator.interface import SimulatorBus
from conformance.simulator.neighbours import neighbours
from conformance.wire import cob_id


def heard(bus: SimulatorBus, until_s: float) -> list[tuple[float, int, bytes]]:
    frames = []
    while bus.now() < until_s:
        message = bus.recv(until_s - bus.now())
        if message is not None:
            frames.append((message.timestamp, message.arbitration_id, bytes(message.data)))
    return frames


@pytest.mark.parametrize("load", [0.2, 0.5, 0.8])
def test_neighbours_take_their_share_of_the_bus(
    load: float, open_bus: Callable[..., SimulatorBus]
) -> None:
    bus = open_bus(load=load)

    heard(bus, 5.0)

    assert bus.bus_load() == pytest.approx(load, abs=0.07)


def test_neighbours_use_all_services_but_no_identifier_of_the_device(
    open_bus: Callable[..., SimulatorBus],
) -> None:
    bus = open_bus(load=0.8, node_id=50)

    identifiers = {can_id for _, can_id, _ in heard(bus, 12.0)} - {cob_id.heartbeat(50)}

    functions = {can_id & ~0x7F for can_id in identifiers}
    assert functions >= {0x000, 0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x600, 0x700}
    nodes = {can_id & 0x7F for can_id in identifiers} - {0}
    assert 50 not in nodes
    assert min(nodes) < 50 < max(nodes)
    assert cob_id.SYNC not in identifiers


@pytest.mark.parametrize("node_id", range(1, 128))
def test_neighbours_keep_away_from_each_node_id(node_id: int) -> None:
    own = {cob_id.heartbeat(node_id), cob_id.sdo_response(node_id), cob_id.emcy(node_id)}

    sent = [
        frame
        for neighbour in neighbours(node_id, 125_000, 0.8, 0)
        for frame in neighbour.step(2_000_000_000)
    ]

    assert not own & {frame.can_id for frame in sent}


def test_the_same_seed_makes_the_same_traffic(open_bus: Callable[..., SimulatorBus]) -> None:
    traffic = []
    for seed in (1, 1, 2):
        bus = open_bus(load=0.5, seed=seed)
        traffic.append(heard(bus, 1.0))
        bus.shutdown()

    assert traffic[0] == traffic[1] != traffic[2]


@pytest.mark.parametrize("load", [-0.1, 1.0, "much"])
def test_an_impossible_load_is_refused(
    load: float | str, open_bus: Callable[..., SimulatorBus]
) -> None:
    with pytest.raises(SpecError, match="load"):
        open_bus(load=load)


def test_a_device_can_have_been_set_to_another_bit_rate(
    open_bus: Callable[..., SimulatorBus],
) -> None:
    bus = open_bus(bitrate=500_000, device_bitrate=500_000)

    assert [can_id for _, can_id, _ in heard(bus, 1.0)] != []
    with bus.present() as simulated:
        assert simulated.nodes[0].memory.bitrate == 500_000


def test_no_device_has_a_bit_rate_that_no_controller_has(
    open_bus: Callable[..., SimulatorBus],
) -> None:
    with pytest.raises(SpecError, match="bit rate"):
        open_bus(device_bitrate=5)
