"""EMCY requirements that no built-in device can be seen failing by a fault alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

INVENTED = Path(__file__).parents[1] / "simulator" / "invented.yaml"
SPECS = Path(__file__).parents[2] / "device_specs"
IMS360, DST = SPECS / "siko_ims360.yaml", SPECS / "danfoss_dst_x730.yaml"


@pytest.mark.parametrize(
    ("requirement", "fault"),
    [
        ("EMCY-17", "history-takes-any"),
        ("EMCY-21", "cob-id-changes-while-valid"),
        ("EMCY-25", "emcy-inhibit-time-ignored"),
    ],
)
def test_requirement_fails_on_its_defect(
    requirement: str, fault: str, judge: Callable[..., Any]
) -> None:
    finished = judge("--fault", fault, "--select", "EMCY", device=INVENTED)

    assert finished.code == 1
    assert finished.requirements("fail") == {requirement}
    assert finished.items("inconclusive") == []


@pytest.mark.parametrize(
    ("requirement", "fault"),
    [
        ("EMCY-04", "emcy-short"),
        ("EMCY-05", "emcy-wrong-register"),
        ("EMCY-12", "history-stays-empty"),
        ("EMCY-15", "history-of-four"),
        ("EMCY-19", "emcy-bit-31-ignored"),
        ("EMCY-20", "emcy-keeps-cob-id"),
        ("EMCY-23", "emcy-in-stopped"),
        ("EMCY-24", "error-stops"),
        ("EMCY-25", "emcy-inhibit-time-ignored"),
        ("EMCY-27", "emcy-wrong-code"),
        ("EMCY-28", "error-passive-untold"),
    ],
)
def test_an_error_on_the_bus_shows_it_where_no_angle_is_an_error(
    requirement: str, fault: str, judge: Callable[..., Any]
) -> None:
    finished = judge("--fault", fault, "--select", requirement, device="baumer_gim140r")

    assert finished.requirements("fail") == {requirement}


def test_an_inhibited_emcy_may_not_be_lost_unless_documented(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    losing = changed(INVENTED, tmp_path, "inhibit: 0x1015", "inhibit: 0x1015\n    inhibited: lost")

    finished = judge("--simulate-spec", losing, "--select", "EMCY", device=INVENTED)

    assert finished.requirements("fail") == {"EMCY-25"}


def test_an_inhibited_emcy_is_lost_where_documented(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    losing = changed(INVENTED, tmp_path, "inhibit: 0x1015", "inhibit: 0x1015\n    inhibited: lost")

    finished = judge("--select", "EMCY", device=losing)

    assert finished.code == 0
    assert "EMCY-25/1015h" in finished.items("pass")


@pytest.mark.parametrize(
    ("limit", "item"), [(-8, "EMCY-26/1000h/tilt-x/below"), (-15, "EMCY-03/1000h/tilt-x/below")]
)
def test_a_device_with_other_limits_tells_an_error_too_early_or_not(
    judge: Callable[..., Any], tmp_path: Path, limit: int, item: str
) -> None:
    other = changed(DST, tmp_path, "limits: {xy-10: [-11, 11],", f"limits: {{xy-10: [{limit}, 11],")

    finished = judge(
        *("--variant", "xy-10", "--simulate-spec", other, "--select", "EMCY"), device=DST
    )

    assert finished.items("fail") == [item]


@pytest.mark.parametrize("limit", [-80, -95])
def test_limits_that_are_not_documented_for_sure_are_not_judged(
    judge: Callable[..., Any], tmp_path: Path, limit: int
) -> None:
    text = "limits: {two-axis: [-90, 90]}"
    other = changed(IMS360, tmp_path, text, f"limits: {{two-axis: [{limit}, 90]}}")

    finished = judge("--variant", "two-axis", "--simulate-spec", other, "--select", "EMCY")

    assert finished.code == 0


def changed(spec: Path, folder: Path, old: str, new: str) -> Path:
    """Return a copy of a spec with the first occurrence of a text replaced."""
    text = spec.read_text(encoding="utf-8")
    assert old in text
    copy = folder / "changed.yaml"
    copy.write_text(text.replace(old, new, 1), encoding="utf-8")
    return copy


@pytest.mark.parametrize("device", ["siko_ims360", "baumer_gim140r"])
def test_a_can_id_that_is_not_answered_is_not_refused(
    device: str, judge: Callable[..., Any]
) -> None:
    finished = judge("--fault", "sdo-refuses-silently", "--select", "EMCY-22/", device=device)

    assert finished.items("inconclusive") != []
    assert finished.items("pass") == []
