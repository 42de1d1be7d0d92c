"""NMT and heartbeat requirements that no built-in device can be seen failing by a fault alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

INVENTED = Path(__file__).parents[1] / "simulator" / "invented.yaml"


@pytest.fixture
def timed(tmp_path: Path) -> Path:
    """A device whose manual gives the longest time to the boot-up message."""
    text = INVENTED.read_text(encoding="utf-8")
    path = tmp_path / "timed.yaml"
    path.write_text(
        text.replace("automatic_start: false", "automatic_start: false, boot_up_ms: 500"), "utf-8"
    )
    return path


def test_a_boot_up_within_its_documented_time_passes(
    timed: Path, judge: Callable[..., Any]
) -> None:
    finished = judge("--select", "BOOT", device=timed)

    assert finished.code == 0
    assert "BOOT-05/power-on" in finished.items("pass")


def test_a_boot_up_after_its_documented_time_fails(timed: Path, judge: Callable[..., Any]) -> None:
    finished = judge("--select", "BOOT", "--fault", "boot-slow", device=timed)

    assert finished.code == 1
    assert finished.items("fail") == [
        "BOOT-05/reset-node",
        "BOOT-05/reset-node/broadcast",
        "BOOT-05/power-on",
    ]


def test_the_time_to_boot_up_is_told(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "BOOT-01/power-on")

    (item,) = finished.record["items"]
    assert item["actual"] == "1, the first after 200 ms"
