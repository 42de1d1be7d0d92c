"""Whatever a device answers, a run ends with a verdict that holds; `make hostile` draws a thousand devices."""

from __future__ import annotations

import os
from multiprocessing.context import BaseContext
from pathlib import Path

import pytest

EXAMPLES = int(os.environ.get("HOSTILE_EXAMPLES", "0"))
FEW = 30
FOURTH = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"


@pytest.mark.timeout(7200)
def test_any_answers_end_well(processes: BaseContext, tmp_path: Path) -> None:
    from any_answers import explore  # noqa: PLC0415 - what the process is to find by its name

    process = processes.Process(  # type: ignore[attr-defined]  # typeshed has it on the subclasses only
        target=explore, args=(FOURTH, tmp_path, EXAMPLES or FEW), kwargs={"anew": EXAMPLES > 0}
    )
    process.start()
    process.join()
    wrong = tmp_path / "wrong.txt"

    assert process.exitcode == 0
    assert not wrong.exists(), wrong.read_text("utf-8")
