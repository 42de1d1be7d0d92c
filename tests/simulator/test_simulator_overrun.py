"""A simulated device that is too slow for a full bus."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import pytest

from conformance.simulator.interface import SimulatorBus
from conformance.simulator.overrun import PLACES

Open: TypeAlias = Callable[..., SimulatorBus]
Tell: TypeAlias = Callable[..., None]
Hear: TypeAlias = Callable[[SimulatorBus, float], list[str]]

IMS, GIM, DST = "siko_ims360", "baumer_gim140r", "danfoss_dst_x730"
BOOT_UP, READ, ANSWER = "732#00", "632#4001100000000000", "5B2#4F01100000000000"


def told(folder: Path, *knobs: str) -> Path:
    file = folder / "told.yaml"
    inject = ", ".join(("overrun: told", *knobs))
    file.write_text(f"format: 1\nwhat: An overrun.\ninject: {{{inject}}}\n", encoding="utf-8")
    return file


def burst(bus: SimulatorBus, tell: Tell, hear: Hear, frames: int = 100) -> list[str]:
    hear(bus, 0.5)
    tell(bus, *["6E0#5555555555555555"] * frames)
    return hear(bus, 1.0)


@pytest.mark.parametrize(
    ("device", "frames"),
    [
        (IMS, ["0B2#1081110000000000", "0B2#0000000000000000"]),
        (GIM, ["081#1081110000000000", "081#0000000000000000"]),
        (DST, ["0FF#0010000000000000", "0FF#0000000000000000"]),
    ],
)
def test_an_overrun_is_told_once_and_its_end(
    open_bus: Open, tell: Tell, hear: Hear, tmp_path: Path, device: str, frames: list[str]
) -> None:
    heard = burst(open_bus(device, faults=str(told(tmp_path))), tell, hear)
    assert [frame for frame in heard if not frame.startswith("6E0")] == frames


def test_a_few_frames_are_no_overrun(
    open_bus: Open, tell: Tell, hear: Hear, tmp_path: Path
) -> None:
    assert burst(open_bus(IMS, faults=str(told(tmp_path))), tell, hear, PLACES) == []


@pytest.mark.parametrize(
    ("fault", "heard"),
    [("overrun-wrong-code", "0B2#1181110000000000"), ("overrun-restarts", BOOT_UP)],
)
def test_a_fault_shows_after_an_overrun(
    open_bus: Open, tell: Tell, hear: Hear, fault: str, heard: str
) -> None:
    assert heard in burst(open_bus(IMS, faults=fault), tell, hear)


def test_a_device_as_documented_has_room_for_every_frame(
    open_bus: Open, tell: Tell, hear: Hear
) -> None:
    assert burst(open_bus(IMS), tell, hear, 500) == []


@pytest.mark.parametrize(("fault", "heard"), [("", [ANSWER]), ("overrun-deaf", [])])
def test_a_deaf_device_answers_nothing_more(
    open_bus: Open, tell: Tell, hear: Hear, fault: str, heard: list[str]
) -> None:
    bus = open_bus(IMS, faults=fault)
    burst(bus, tell, hear)
    tell(bus, READ)
    assert hear(bus, 0.1) == heard
