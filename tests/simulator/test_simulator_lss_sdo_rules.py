"""LSS and SDO as the manuals restrict them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import pytest

if TYPE_CHECKING:
    from tests.simulator.conftest import Wired

Build: TypeAlias = "Callable[..., Wired]"

CONFIGURE = "7E5#0401000000000000"
IDENTITY = (0x5F, 0x540, 0, 1)
"""Vendor, product, revision and serial number of the simulated GIM140R."""

STATES = {"operational": 0x01, "stopped": 0x02, "pre-operational": 0x80}


def lss(command: int, value: int = 0) -> str:
    return f"7E5#{command:02X}{value.to_bytes(4, 'little').hex()}000000"


def selected(device: Wired) -> list[str]:
    """What comes when the device is switched to configuration by its identity."""
    return [
        frame
        for place, number in enumerate(IDENTITY)
        for frame in device.run(0.01, lss(0x40 + place, number))
    ]


def identified(device: Wired) -> list[str]:
    """What comes when the device is asked for by ranges around its identity."""
    vendor, product, revision, serial = IDENTITY
    numbers = (vendor, product, revision, revision, serial, serial)
    return [
        frame
        for place, number in enumerate(numbers)
        for frame in device.run(0.01, lss(0x46 + place, number))
    ]


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("reading", [1, 2])
def test_lss_works_in_stopped(gim: Build, state: str, reading: int) -> None:
    device = gim({"GIM-102": reading})
    device.set(x1800_5=0)
    device.nmt(STATES[state])
    works = state == "stopped" or reading == 2
    assert selected(device) == (["7E4#4400000000000000"] if works else [])
    assert device.run(0.01, lss(0x5D)) == (["7E4#5D01000000000000"] if works else [])
    assert device.run(0.01, lss(0x04, 0), lss(0x5D)) == []
    assert identified(device) == (["7E4#4F00000000000000"] if works else [])


def test_lss_left_in_configuration_is_deaf_outside_stopped(gim: Build) -> None:
    device = gim()
    device.nmt(0x02)
    device.run(0.01, CONFIGURE)
    device.nmt(0x80)
    assert device.run(0.01, lss(0x5D)) == []
    device.nmt(0x02)
    assert device.run(0.01, lss(0x5D)) == ["7E4#5D01000000000000"]


def test_the_answer_to_a_selective_switch_may_tell_the_mode(gim: Build) -> None:
    device = gim({"GIM-109": 2})
    device.nmt(0x02)
    assert selected(device) == ["7E4#4401000000000000"]


@pytest.mark.parametrize(
    ("ambiguity", "request_", "answer"),
    [
        ("GIM-106", lss(0x5E), ["7E4#5E01000000000000"]),
        ("GIM-105", None, ["7E4#4F00000000000000"]),
    ],
)
@pytest.mark.parametrize("reading", [1, 2])
def test_a_service_may_be_missing(
    gim: Build, ambiguity: str, request_: str | None, answer: list[str], reading: int
) -> None:
    device = gim({ambiguity: reading})
    device.nmt(0x02)
    device.run(0.01, CONFIGURE)
    frames = identified(device) if request_ is None else device.run(0.01, request_)
    assert frames == (answer if reading == 1 else [])


@pytest.mark.parametrize("reading", [1, 2])
def test_a_bit_rate_is_activated_if_that_is_supported(gim: Build, reading: int) -> None:
    device = gim({"GIM-104": reading})
    device.nmt(0x02)
    device.run(0.01, CONFIGURE, "7E5#1300020000000000", "7E5#1505000000000000")
    assert device.device.bitrate == (500_000 if reading == 1 else 250_000)


def test_what_lss_stores_shows_in_the_objects_and_their_aliases(gim: Build) -> None:
    device = gim()
    device.nmt(0x02)
    frames = device.run(
        0.01, CONFIGURE, "7E5#1105000000000000", "7E5#1300040000000000", "7E5#1700000000000000"
    )
    assert frames == ["7E4#1100000000000000", "7E4#1300000000000000", "7E4#1700000000000000"]
    assert device.reset("power cycle") == ["705#00"]
    assert [device.read(it) for it in (0x2101, 0x3001, 0x2100, 0x3000)] == [5, 5, 4, 4]
    assert device.device.bitrate == 125_000


@pytest.mark.parametrize(
    ("name", "readings", "answers"),
    [
        ("gim", {}, ["41 0A 10 00 04 00 00 00", "07 31 2E 33 30 00 00 00"]),
        ("gim", {"GIM-117": 2}, ["43 0A 10 00 31 2E 33 30"]),
        ("dst", {}, ["43 0A 10 00 31 2E 32 34"]),
        ("dst", {"DST-44": 2}, ["41 0A 10 00 04 00 00 00", "07 31 2E 32 34 00 00 00"]),
    ],
)
def test_a_text_of_four_characters(
    request: pytest.FixtureRequest, name: str, readings: dict[str, int], answers: list[str]
) -> None:
    build: Build = request.getfixturevalue(name)
    device = build(readings)
    seen = [device.ask("40 0A 10 00 00 00 00 00")]
    if len(answers) > 1:
        seen.append(device.ask("60 00 00 00 00 00 00 00"))
    assert seen == answers


def test_a_segmented_download_may_be_unsupported(gim: Build, ims: Build) -> None:
    start = "21 17 10 00 02 00 00 00"
    assert gim().ask(start) == "80 17 10 00 00 00 01 06"
    device = ims()
    assert device.ask(start) == "60 17 10 00 00 00 00 00"
    assert device.ask("0B 64 00 00 00 00 00 00") == "20 00 00 00 00 00 00 00"
    assert device.read(0x1017) == 100
