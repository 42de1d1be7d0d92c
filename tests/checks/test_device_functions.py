"""Rules that a built-in manual leaves open in part, seen failing on a spec that leaves nothing open."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

SPEC = Path(__file__).parents[2] / "device_specs" / "danfoss_dst_x730.yaml"


def settled(ambiguity: str) -> str:
    """Return the spec's text with one ambiguity judged by its first reading."""
    text = SPEC.read_text(encoding="utf-8")
    start = text.index(f"  - id: {ambiguity}\n")
    place = text.index("judged_by: either", start)
    return text[:place] + "judged_by: 1" + text[place + len("judged_by: either") :]


def test_a_value_accepted_without_its_condition_fails(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    spec = tmp_path / "settled.yaml"
    spec.write_text(settled("DST-122"), encoding="utf-8")

    finished = judge(
        "--fault",
        "accepts-in-any-state",
        "--variant",
        "xy-30",
        "--select",
        "DEV-20",
        device=spec,
    )

    assert finished.code == 1
    assert finished.items("fail") == ["DEV-20/6000h/6011h", "DEV-20/6000h/6021h"]
