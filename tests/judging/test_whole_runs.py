"""Recordings of whole runs and tours, spoiled by chance: no sound device fails, and each defect does."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from recorded_session import SPECS, write
from recorded_tour import tour
from spoiled import SPOILS, Spoil

from conformance.judging.record import Judging
from conformance.judging.recording import Recording, read_recording
from conformance.report.results import Results
from conformance.spec.load import load_spec

DEVICES = ("siko_ims360", "baumer_gim140r", "danfoss_dst_x730")
SEEDS = (0, 3)
"""The latter cuts so that a single witness would fail a sound device."""

SHOWN = {"BOOT-01", "HB-01", "HB-02", "HB-03", "HB-04", "HB-05", "NMT-01", "NMT-02"}
SERVICES = "HB-0 or NMT-01 or BOOT-01 or LSS-0 or TPDO-05"


def _judge(device: str, recording: Recording) -> Results:
    spec = load_spec(SPECS / f"{device}.yaml").resolve(None, None)
    return Judging(recording, spec, spec.bitrate, 1.0).results()


def _requirements(results: Results, verdict: str) -> set[str]:
    return {it.requirement for it in results.items if it.verdict == verdict}


@pytest.mark.parametrize("device", DEVICES)
def test_a_tour_of_a_sound_device_shows_what_it_tries(device: str, tmp_path: Path) -> None:
    results = _judge(device, read_recording(write(tour(device), tmp_path / "tour.log")))

    assert _requirements(results, "fail") == set()
    assert _requirements(results, "pass") >= SHOWN


@pytest.mark.parametrize("device", DEVICES)
def test_a_spoiled_tour_fails_no_sound_device(device: str, tmp_path: Path) -> None:
    recording = read_recording(write(tour(device), tmp_path / "tour.log"))

    _spoil(device, recording, SPOILS, SEEDS)


@pytest.mark.parametrize("device", DEVICES)
def test_a_spoiled_run_fails_no_sound_device(
    device: str, command: Callable[..., Any], tmp_path: Path
) -> None:
    folder = tmp_path / "record"
    finished = command("run", device, "--select", SERVICES, "--report-dir", folder)
    assert finished.code == 0

    _spoil(device, read_recording(folder / "trace.log"), SPOILS, SEEDS[:1])


def _spoil(
    device: str, recording: Recording, spoils: tuple[Spoil, ...], seeds: tuple[int, ...]
) -> None:
    for spoil in spoils:
        for seed in seeds:
            chance = random.Random(seed)  # noqa: S311 - repeatable
            spoiled = spoil(recording, chance)
            if not spoiled.seen:
                continue
            results = _judge(device, spoiled)
            failed = [it.id for it in results.items if it.verdict == "fail"]
            assert (spoil.__name__, seed, failed) == (spoil.__name__, seed, [])
            assert not results.illegal


@pytest.mark.parametrize(
    ("fault", "device", "requirements"),
    [
        ("heartbeat-starts-late", "siko_ims360", {"HB-02"}),
        ("heartbeat-never-stops", "baumer_gim140r", {"HB-03"}),
        ("accepts-out-of-range", "siko_ims360", {"HB-04"}),
        ("nmt-start-ignored", "siko_ims360", {"HB-05", "NMT-01"}),
        ("nmt-stop-ignored", "siko_ims360", {"HB-05", "NMT-01"}),
        ("nmt-pre-operational-ignored", "danfoss_dst_x730", {"HB-05", "NMT-01"}),
        ("nmt-broadcast-ignored", "baumer_gim140r", {"HB-05", "NMT-01"}),
        ("sdo-in-stopped", "siko_ims360", {"NMT-02"}),
        ("no-boot-up", "siko_ims360", {"BOOT-01"}),
        ("lss-wrong-identity", "siko_ims360", {"LSS-06"}),
        ("lss-wrong-node-id", "siko_ims360", {"LSS-07"}),
        ("lss-fills-unused", "siko_ims360", {"LSS-12"}),
        ("reads-write-only", "siko_ims360", {"OD-07"}),
        ("wrong-device-type", "siko_ims360", {"OD-09"}),
        ("sdo-echoes-data", "siko_ims360", {"SDO-29"}),
        ("sdo-wrong-abort-code", "siko_ims360", {"OD-06"}),
    ],
)
def test_a_defect_fails_what_it_offends(
    fault: str, device: str, requirements: set[str], tmp_path: Path
) -> None:
    recording = read_recording(write(tour(device, [fault]), tmp_path / "tour.log"))

    assert _requirements(_judge(device, recording), "fail") == requirements
