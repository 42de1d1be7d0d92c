"""Settings that by a reading act only after a store and a restart: judged, and put back as they were."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance import resources
from conformance.catalogue import load_checks
from conformance.spec.load import load_spec

DST, GIM = "danfoss_dst_x730", "baumer_gim140r"
WAITING = {
    DST: ("--variant", "xy-30", "--reading", "DST-122=2"),
    GIM: ("--variant", "two-dimensional", "--reading", "GIM-35=2"),
}
SETTINGS = "DEV-08 or DEV-16 or DEV-17 or DEV-20 or TPDO or SYNC"
ALLOWED = "reads, writes, resets"


@pytest.fixture
def bench_allowing(tmp_path: Path) -> Callable[..., Path]:
    """Write a bench with the simulated device that allows some effects only."""

    def write(allowed: str, power: str = "none") -> Path:
        path = tmp_path / "bench.yaml"
        path.write_text(
            "format: 1\nwhat: A careful bench.\ninterface: canopen_simulator\n"
            f"stimulus: {{tilt: simulator}}\npower: {power}\nallow: [{allowed}]\n",
            encoding="utf-8",
        )
        return path

    return write


@pytest.mark.parametrize("device", WAITING)
def test_a_device_whose_settings_wait_conforms_and_keeps_what_it_had(
    device: str, judge: Callable[..., Any]
) -> None:
    finished = judge(*WAITING[device], "--select", SETTINGS, device=device)

    assert finished.code == 0
    assert finished.items("inconclusive") == []
    assert finished.record["run"]["as_found"]["differences"] == []
    assert finished.record["run"]["non_volatile_writes"] > 0


@pytest.mark.parametrize(
    ("change", "select"),
    [
        ("0x1800/subs/5/default=0", "TPDO-01 or TPDO-02 or TPDO-03 or SYNC-02"),
        ("0x1800/subs/2/default=1", "TPDO-01 or TPDO-02 or TPDO-03 or SYNC-02"),
        ("0x6011/default=3", "DEV"),
        ("0x6011/default=0", "DEV-16 or DEV-17 or DEV-20 or (OD-1 and 6000h)"),
    ],
)
def test_a_device_that_has_other_settings_in_force_conforms(
    change: str, select: str, judge: Callable[..., Any]
) -> None:
    finished = judge(
        *(*WAITING[DST], "--fault", f"objects/{change}", "--select", select), device=DST
    )

    assert finished.code == 0
    assert finished.items("inconclusive") == []


@pytest.mark.parametrize(
    ("device", "fault", "requirement"),
    [
        (DST, "tpdo-timer-slow-10-percent", "TPDO-02"),
        (DST, "tpdo-sync-off-by-one", "TPDO-03"),
        (DST, "tpdo-new-event-time-stops", "TPDO-08"),
        (DST, "tpdo-first-late", "TPDO-10"),
        (DST, "sync-extended", "SYNC-05"),
        (DST, "inversion-ignored", "DEV-08"),
        (DST, "accepts-in-any-state", "DEV-20"),
        (DST, "resolution-keeps-offsets", "DEV-17"),
        (GIM, "resolution-reversed", "DEV-16"),
    ],
)
def test_a_defect_is_seen_though_settings_wait(
    device: str, fault: str, requirement: str, judge: Callable[..., Any]
) -> None:
    finished = judge(*WAITING[device], "--fault", fault, "--select", requirement, device=device)

    assert finished.code == 1
    assert finished.requirements("fail") == {requirement}
    assert finished.record["run"]["as_found"]["differences"] == []


@pytest.mark.parametrize("fault", ["stored-values-never-act", "store-forgets"])
@pytest.mark.parametrize(
    ("device", "requirements"),
    [(DST, {"DEV-08", "DEV-16", "DEV-20", "TPDO-02", "TPDO-03"}), (GIM, {"DEV-16"})],
)
def test_a_setting_that_acts_neither_at_once_nor_once_stored_fails(
    device: str, requirements: set[str], fault: str, judge: Callable[..., Any]
) -> None:
    select = " or ".join(sorted(requirements))

    finished = judge(*WAITING[device], "--fault", fault, "--select", select, device=device)

    assert finished.code == 1
    assert finished.requirements("fail") == requirements
    assert {"DST-122": 2} not in [it["readings"] for it in finished.record["items"]]


@pytest.mark.parametrize("device", WAITING)
def test_a_bench_that_does_not_allow_a_store_leaves_them_open(
    device: str, judge: Callable[..., Any], bench_allowing: Callable[..., Path]
) -> None:
    bench = bench_allowing(ALLOWED)

    finished = judge(*WAITING[device], "--bench", bench, "--select", SETTINGS, device=device)

    assert finished.code == 2
    assert finished.items("fail") == []
    reasons = {it["reason"] for it in finished.record["items"] if it["verdict"] == "inconclusive"}
    sentence = " may act only after a store and a restart, which the bench does not allow"
    assert reasons
    assert all(reason.endswith(sentence) for reason in reasons)
    assert finished.record["run"]["non_volatile_writes"] == 0
    assert "#8100" not in (finished.folder / "trace.log").read_text(encoding="utf-8")


def test_a_device_that_takes_settings_at_once_needs_no_store(
    judge: Callable[..., Any], bench_allowing: Callable[..., Path]
) -> None:
    bench = bench_allowing(ALLOWED)

    finished = judge("--bench", bench, "--select", SETTINGS, "--variant", "xy-30", device=DST)

    assert finished.code == 0
    assert finished.record["run"]["non_volatile_writes"] == 0


def test_without_the_supply_what_shows_no_effect_stays_open(
    judge: Callable[..., Any], bench_allowing: Callable[..., Path]
) -> None:
    bench = bench_allowing(f"{ALLOWED}, non-volatile")
    options = (*WAITING[DST], "--bench", bench, "--select", "TPDO-02 or DEV-08")

    assert judge(*options, device=DST).code == 0
    finished = judge(*options, "--fault", "stored-values-never-act", device=DST)

    assert finished.code == 2
    assert finished.requirements("inconclusive") == {"TPDO-02", "DEV-08"}


def test_what_may_store_says_so_for_each_item() -> None:
    at_need: dict[str, set[str]] = {}
    for device in ("siko_ims360", GIM, DST):
        spec = load_spec(resources.find("device_specs", device, "DEVICE")).resolve()
        at_need[device] = {
            check.id
            for check in load_checks().values()
            for case in check.cases(spec)
            if case.at_need
        }

    assert at_need["siko_ims360"] == set()
    assert at_need[GIM] == {"DEV-16", "DEV-17"}
    assert {"OD-11", "DEV-01", "DEV-08", "DEV-20", "SYNC-02", "TPDO-02", "TPDO-08"} < at_need[DST]
    assert "DEV-02" not in at_need[DST], "it changes no setting"
