"""One simulated bus for several processes; here their connections are used from threads."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import can
import pytest

from conformance.interrupts import interruptible
from conformance.simulator.channel import build_bus
from conformance.simulator.hub import Hub
from conformance.simulator.hub_bus import HubBus

Join = Callable[[int], HubBus]
pytestmark = pytest.mark.timeout(20)
UPLOAD = bytes.fromhex("4000100000000000")


@pytest.fixture
def hub() -> Iterator[Hub]:
    hub = Hub(2)
    hub.put(build_bus("siko_ims360@11,siko_ims360@12"))
    yield hub
    hub.close()


@pytest.fixture
def join(hub: Hub) -> Iterator[Join]:
    """Join the hub for a node; the first for 11, the second for 12."""
    joined: list[HubBus] = []

    def connect(node_id: int) -> HubBus:
        joined.append(HubBus("hub", hub.ends[len(joined)], 125_000, node_id))
        return joined[-1]

    yield connect
    for bus in joined:
        bus.shutdown()


def until(bus: HubBus, end_s: float) -> float:
    """Receive until a time, and return what time it is then."""
    while bus.now() < end_s - 1e-6:
        bus.recv(end_s - bus.now())
    return bus.now()


def upload(bus: HubBus, node_id: int) -> str | None:
    """Ask a node for its device type, when it has had the time to boot."""
    until(bus, bus.now() + 0.5)
    bus.send(can.Message(arbitration_id=0x600 + node_id, data=UPLOAD, is_extended_id=False))
    while (message := bus.recv(0.5)) is not None:
        if message.arbitration_id == 0x580 + node_id:
            return bytes(message.data).hex()
    return None


def test_time_passes_while_all_wait(join: Join) -> None:
    one, other = join(11), join(12)
    with ThreadPoolExecutor() as pool:
        long = pool.submit(until, one, 10)
        assert until(other, 1) == pytest.approx(1, abs=0.01)
        assert not long.done()  # the other one waits for nothing now, and holds the time up
        other.shutdown()
        assert long.result(5) == pytest.approx(10, abs=0.01)


def test_each_asks_its_own_node_and_hears_the_other(join: Join) -> None:
    one, other = join(11), join(12)

    def ask(bus: HubBus, node_id: int) -> str | None:
        answer = upload(bus, node_id)
        bus.shutdown()
        return answer

    with ThreadPoolExecutor() as pool:
        asked = [pool.submit(ask, one, 11), pool.submit(ask, other, 12)]
        assert [it.result(5) for it in asked] == ["430010009a010307"] * 2


def test_alone_it_hears_every_node(join: Join) -> None:
    bus = join(11)
    assert upload(bus, 12) == "430010009a010307"


def test_it_can_leave_and_come_back(join: Join, hub: Hub) -> None:
    bus = join(11)
    assert upload(bus, 11) is not None
    left_s = bus.now()
    bus.shutdown()
    again = HubBus("hub", hub.ends[0], 125_000, 11)
    assert again.now() >= left_s
    assert upload(again, 11) is not None
    again.shutdown()


def test_the_surroundings_are_those_of_all_nodes(join: Join) -> None:
    bus = join(11)
    assert bus.label() == "1"
    bus.power_off()
    assert upload(bus, 11) is None
    bus.power_on()
    assert upload(bus, 12) is not None
    assert bus.connect(1)
    assert not bus.connect(3)


def test_who_is_gone_holds_nobody_up(join: Join, hub: Hub) -> None:
    one, other = join(11), join(12)
    hub.ends[1].close()
    assert one.recv(3) is not None
    with pytest.raises(can.CanOperationError, match="is gone"):
        other.recv(1)


def test_an_answer_that_was_interrupted_is_not_taken_for_the_next_one(join: Join) -> None:
    one, other = join(11), join(12)
    waiting = threading.get_ident()

    def interrupt_then_let_time_pass() -> None:
        signal.pthread_kill(waiting, signal.SIGINT)
        other.shutdown()

    with interruptible():
        threading.Timer(0.3, interrupt_then_let_time_pass).start()
        with pytest.raises(KeyboardInterrupt):
            one.recv(0.1)
        assert one.frame_count == 0
        assert until(one, 1.0) == pytest.approx(1.0)
