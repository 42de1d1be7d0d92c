"""64 nodes in one process, and as many of python-canopen: frames, missed deadlines, jitter."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

SCRIPT = Path(__file__).with_name("many_nodes.py")
SECONDS, SHORT_S = 20, 1


def measured(kind: str, seconds: float) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, SCRIPT, kind, str(seconds)], capture_output=True, text=True, check=True
    )
    figures: dict[str, Any] = json.loads(done.stdout)
    return figures


@pytest.mark.benchmark(group="64 nodes, a TPDO every 20 ms and a heartbeat every 100 ms each")
def test_many_nodes_in_one_process(
    benchmark: BenchmarkFixture, tell: Callable[[str], None]
) -> None:
    seconds = SHORT_S if benchmark.disabled else SECONDS
    ours, theirs = (measured(kind, seconds) for kind in ("simulated", "canopen"))
    assert ours["frames_per_s"] > 0
    assert theirs["frames_per_s"] > 0
    for name, figure in ours.items():
        ratio = f"{figure / theirs[name]:.2f}" if theirs[name] else "-"
        tell(f"64 nodes: {name:>12} {figure:>9}, python-canopen {theirs[name]:>9}, ratio {ratio}")
    benchmark.pedantic(lambda: None, rounds=1)  # type: ignore[no-untyped-call]
