from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from conformance.resources import data
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.fault_files import load_faults
from conformance.simulator.interface import SimulatorBus
from conformance.spec.load import load_spec
from conformance.wire.frame import Frame

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]

SAVE, LOAD = "73 61 76 65", "6C 6F 61 64"
HEARTBEAT = "40 17 10 00 00 00 00 00"
FILTER = "40 04 20 00 00 00 00 00"


def restart(bus: SimulatorBus, tell: Tell, hear: Hear, how: str) -> None:
    if how == "power cycle":
        bus.power_off()
        hear(bus, 0.1)
        bus.power_on()
    else:
        tell(bus, "000#810A")
    hear(bus, 0.3)


def change(bus: SimulatorBus, ask: Ask) -> None:
    """Set 1017h to 1000 ms and 2004h to 5."""
    assert ask(bus, "2B 17 10 00 E8 03 00 00")[:2] == "60"
    assert ask(bus, "2F 04 20 00 05 00 00 00")[:2] == "60"


def values(bus: SimulatorBus, ask: Ask) -> tuple[int, int]:
    heartbeat, filter_ = ask(bus, HEARTBEAT), ask(bus, FILTER)
    return int(heartbeat[15:17] + heartbeat[12:14], 16), int(filter_[12:14], 16)


@pytest.mark.parametrize("how", ["power cycle", "NMT reset node"])
def test_what_was_not_stored_is_gone_after_a_restart(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, how: str
) -> None:
    change(bus, ask)
    restart(bus, tell, hear, how)
    assert values(bus, ask) == (0, 1)


def test_a_stored_value_may_take_the_node_off_canopen() -> None:
    device = SimulatedDevice(load_spec(data("device_specs") / "siko_ims360.yaml"))
    device.memory.values[0x3100, 1] = 1
    device.power_on(0)

    assert device.step(2_000_000_000, [Frame(0x632, bytes.fromhex("4000100000000000"))]) == []


@pytest.mark.parametrize("how", ["power cycle", "NMT reset node"])
def test_what_was_stored_is_there_after_a_restart(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, how: str
) -> None:
    change(bus, ask)
    assert ask(bus, f"23 10 10 01 {SAVE}") == "60 10 10 01 00 00 00 00"
    restart(bus, tell, hear, how)
    assert values(bus, ask) == (1000, 5)


def test_a_group_stores_its_own_indices_only(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    change(bus, ask)
    ask(bus, f"23 10 10 02 {SAVE}")
    restart(bus, tell, hear, "power cycle")
    assert values(bus, ask) == (1000, 1)


def test_what_is_not_persistent_is_not_stored(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    ask(bus, "2B 06 20 00 07 00 00 00")
    ask(bus, f"23 10 10 01 {SAVE}")
    restart(bus, tell, hear, "power cycle")
    assert ask(bus, "40 06 20 00 00 00 00 00") == "4B 06 20 00 FB FF 00 00"


@pytest.mark.parametrize("target", ["10 10 01", "11 10 01"])
@pytest.mark.parametrize("word", ["77 72 6F 6E", "00 00 00 00", "65 76 61 73"])
def test_a_wrong_signature_is_refused(bus: SimulatorBus, ask: Ask, target: str, word: str) -> None:
    assert ask(bus, f"23 {target} {word}") == f"80 {target} 20 00 00 08"


def test_the_signature_objects_keep_reading_their_capability(bus: SimulatorBus, ask: Ask) -> None:
    ask(bus, f"23 10 10 01 {SAVE}")
    assert ask(bus, "40 10 10 01 00 00 00 00") == "43 10 10 01 01 00 00 00"
    ask(bus, f"23 11 10 01 {LOAD}")
    assert ask(bus, "40 11 10 01 00 00 00 00") == "43 11 10 01 01 00 00 00"


@pytest.mark.parametrize("how", ["power cycle", "NMT reset node"])
def test_restored_defaults_last_until_the_second_restart_unless_stored(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear, how: str
) -> None:
    change(bus, ask)
    ask(bus, f"23 10 10 01 {SAVE}")
    assert ask(bus, f"23 11 10 01 {LOAD}") == "60 11 10 01 00 00 00 00"
    assert values(bus, ask) == (1000, 5), "not before the restart"
    restart(bus, tell, hear, how)
    assert values(bus, ask) == (0, 1)
    restart(bus, tell, hear, how)
    assert values(bus, ask) == (1000, 5), "they were not stored"


def test_restored_defaults_that_are_stored_stay(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    change(bus, ask)
    ask(bus, f"23 10 10 01 {SAVE}")
    ask(bus, f"23 11 10 01 {LOAD}")
    restart(bus, tell, hear, "NMT reset node")
    ask(bus, f"23 10 10 01 {SAVE}")
    restart(bus, tell, hear, "power cycle")
    assert values(bus, ask) == (0, 1)


def test_a_reset_of_the_communication_restores_its_part_of_the_defaults(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    change(bus, ask)
    ask(bus, f"23 10 10 01 {SAVE}")
    ask(bus, f"23 11 10 01 {LOAD}")
    tell(bus, "000#820A")
    hear(bus, 0.3)
    assert values(bus, ask) == (0, 5)
    restart(bus, tell, hear, "NMT reset node")
    assert values(bus, ask) == (1000, 1)


def test_defaults_may_need_storing_before_the_restart_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = with_reading("INV-03=2")
    change(bus, ask)
    ask(bus, f"23 10 10 01 {SAVE}")
    ask(bus, f"23 11 10 01 {LOAD}")
    restart(bus, tell, hear, "NMT reset node")
    assert values(bus, ask) == (1000, 5), "restarted without storing"
    ask(bus, f"23 11 10 01 {LOAD}")
    ask(bus, f"23 10 10 01 {SAVE}")
    restart(bus, tell, hear, "NMT reset node")
    assert values(bus, ask) == (0, 1)


def test_defaults_may_be_back_at_once_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus], ask: Ask
) -> None:
    bus = with_reading("INV-03=3")
    change(bus, ask)
    ask(bus, f"23 11 10 01 {LOAD}")
    assert values(bus, ask) == (0, 1)


def test_a_new_node_id_takes_effect_when_stored_and_restarted(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    ask(bus, "2F 02 20 00 0B 00 00 00")
    tell(bus, "000#810A")
    assert hear(bus, 0.3) == ["70A#00"], "it was not stored"
    ask(bus, "2F 02 20 00 0B 00 00 00")
    ask(bus, f"23 10 10 01 {SAVE}")
    tell(bus, "000#810A")
    assert hear(bus, 0.3) == ["70B#00"]
    assert ask(bus, "40 02 20 00 00 00 00 00", node=0x0B) == "4F 02 20 00 0B 00 00 00"
    assert ask(bus, "40 00 18 01 00 00 00 00", node=0x0B) == "43 00 18 01 8B 01 00 00"


def test_a_new_node_id_may_take_effect_without_storing_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = with_reading("INV-01=2")
    ask(bus, "2F 02 20 00 0B 00 00 00")
    assert ask(bus, FILTER)[:2] == "4F"
    tell(bus, "000#810A")
    assert hear(bus, 0.3) == ["70B#00"]


def test_a_new_node_id_may_take_effect_at_once_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = with_reading("INV-01=3")
    change(bus, ask)
    tell(bus, "000#010A")
    assert ask(bus, "2F 02 20 00 0B 00 00 00")[:2] == "60"
    assert hear(bus, 1.01)[-1] == "70B#05", "the state and the heartbeat stay"
    assert ask(bus, FILTER, node=0x0B) == "4F 04 20 00 05 00 00 00"
    assert ask(bus, FILTER) == "silence"


def test_a_new_bit_rate_takes_effect_when_stored_and_restarted(
    bus: SimulatorBus, open_bus: Callable[..., SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    ask(bus, "2F 01 20 00 09 00 00 00")
    ask(bus, f"23 10 10 01 {SAVE}")
    fast = open_bus(bitrate=1_000_000)
    tell(bus, "000#810A")
    assert hear(bus, 0.3) == [], "nothing at the old bit rate"
    assert hear(fast, 0.001) == ["70A#00"]
    assert ask(fast, FILTER) == "4F 04 20 00 01 00 00 00"
    assert ask(bus, FILTER) == "silence"


def test_a_new_bit_rate_may_take_effect_at_once_where_the_spec_says(
    with_reading: Callable[[str], SimulatorBus],
    open_bus: Callable[..., SimulatorBus],
    ask: Ask,
    hear: Hear,
) -> None:
    bus = with_reading("INV-02=3")
    fast = open_bus(bitrate="500000")
    assert ask(bus, "2F 01 20 00 02 00 00 00")[:2] == "60"
    hear(bus, 0.01)
    assert ask(bus, FILTER) == "silence"
    assert ask(fast, FILTER)[:2] == "4F"


def test_a_device_delivered_with_another_node_id_knows_it(
    open_bus: Callable[..., SimulatorBus], tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = open_bus(node_id="0x21")
    assert hear(bus, 0.3) == ["721#00"]
    assert ask(bus, "40 02 20 00 00 00 00 00", node=0x21) == "4F 02 20 00 21 00 00 00"
    ask(bus, f"23 11 10 01 {LOAD}", node=0x21)
    tell(bus, "000#8100")
    assert hear(bus, 0.3) == ["70A#00"], "its factory node-ID"


def test_a_power_cycle_ends_a_transfer_and_drops_frames_not_sent(
    bus: SimulatorBus, tell: Tell, ask: Ask, hear: Hear
) -> None:
    ask(bus, "40 08 10 00 00 00 00 00")
    tell(bus, "60A#6000000000000000")
    bus.power_off()
    assert hear(bus, 0.5) == []
    bus.power_on()
    assert hear(bus, 0.3) == ["70A#00"]
    assert ask(bus, "60 00 00 00 00 00 00 00") == "80 00 00 00 01 00 04 05"


@pytest.mark.parametrize("readings", ["", "INV-01=2,INV-02=2", "INV-01=3,INV-02=3"])
def test_a_node_id_or_bit_rate_that_cannot_be_is_never_used(
    open_bus: Callable[..., SimulatorBus], tell: Tell, ask: Ask, hear: Hear, readings: str
) -> None:
    bus = open_bus(readings=readings, faults="accepts-out-of-range")
    hear(bus, 0.3)
    assert ask(bus, "2F 01 20 00 00 00 00 00")[:2] == "60"
    assert ask(bus, "2F 02 20 00 FF 00 00 00")[:2] == "60"
    ask(bus, f"23 10 10 01 {SAVE}")
    tell(bus, "000#8100")
    assert hear(bus, 0.3) == ["70A#00"]
    assert ask(bus, FILTER)[:2] == "4F"


@pytest.mark.parametrize(("fault", "kept"), [(None, 0), ("restore-lost-at-power-off", 5)])
def test_defaults_that_last_can_be_lost_at_power_off(
    gim: Callable[..., Wired], fault: str | None, kept: int
) -> None:
    device = gim(faults=fault and load_faults([fault]))
    device.set(x2196=5)
    device.save()
    device.load()
    device.reset("power cycle")
    assert device.read(0x2196) == kept


@pytest.mark.parametrize("fault", [None, "restore-lost-at-power-off"])
def test_defaults_are_back_after_an_nmt_reset_all_the_same(
    gim: Callable[..., Wired], fault: str | None
) -> None:
    device = gim(faults=fault and load_faults([fault]))
    device.set(x2196=5)
    device.save()
    device.load()
    device.reset()
    assert device.read(0x2196) == 0


@pytest.mark.parametrize("act", ["save", "load"])
def test_a_signature_can_be_kept_by_a_store_that_takes_its_time(
    gim: Callable[..., Wired], act: str
) -> None:
    device = gim(faults=load_faults(["store-keeps-signature"]))
    getattr(device, act)()
    device.reset()
    assert device.read({"save": "0x1010:1", "load": "0x1011:1"}[act]) != 1
