from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import can
import pytest

from conformance.errors import SpecError
from conformance.resources import names
from conformance.simulator.fault_files import FOLDER, load_faults, read_fault
from conformance.simulator.faults import Faults
from conformance.simulator.interface import SimulatorBus
from conformance.spec.yaml_reader import read_yaml

Open = Callable[..., SimulatorBus]
Ask = Callable[..., str]
Tell = Callable[..., None]
Hear = Callable[[SimulatorBus, float], list[str]]
Times = Callable[[SimulatorBus, float, str], list[int]]

EFFECTS: dict[str, dict[str, str]] = read_yaml(Path(__file__).parent / "fault_effects.yaml").data
IN_VALUES = read_yaml(Path(__file__).parent / "function_fault_effects.yaml").data.keys()
OTHERS = {
    "bit-rate-alias-stale",
    "bus-off-always-left",
    "bus-off-untold",
    "byte-order-ignored",
    "counts-turns",
    "dies-after-20-frames",
    "emcy-second-error-untold",
    "error-passive-untold",
    "emcy-without-manufacturer-code",
    "filter-acts-unsaved",
    "filter-cut-off-ignored",
    "filter-never-overshoots",
    "filter-overshoots",
    "filters-reversed",
    "fusion-lags",
    "garbage",
    "heartbeat-jitter-20-ms",
    "heartbeat-slow-10-percent",
    "history-codes-lost",
    "history-of-four",
    "history-oldest-first",
    "lapse-event-time-after-sync",
    "lapse-heartbeat-after-stop",
    "lapse-mapping-after-reset",
    "lapse-sdo-after-sync",
    "lapse-tpdo-after-stop",
    "lapse-tpdo-after-store",
    "light-ignores-bus-errors",
    "light-on-in-stopped",
    "light-red-without-error",
    "light-without-supply",
    "lights-ignore-limits",
    "lights-steady-in-lss",
    "node-id-alias-stale",
    "overrun-deaf",
    "overrun-restarts",
    "overrun-wrong-code",
    "own-cob-ids-stay",
    "pair-needs-one",
    "optional-objects-half-done",
    "reset-command-ignored",
    "sdo-cob-id-stays",
    "sdo-takes-any-block-size",
    "sdo-wrong-crc",
    "silent",
    "stops-before-the-end",
    "start-object-ignored",
    "stored-values-never-act",
    "supply-error-early",
    "supply-restarts-early",
    "tpdo-blanks-one-object",
    "tpdo-jitter-20-ms",
    "tpdo-sync-off-by-one",
    "tpdo-timer-slow-10-percent",
}
"""Faults that a list of frames does not show."""


def perform(bus: SimulatorBus, script: str, tell: Tell, hear: Hear) -> str:
    """Do what a script says and return the frames heard."""
    rig: dict[str, Callable[[], None]] = {
        "off": bus.power_off,
        "on": bus.power_on,
        "tilt": lambda: bus.set_tilt(1, 2),
        "error": lambda: bus.raise_error(0x3100),
        "gone": lambda: bus.clear_error(0x3100),
    }
    heard: list[str] = []
    for step in script.split():
        if step.endswith("ms"):
            heard += hear(bus, int(step[:-2]) / 1000)
        elif step in rig:
            rig[step]()
        else:
            tell(bus, step)
    return " ".join(heard)


@pytest.mark.parametrize("fault", EFFECTS)
def test_a_fault_shows_on_the_bus(open_bus: Open, tell: Tell, hear: Hear, fault: str) -> None:
    effect = EFFECTS[fault]
    bus = open_bus()
    assert perform(bus, effect["do"], tell, hear) == effect["without"]
    bus.shutdown()
    assert perform(open_bus(faults=fault), effect["do"], tell, hear) == effect["with"]
    assert effect["with"] != effect["without"]


def test_every_fault_file_is_tested_and_every_knob_has_a_file() -> None:
    assert EFFECTS.keys() | IN_VALUES | OTHERS == set(names(FOLDER))
    turned = {knob for name in names(FOLDER) for knob in load_faults([name]).model_fields_set}
    assert turned == set(Faults.model_fields)


@pytest.mark.parametrize("name", names(FOLDER))
def test_a_fault_says_in_one_sentence_what_it_stands_for(name: str) -> None:
    what = read_fault(name).what
    assert what.endswith(".")
    assert what.count(". ") == 0


def test_a_silent_device_sends_nothing_at_all(open_bus: Open, tell: Tell, hear: Hear) -> None:
    bus = open_bus(faults="silent")
    tell(bus, "000#810A")
    assert hear(bus, 0.5) == []


def test_garbage_answers_every_frame_on_the_sdo_identifier(
    open_bus: Open, tell: Tell, hear: Hear
) -> None:
    bus = open_bus(faults="garbage")
    assert hear(bus, 0.3) == ["70A#00"]
    answers = []
    for _ in range(50):
        tell(bus, "60A#4000100000000000")
        heard = hear(bus, 0.1)
        assert heard
        answers += heard
    assert {answer[:4] for answer in answers} == {"58A#"}
    assert {len(answer) for answer in answers} > {4, 20}, "of every length"


def test_a_dying_device_lives_again_after_a_power_cycle(
    open_bus: Open, tell: Tell, hear: Hear
) -> None:
    bus = open_bus(faults="dies-after-20-frames")
    tell(bus, *["60A#4000100000000000"] * 30)
    hear(bus, 0.3)
    tell(bus, *["60A#4000100000000000"] * 30)
    assert len(hear(bus, 0.5)) == 19, "boot-up was the first"
    bus.power_off()
    bus.power_on()
    assert hear(bus, 0.3) == ["70A#00"]


def test_a_slow_heartbeat_is_slow_by_its_factor(with_faults: Open, ask: Ask, times: Times) -> None:
    bus = with_faults("heartbeat-slow-10-percent")
    ask(bus, "2B 17 10 00 64 00 00 00")
    beats = times(bus, 2.0, "70A")
    assert beats[10] - beats[0] == 1_100_000_000


def test_a_jittery_heartbeat_comes_late_at_random_but_does_not_drift(
    with_faults: Open, ask: Ask, times: Times
) -> None:
    bus = with_faults("heartbeat-jitter-20-ms")
    start = bus.now() * 1e9
    ask(bus, "2B 17 10 00 64 00 00 00")
    beats = times(bus, 10.0, "70A")
    late_ms = [(beat - start) / 1e6 - 100 * number for number, beat in enumerate(beats)]
    assert 0 < min(late_ms) < 5
    assert 15 < max(late_ms) < 21


def test_a_slow_event_timer_is_slow_by_its_factor(
    with_faults: Open, tell: Tell, ask: Ask, times: Times
) -> None:
    bus = with_faults("tpdo-timer-slow-10-percent")
    ask(bus, "2B 00 18 05 64 00 00 00")
    tell(bus, "000#010A")
    sent = times(bus, 2.0, "18A")
    assert sent[10] - sent[0] == 1_100_000_000


def test_a_jittery_event_timer_is_late_at_random_but_does_not_drift(
    with_faults: Open, tell: Tell, ask: Ask, times: Times
) -> None:
    bus = with_faults("tpdo-jitter-20-ms")
    ask(bus, "2B 00 18 05 64 00 00 00")
    start = bus.now() * 1e9
    tell(bus, "000#010A")
    late_ms = [
        (sent - start) / 1e6 - 100 * number for number, sent in enumerate(times(bus, 10, "18A"))
    ]
    assert len(late_ms) == 100
    assert 15 < max(late_ms) < 21


def test_a_synchronous_tpdo_comes_one_sync_late(
    with_faults: Open, tell: Tell, ask: Ask, hear: Hear
) -> None:
    bus = with_faults("tpdo-sync-off-by-one")
    ask(bus, "2F 00 18 02 02 00 00 00")
    tell(bus, "000#010A", "080#", "080#")
    assert hear(bus, 0.1) == []
    tell(bus, "080#")
    assert hear(bus, 0.1) == ["18A#1A0457FE"]


def test_several_faults_act_together(open_bus: Open, hear: Hear, ask: Ask) -> None:
    bus = open_bus(faults=["boot-up-twice", "sdo-wrong-size"])
    assert hear(bus, 0.3) == ["70A#00", "70A#00"]
    assert ask(bus, "40 08 10 00 00 00 00 00") == "41 08 10 00 0C 00 00 00"


def write(path: Path, *lines: str) -> str:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def test_a_fault_file_works_by_path(tmp_path: Path) -> None:
    path = write(
        tmp_path / "mine.yaml", "format: 1", "what: Mine.", "inject: {od_readback_stale: 0x2004}"
    )
    assert load_faults([path]).od_readback_stale == 0x2004
    assert load_faults([]) == Faults()


@pytest.mark.parametrize(
    ("inject", "message"),
    [
        ("{heartbeat_period_facto: 2}", "mine.yaml:3: inject.heartbeat_period_facto"),
        ("{heartbeat_period_factor: -1}", "mine.yaml:3: inject.heartbeat_period_factor"),
        ("{nmt_ignores: [sleep]}", "mine.yaml:3: inject.nmt_ignores.0"),
        ("{silent: 1}", "mine.yaml:3: inject.silent"),
    ],
)
def test_a_mistake_in_a_fault_file_is_told_with_its_line(
    tmp_path: Path, inject: str, message: str
) -> None:
    path = write(tmp_path / "mine.yaml", "format: 1", "what: Mine.", f"inject: {inject}")
    with pytest.raises(SpecError) as caught:
        load_faults([path])
    assert message in str(caught.value)


def test_two_faults_that_turn_one_knob_differently_are_refused() -> None:
    with pytest.raises(SpecError, match=r"expected 1\.1 as in heartbeat-slow-10-percent"):
        load_faults(["heartbeat-slow-10-percent", "heartbeat-double-period"])


def test_faults_never_stop_the_bus(open_bus: Open, tell: Tell) -> None:
    for name in names(FOLDER):
        bus = open_bus(faults=name)
        bus.recv(0.5)
        tell(bus, "000#0100", "60A#4008100000000000", "60A#E000000000000000", "080#", "18A#R")
        while bus.recv(0.05) is not None and bus.now() < 2:
            pass
        assert isinstance(bus, can.BusABC)
        bus.shutdown()
