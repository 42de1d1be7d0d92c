"""What a node may never send keeps a run from conforming, whatever it judges; what never ends is ended."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def test_answers_that_nobody_asked_for_conform_to_nothing(judge: Callable[..., Any]) -> None:
    finished = judge("--fault", "sdo-answers-twice", "--select", "BOOT-01")

    assert finished.code == 2
    assert finished.items("fail") == finished.items("inconclusive") == []
    assert finished.record["run"]["unsolicited_sdo_responses"] > 0
    assert "SDO responses that nobody asked for" in finished.record["summary"]["illegal"]
    assert "the node sent what no node may" in finished.out
    assert 'name="illegal frames"' in (finished.folder / "junit.xml").read_text("utf-8")


def test_answers_for_another_object_conform_to_nothing(judge: Callable[..., Any]) -> None:
    finished = judge("--fault", "sdo-wrong-sub-index", "--select", "BOOT-01")

    assert finished.code == 2
    assert finished.record["run"]["improper_sdo_responses"] > 0


def test_a_conforming_device_sends_nothing_illegal(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "LSS-23 or SDO-26 or BOOT")

    assert finished.code == 0
    assert finished.record["summary"]["illegal"] == ""


def test_uploads_that_never_end_take_no_long_time(judge: Callable[..., Any]) -> None:
    finished = judge("--fault", "sdo-never-ends", "--select", "1008h or 1009h or 100Ah")

    assert finished.code == 1
    assert "OD-02/1008h" in finished.items("fail")
    assert finished.record["run"]["frames"] < 50_000
