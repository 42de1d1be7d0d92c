"""Runs of a few items against a device whose answers hypothesis draws; for a process of its own."""

from __future__ import annotations

import shutil
import traceback
from itertools import count
from pathlib import Path

from ended_well import assert_ended_well
from hostile_runs import Hostile, catalogue_of, in_own_process, warm_up
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from planned import Deed, Planned, deeds

from conformance.spec.load import load_spec

ITEMS = 3


def explore(device: Path, folder: Path, examples: int, *, anew: bool) -> None:
    """Carry out runs, and write what went wrong with the shortest of those that end badly.

    Args:
        device: Path of the spec.
        folder: Where the records and what went wrong go.
        examples: How many runs.
        anew: Other ones each time.
    """
    numbers = count()
    items = list({item.split("/")[1]: item for item in catalogue_of(str(device))}.values())
    warm_up(Hostile("nothing", 0, str(device), items[0]), folder / "first")

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=not anew,
        suppress_health_check=list(HealthCheck),
    )
    @given(
        st.lists(deeds(load_spec(device).resolve().node_id), max_size=4),
        st.lists(st.sampled_from(items), min_size=1, max_size=ITEMS, unique=True),
    )
    def ends_well(plan: list[Deed], chosen: list[str]) -> None:
        run = Hostile("planned", 0, str(device), " or ".join(chosen))
        place = folder / str(next(numbers))
        ended = in_own_process(run, Planned(plan), place)
        assert_ended_well(run, ended)
        assert ended.meddled or ended.code == 0, run
        shutil.rmtree(place)

    try:
        ends_well()
    except Exception:  # noqa: BLE001 - whatever it is, the test is told
        (folder / "wrong.txt").write_text(traceback.format_exc(), encoding="utf-8")
