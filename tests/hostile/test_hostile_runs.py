"""A device that does anything at all is never said to conform, and breaks no run; `make hostile` tries 1,500."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from multiprocessing.context import BaseContext
from pathlib import Path
from typing import Any

import pytest
from ended_well import assert_ended_well
from hostile_runs import Ended, Hostile, catalogue_of, choose, from_json
from mischiefs import MISCHIEFS

from conformance import resources

RUNS = int(os.environ.get("HOSTILE_RUNS", "2"))
"""Of each kind of mischief."""

FOURTH = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"
DEVICES = [str(FOURTH), *resources.names("device_specs")]


@pytest.fixture
def carry_out(processes: BaseContext, tmp_path: Path) -> Iterator[Any]:
    """Carry out runs in a process of their own, each in a fork of it."""

    def run(runs: list[Hostile]) -> list[Ended]:
        from hostile_runs import carry_out  # noqa: PLC0415 - what the process is to find by its name

        process = processes.Process(target=carry_out, args=(runs, tmp_path))  # type: ignore[attr-defined]  # typeshed has it on the subclasses only
        process.start()
        process.join()
        assert process.exitcode == 0
        return from_json(tmp_path)

    yield run
    shutil.rmtree(tmp_path)


@pytest.mark.timeout(7200)
@pytest.mark.parametrize(
    "kinds", [list(MISCHIEFS)[0::2], list(MISCHIEFS)[1::2]], ids=["one", "two"]
)
def test_a_device_that_is_meddled_with_ends_every_run(kinds: list[str], carry_out: Any) -> None:
    devices = [DEVICES[seed % len(DEVICES)] for seed in range(RUNS)]
    catalogues = {device: catalogue_of(device) for device in devices}
    runs = [
        choose(kind, seed, device, catalogues[device])
        for kind in kinds
        for seed, device in enumerate(devices)
    ]

    ends = carry_out(runs)

    for run, ended in zip(runs, ends, strict=True):
        assert_ended_well(run, ended)
    assert sum(ended.meddled > 0 for ended in ends) > len(runs) / 2
