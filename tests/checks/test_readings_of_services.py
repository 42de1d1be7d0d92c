"""A device that follows any reading of its manual conforms, and one that follows none does not."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SPECS = Path(__file__).parents[2] / "device_specs"
FRAME = re.compile(r"\((\d+\.\d+)\) \S+ ([0-9A-F]{3})#([0-9A-F]*)")


def spec_with(folder: Path, name: str, *changes: tuple[str, str, str]) -> Path:
    """A copy of a spec: (heading after which to look, old text, new text)."""
    text = (SPECS / f"{name}.yaml").read_text(encoding="utf-8")
    for heading, old, new in changes:
        place = text.index(old, text.index(f"\n  {heading}:"))
        text = text[:place] + new + text[place + len(old) :]
    path = folder / "changed.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def followed(finished: Any, requirement: str) -> list[dict[str, int]]:
    return [it["readings"] for it in finished.record["items"] if f"/{requirement}/" in it["id"]]


def test_other_readings_of_start_and_length_are_named(judge: Callable[..., Any]) -> None:
    finished = judge(
        *("--reading", "GIM-16=2", "--reading", "GIM-59=2", "--select", "BOOT-02 or TPDO-05"),
        device="baumer_gim140r",
    )

    assert finished.code == 0
    assert followed(finished, "BOOT-02") == [{"GIM-16": 2}] * 5
    assert followed(finished, "TPDO-05") == [{"GIM-59": 2}]


def test_a_mapping_that_a_reading_has_fixed_is_named(judge: Callable[..., Any]) -> None:
    finished = judge(
        *("--reading", "GIM-66=2", "--select", "TPDO-05 or TPDO-06"), device="baumer_gim140r"
    )

    assert finished.code == 0
    assert followed(finished, "TPDO-05") == [{"GIM-66": 2}]
    assert {"GIM-66": 2} in followed(finished, "TPDO-06")
    assert finished.items("fail") == finished.items("inconclusive") == []


def test_a_device_that_follows_no_reading_fails(judge: Callable[..., Any], tmp_path: Path) -> None:
    model = spec_with(
        tmp_path,
        "baumer_gim140r",
        ("0x1800", "default: 0x64\n", "default: 0x64\n        effective: after-store-and-reset\n"),
        ("0x2198", "mappable: true", "mappable: false"),
    )

    finished = judge(
        *("--simulate-spec", model, "--fault", "tpdo-short"),
        *("--select", "TPDO-02 or TPDO-05 or TPDO-06"),
        device="baumer_gim140r",
    )

    assert finished.code == 1
    assert finished.items("fail") == [
        "TPDO-02/1800h/20ms",
        "TPDO-02/1800h/300ms",
        "TPDO-02/1800h/20ms/type-255",
        "TPDO-05/1800h",
        "TPDO-06/2198h",
    ]


def test_a_defect_is_none_of_the_readings(judge: Callable[..., Any]) -> None:
    finished = judge(
        *("--fault", "starts-operational", "--fault", "tpdo-timer-slow-10-percent"),
        *("--select", "BOOT-02 or TPDO-02"),
        device="danfoss_dst_x730",
    )

    assert finished.code == 1
    assert finished.requirements("fail") == {"BOOT-02", "TPDO-02"}
    assert finished.items("pass") == finished.items("inconclusive") == []


def test_parameters_that_act_only_after_a_store_are_stored(judge: Callable[..., Any]) -> None:
    finished = judge(
        *("--variant", "xy-45", "--reading", "DST-122=2", "--reading", "DST-52=2"),
        *("--select", "TPDO-02 or TPDO-03 or TPDO-05"),
        device="danfoss_dst_x730",
    )

    assert finished.code == 0
    assert finished.items("inconclusive") == []
    has_already, *others = sorted(followed(finished, "TPDO-02"), key=len)
    assert has_already == {}, "the period it had before needs no store"
    assert others == [{"DST-122": 2}] * 3
    assert followed(finished, "TPDO-03") == [{"DST-122": 2}] * 4
    assert followed(finished, "TPDO-05") == [{"DST-52": 2}]


def frames_of(folder: Path) -> list[tuple[float, str, str]]:
    found = FRAME.findall((folder / "trace.log").read_text(encoding="utf-8"))
    return [(float(time_s), can_id, data) for time_s, can_id, data in found]


def test_no_reset_comes_within_600_ms_of_a_store_or_restore(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "OD-10 and 1017h", device="baumer_gim140r")
    assert finished.code == 0

    settled_s, resets = 0.0, []
    for time_s, can_id, data in frames_of(finished.folder):
        if can_id == "581" and data[:8] in ("60101001", "60111001"):
            settled_s = time_s + 0.6
        if can_id == "000" and data[:2] in ("81", "82") and settled_s:
            resets.append(time_s - settled_s)
    assert resets
    assert min(resets) >= 0.0


def test_what_an_entry_depends_on_is_given_first(judge: Callable[..., Any], tmp_path: Path) -> None:
    model = spec_with(
        tmp_path,
        "danfoss_dst_x730",
        ("0x6011", "default: 2", "default: 0"),
        ("0x6021", "default: 2", "default: 1"),
    )

    finished = judge(
        *("--variant", "xy-45", "--simulate-spec", model, "--select", "OD-11 and 6000h"),
        device="danfoss_dst_x730",
    )

    assert finished.items("pass") == ["OD-11/6000h"]


def test_a_limit_is_tried_with_a_value_that_suits_every_setting(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    model = spec_with(
        tmp_path,
        "siko_ims360",
        ("0x3110", "default: 2\n        values: {0: No", "default: 1\n        values: {0: No"),
        ("0x3111", "default: 2000", "default: 20000"),
    )

    finished = judge(*("--simulate-spec", model, "--select", "OD-11 and 311"), device="siko_ims360")

    passed = finished.items("pass")
    assert {"OD-11/3110h:01", "OD-11/3111h"} <= set(passed)
    assert finished.code == 0


def test_forms_of_sdo_that_a_manual_leaves_open_are_named(judge: Callable[..., Any]) -> None:
    finished = judge(
        *("--variant", "xy-45", "--reading", "DST-43=2", "--reading", "DST-45=2"),
        *("--select", "SDO-14 or SDO-20"),
        device="danfoss_dst_x730",
    )

    assert finished.code == 0
    assert followed(finished, "SDO-20") == [{"DST-43": 2}] * 3
    assert followed(finished, "SDO-14") == [{"DST-45": 2}] * 2


@pytest.mark.parametrize(("reading", "named"), [("1", {}), ("2", {"GIM-146": 2})])
def test_a_download_in_segments_may_be_taken_or_refused(
    reading: str, named: dict[str, int], judge: Callable[..., Any]
) -> None:
    finished = judge(
        *("--reading", f"GIM-146={reading}", "--select", "SDO-09 or SDO-11 or SDO-12"),
        device="baumer_gim140r",
    )

    assert finished.code == 0
    assert followed(finished, "SDO-09") == [named] * 3
