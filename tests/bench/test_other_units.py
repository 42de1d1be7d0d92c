"""What is sent on a bus with other units: nothing that concerns them."""

from __future__ import annotations

import can
import pytest

from conformance.bench.bus.link import Link
from conformance.bench.bus.other_units import OtherUnits
from conformance.bench.bus.trace import Trace
from conformance.errors import NotAlone, NotNow
from conformance.simulator.interface import SimulatorBus
from conformance.wire.frame import Frame

COB_IDS = [(0x1800, 1), (0x1014, 0)]


def others(*, judged: bool) -> OtherUnits:
    return OtherUnits([11, 12], COB_IDS, judged=judged)


def frame(text: str) -> Frame:
    can_id, _, data = text.partition("#")
    return Frame(int(can_id, 16), bytes.fromhex(data))


@pytest.mark.parametrize(
    "text",
    [
        "000#8100",
        "000#01",
        "000#010B",
        "60C#4000100000000000",
        "20B#00",
        "70B#",
        "7E5#0401000000000000",
        "7E5#4000000000000000",
    ],
)
@pytest.mark.parametrize("judged", [True, False])
def test_what_other_units_would_take_for_theirs_is_never_sent(text: str, judged: bool) -> None:
    with pytest.raises(NotAlone):
        others(judged=judged).respect(frame(text))


@pytest.mark.parametrize(
    "text",
    [
        "080#",
        "080#01",
        "100#000000000000",
        "60A#23001801A1060000",  # COB-ID 6A1h, which others may be given as well
        "60A#2114100004000000",  # in segments
        "60A#C200180104000000",  # in blocks
    ],
)
def test_what_disturbs_their_judging_has_to_wait(text: str) -> None:
    with pytest.raises(NotNow):
        others(judged=True).respect(frame(text))
    others(judged=False).respect(frame(text))


@pytest.mark.parametrize(
    "text",
    [
        "000#810A",
        "60A#4000100000000000",
        "60A#230018018A010080",  # off
        "60A#230018018A010000",  # its own again
        "60A#2B17100064000000",
        "70A#",
        "7F0#0001",
    ],
)
def test_what_concerns_the_unit_alone_is_sent(text: str) -> None:
    others(judged=True).respect(frame(text))


def test_requests_leave_room_for_those_of_others() -> None:
    assert others(judged=True).pause_s(0.001) == pytest.approx(2 * 0.001 * 3 / 0.7)
    assert others(judged=False).pause_s(0.001) == 0


@pytest.mark.parametrize("judged", [True, False])
def test_a_link_sends_no_more_than_its_share(judged: bool) -> None:
    bus = can.Bus(interface="canopen_simulator", channel="siko_ims360@10")
    assert isinstance(bus, SimulatorBus)
    link = Link(bus, Trace(None), 125_000)
    link.others = others(judged=judged)
    link.listen(1, lambda _: False)  # it boots
    request = frame("60A#4000100000000000")
    begun_s = link.now()
    for _ in range(10):
        link.send(request)
        link.wait(lambda it: it.can_id == 0x58A, 0.1)
    taken_s = link.now() - begun_s
    link.close()
    assert (taken_s > 9 * 2 * 0.0009 * 3 / 0.7) == judged
