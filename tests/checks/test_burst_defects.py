"""What a device may tell of a burst of frames, and what it may not make of one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")
SELECT = "EMCY-37 or NMT-16"


def fault(folder: Path, knobs: str) -> Path:
    """Write a fault file that turns some knobs."""
    file = folder / "fault.yaml"
    file.write_text(f"format: 1\nwhat: An overrun.\ninject: {{{knobs}}}\n", encoding="utf-8")
    return file


@pytest.mark.parametrize("device", DEVICES)
def test_an_overrun_may_be_told(judge: Callable[..., Any], tmp_path: Path, device: str) -> None:
    told = fault(tmp_path, "overrun: told")

    finished = judge("--fault", told, "--select", SELECT, device=device)

    assert finished.items("pass") == ["EMCY-37/1014h", "NMT-16/operational"]


@pytest.mark.parametrize(
    ("knob", "words"),
    [
        ("emcy_repeats: true", "8110h"),
        ("emcy_never_clears: true", "8110h"),
        ("emcy_wrong_register: true", "[2, 5]"),
        ("emcy_short: true", "[3]"),
    ],
)
def test_an_overrun_told_wrongly_is_seen(
    judge: Callable[..., Any], tmp_path: Path, knob: str, words: str
) -> None:
    wrong = fault(tmp_path, f"overrun: told, {knob}")

    finished = judge("--fault", wrong, "--select", SELECT)

    assert finished.items("fail") == ["EMCY-37/1014h"]
    assert [it["actual"] for it in finished.record["items"] if it["verdict"] == "fail"] == [words]


def test_an_end_that_a_manual_leaves_open_need_not_be_told(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    silent = fault(tmp_path, "overrun: told, emcy_never_clears: true")

    finished = judge("--fault", silent, "--select", SELECT, device="baumer_gim140r")

    assert finished.code == 0
    assert finished.record["items"][0]["readings"] == {"GIM-94": 2}


def test_a_communication_error_may_leave_bit_0_where_a_reading_has_it_so(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    told = ("--fault", fault(tmp_path, "overrun: told"), "--reading", "GIM-143=2")

    finished = judge(*told, "--select", SELECT, device="baumer_gim140r")

    assert finished.code == 0
    assert finished.record["items"][0]["readings"] == {"GIM-143": 2}


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", ["overrun-restarts", "overrun-deaf"])
def test_a_node_that_a_burst_brings_down_is_seen(
    judge: Callable[..., Any], device: str, name: str
) -> None:
    finished = judge("--fault", name, "--select", SELECT, device=device)

    assert finished.items("fail") == ["NMT-16/operational"]
