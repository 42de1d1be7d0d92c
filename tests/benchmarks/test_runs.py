"""How long a full run of each device takes, and what takes it."""

from __future__ import annotations

import pstats
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

RUNS = (
    ("siko_ims360", "two-axis"),
    ("baumer_gim140r", "two-dimensional"),
    ("danfoss_dst_x730", "xy-30"),
)
PARTS = {
    "pytest": ("/_pytest/", "/pluggy/", "/pytest_timeout"),
    **{part: (f"/conformance/{part}/",) for part in ("checks", "bench", "wire", "simulator")},
    "spec and its reading": ("/conformance/spec/", "/ruamel/", "/pydantic"),
    "the rest of the suite": ("/conformance/",),
    "python-can": ("/can/",),
}
PROGRAM = """
import cProfile, sys
from conformance.cli import main
profile = cProfile.Profile()
try:
    profile.runcall(main)
except SystemExit as left:
    code = left.code
profile.dump_stats(sys.argv.pop(1))
"""


@pytest.mark.parametrize(("device", "variant"), RUNS)
def test_full_run(
    benchmark: BenchmarkFixture,
    judge: Callable[..., Any],
    tell: Callable[[str], None],
    device: str,
    variant: str,
) -> None:
    finished = benchmark.pedantic(  # type: ignore[no-untyped-call]
        judge, ("--variant", variant), {"device": device}, rounds=3
    )

    assert finished.code == 0
    for line in finished.out.splitlines():
        if "of bus time" in line:
            tell(f"{device} {variant}: {line}")


@pytest.mark.parametrize(("device", "variant"), RUNS[:1])
def test_shares_of_a_run(
    tmp_path: Path, tell: Callable[[str], None], device: str, variant: str
) -> None:
    stats = tmp_path / "stats"
    run = ["run", device, "--variant", variant, "--report-dir", str(tmp_path / "record")]
    program = PROGRAM.replace("sys.argv.pop(1)", repr(str(stats)))

    done = subprocess.run(
        [sys.executable, "-c", program, *run], capture_output=True, check=True, timeout=280
    )

    assert b"CONFORMS" in done.stdout
    shares = _shares(pstats.Stats(str(stats)))
    whole = shares.total()
    words = ", ".join(f"{part} {seconds / whole:.0%}" for part, seconds in shares.most_common())
    tell(f"{device} {variant}, shares of the time while profiled: {words}")


def _shares(stats: pstats.Stats) -> Counter[str]:
    """Return the seconds spent in each part; built-in functions count for who calls them."""
    shares: Counter[str] = Counter()
    functions: dict[Any, Any] = stats.stats  # type: ignore[attr-defined]  # typeshed leaves it out
    for (path, _, _), (_, _, own_s, _, callers) in functions.items():
        if path == "~" and callers:
            for (caller, _, _), (_, _, by_caller_s, _) in callers.items():
                shares[_part(caller)] += by_caller_s
        else:
            shares[_part(path)] += own_s
    return shares


def _part(path: str) -> str:
    return next((part for part, marks in PARTS.items() if any(m in path for m in marks)), "others")
