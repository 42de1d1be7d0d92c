"""The low-pass filters of a simulated device: known step responses, and what chooses among them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

from conformance.simulator.filters import step_left
from conformance.simulator.interface import SimulatorBus

Open: TypeAlias = Callable[..., SimulatorBus]
Ask: TypeAlias = Callable[..., str]
Hear: TypeAlias = Callable[..., list[str]]

IMS, DST = "siko_ims360:two-axis", "danfoss_dst_x730:xy-60"


@pytest.mark.parametrize("hertz", [0.1, 2.0, 25.0])
@pytest.mark.parametrize(
    ("kind", "order", "cycles", "shown"),
    [
        ("critically-damped", 1, 1.0, 0.998133),
        ("butterworth", 1, 1.0, 0.998133),
        ("critically-damped", 8, 0.2, 0.0624),
        ("critically-damped", 8, 0.4, 0.5953),
        ("critically-damped", 8, 1.0, 0.9996),
        ("butterworth", 2, 0.7072, 1.0432),
        ("butterworth", 8, 0.9, 0.5532),
        ("butterworth", 8, 1.35, 1.1634),
    ],
)
def test_a_step_response_is_that_of_the_textbook(
    hertz: float, kind: str, order: int, cycles: float, shown: float
) -> None:
    left = step_left(kind, order, hertz)
    assert 1 - left(cycles / hertz) == pytest.approx(shown, abs=2e-4)
    assert left(0.0) == pytest.approx(1.0)
    assert abs(left(20 / hertz)) < 1e-5


@pytest.mark.parametrize(
    ("channel", "writes", "value", "faults", "shown"),
    [
        (IMS, [], "6110", "", 2381),
        (IMS, ["2F10310100"], "6110", "", 4000),
        (IMS, ["2F10310101"], "6110", "", 34),
        (IMS, ["2B113100A00F"], "6110", "", 3974),
        (IMS, [], "6110", "filter-overshoots", 34),
        (IMS, ["2F10310101"], "6110", "filter-never-overshoots", 2381),
        (IMS, ["2B113100A00F"], "6110", "filter-cut-off-ignored", 250),
        (IMS, [], "6120", "", -1191),
        (IMS, ["2F10310201"], "6110", "", 4000),
        (IMS, ["2F10310201"], "6110", "fusion-lags", 2381),
        (DST, [], "6010", "", 478),
        (DST, ["2F01200002"], "6010", "", 478),
        (DST, ["2F01200002"], "6010", "filter-acts-unsaved", 795),
        (DST, ["2F01200002", "2310100173617665"], "6010", "", 795),
        (DST, [], "6010", "filters-reversed", 795),
    ],
)
def test_a_value_follows_a_turn_as_its_filter_lets_it(
    open_bus: Open,
    ask: Ask,
    hear: Hear,
    channel: str,
    writes: list[str],
    value: str,
    faults: str,
    shown: int,
) -> None:
    node = {IMS: 0x32, DST: 0x7F}[channel]
    bus = open_bus(channel, faults=faults)
    hear(bus, 0.5)
    bus.set_tilt(0.0, 0.0)
    hear(bus, 5.0)
    for data in writes:
        assert ask(bus, f"{data:0<16}", node).startswith("60")
    bus.set_tilt(40.0, -20.0)
    hear(bus, 0.2)
    answer = bytes.fromhex(ask(bus, f"40{value[2:]}{value[:2]}0000000000", node))
    assert int.from_bytes(answer[4:6], "little", signed=True) == pytest.approx(shown, abs=40)
