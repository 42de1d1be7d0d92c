"""`run --dry-run` lists what would be run, and touches nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest

BENCH = """format: 1
what: An adapter that is not there.
interface: virtual
allow: [reads, writes, non-volatile]
non_volatile_writes: 7
"""


@pytest.fixture
def listed(
    command: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Any]:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("a bus was opened")

    def run(*arguments: str) -> Any:
        path = tmp_path / "bench.yaml"
        path.write_text(BENCH)
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(can, "Bus", refuse)
        return command("run", "danfoss_dst_x730", "--dry-run", "--bench", path, *arguments)

    return run


def test_what_would_be_run_is_listed_by_what_it_may_do(
    listed: Callable[..., Any], tmp_path: Path
) -> None:
    done = listed("--select", "OD-15 or STO-01 or BOOT-01 or DEV-01 or TPDO-01")

    assert done.code == 0
    assert any(line.split()[1:] == ["reads", "OD-15"] for line in done.out.splitlines()), done.out
    assert "the bench does not allow resets" in done.out
    assert "the bench has no tilt stimulus (DEV-01)" in done.out
    assert "nothing was sent" in done.out
    assert not (tmp_path / "reports").exists(), "no record is begun"


def test_items_that_wear_the_memory_are_counted(listed: Callable[..., Any]) -> None:
    done = listed("--select", "OD-02")
    line = next(it for it in done.out.splitlines() if "non-volatile memory" in it)
    assert line.endswith("; none of them begins after 7 writes")
    assert "may write the node's non-volatile memory: 0" not in line


def test_what_does_not_apply_is_left_out(listed: Callable[..., Any]) -> None:
    done = listed("--select", "LED-03")
    assert done.code == 3
    assert "expected a selection that some item matches" in done.err


def test_a_selection_of_nothing_is_wrong_usage(listed: Callable[..., Any]) -> None:
    done = listed("--select", "NOTHING-99")
    assert done.code == 3
