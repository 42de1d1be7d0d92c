"""Mapping and COB-IDs of a device that follows another reading, or has fewer places for objects."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SPEC = Path(__file__).parents[2] / "device_specs" / "siko_ims360.yaml"
ALL = "TPDO-3 or TPDO-4 or TPDO-5 or TPDO-6"


@pytest.mark.parametrize(
    ("device", "ambiguity", "requirement", "items"),
    [
        ("siko_ims360", "IMS-35", "TPDO-61", 4),
        ("siko_ims360", "IMS-41", "TPDO-50", 4),
        ("siko_ims360", "IMS-41", "TPDO-51", 4),
        ("siko_ims360", "IMS-87", "TPDO-62", 24),
        ("siko_ims360", "IMS-87", "TPDO-65", 6),
        ("baumer_gim140r", "GIM-66", "TPDO-33", 1),
        ("baumer_gim140r", "GIM-66", "TPDO-52", 1),
    ],
)
def test_another_reading_is_named(
    judge: Callable[..., Any], device: str, ambiguity: str, requirement: str, items: int
) -> None:
    finished = judge("--reading", f"{ambiguity}=2", "--select", requirement, device=device)

    assert finished.code == 0
    readings = [item["readings"] for item in finished.record["items"]]
    assert readings == [{ambiguity: 2}] * items


def test_a_mapping_with_four_places_will_do(judge: Callable[..., Any], tmp_path: Path) -> None:
    text = SPEC.read_text(encoding="utf-8")
    four = re.sub(r"      [5-8]: \{name: Mapped object [^}]*optional: true[^}]*\}\n", "", text)
    start = four.index("  - id: IMS-40")
    four = four[:start] + four[four.index("  - id: IMS-41") :]
    copy = tmp_path / "four.yaml"
    copy.write_text(four, encoding="utf-8")

    finished = judge("--simulate-spec", copy, "--select", ALL)

    assert finished.items("fail") == finished.items("inconclusive") == []
    assert "TPDO-35/1A00h" in finished.items("pass")
