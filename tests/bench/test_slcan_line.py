"""A device behind an slcan line: the bit rate is the adapter's, as far as the library takes it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from killed_runs import BENCH
from simulated_process import simulating


def test_a_bit_rate_that_the_adapter_does_not_take_is_skipped(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    link, bench = tmp_path / "tty", tmp_path / "bench.yaml"
    bench.write_text(BENCH.format(link=link), encoding="utf-8")
    with simulating("siko_ims360", "--slcan-pty", str(link)) as process:
        done = judge("--bench", bench, "--select", "BIT-01/2001h/500000 or BIT-01/2001h/800000")
        (held,) = process.call("held")
    assert done.code == 0, done.out
    assert done.items("pass") == ["BIT-01/2001h/500000"]
    (skipped,) = [it for it in done.record["items"] if it["verdict"] == "skipped"]
    assert skipped["reason"].startswith("the adapter does not take 800 kbit/s: cannot open the bus")
    assert held["bitrate"] == 125_000
    assert held["memory"]["values"] == {}
