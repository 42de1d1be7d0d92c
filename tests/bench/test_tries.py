"""Adapters whose frames are handed over late now and then: items are tried again, and none passes for it."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import can
import pytest

from conformance import resources
from conformance.bench.bus.link import Stamped
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.heartbeat import HeartbeatPort
from conformance.options import RunOptions
from conformance.report.results import Item
from conformance.run import Run
from conformance.runner import play, run
from conformance.simulator.interface import SimulatorBus

DEVICE = "siko_ims360"
ITEM = "HB-01/1017h/100ms"
"""Each interval is 100 ms ± 7 ms, and their mean, over 20 of them, 100 ms ± 5 ms."""
BEAT = 0x732
ANSWER = 0x5B2
FUSION = "DEV-34 and 6110"
"""Half of a step within 0.1 s."""
BEATS = 15
"""Fewer than the item takes of them."""
TELLS, TELLS_NOT = "virtual", "slcan"
"""Interfaces without timestamps of their own, which tell of errors on the bus and which do not."""

Lateness: TypeAlias = Callable[[int], float]
"""By how much a heartbeat is late, in ms, by how many came before."""


class LateAdapter(SimulatorBus):
    """Hands heartbeats over late, and what came meanwhile after them."""

    real_time = True
    lateness: Lateness

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._beats = 0
        self._behind: deque[can.Message] = deque()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if self._behind:
            return self._behind.popleft()
        message = super().recv(timeout)
        if message is None or message.arbitration_id != BEAT:
            return message
        until_s = self.now() + self.lateness(self._beats) / 1000
        self._beats += 1
        while (left_s := until_s - self.now()) > 1e-6:
            following = super().recv(left_s)
            if following is not None:
                self._behind.append(following)
        return message


Judge: TypeAlias = Callable[..., dict[str, Any]]


@pytest.fixture
def judge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Judge:
    """Judge one item on an adapter that is late, and return it."""

    def do(
        lateness: Lateness,
        interface: str = TELLS,
        factor: float = 1.0,
        jitter_ms: float = 0.0,
        adapter: type[LateAdapter] = LateAdapter,
        progress: Callable[[Item], None] | None = None,
        select: str = ITEM,
        defect: str = "",
    ) -> dict[str, Any]:
        fault = tmp_path / "fault.yaml"
        inject = f"inject: {{heartbeat_period_factor: {factor}}}"
        fault.write_text(f"format: 1\nwhat: Slow.\nseen_by: [HB-01]\n{inject}\n", encoding="ascii")

        def opened(*, ignore_config: bool, interface: str, **arguments: Any) -> LateAdapter:
            assert ignore_config
            assert interface
            faults = str(fault) if factor != 1 else defect
            bus = adapter(**{**arguments, "channel": DEVICE, "faults": faults})
            bus.lateness = lateness
            return bus

        monkeypatch.setattr(can, "Bus", opened)
        text = resources.find("fixtures/benches", "simulator", "--bench").read_text("utf-8")
        bench = tmp_path / "bench.yaml"
        own = f"channel: {DEVICE}\ntimestamp_jitter_ms: {jitter_ms}\n"
        bench.write_text(text.replace("canopen_simulator", interface) + own, encoding="utf-8")
        options = RunOptions(DEVICE, bench=str(bench), report_dir=tmp_path / "r", select=select)
        made = Run(options, progress)
        play(made) if progress else run(made)
        record = json.loads((tmp_path / "r" / "results.json").read_text("utf-8"))
        assert record["summary"]["complete"]
        (item,) = record["items"]
        return dict(item)

    return do


def once(beat: int) -> float:
    return 18 if beat == BEATS else 0


def always(beat: int) -> float:
    return 18 if beat % BEATS == BEATS - 1 else 0


def never(_: int) -> float:
    return 0


@pytest.mark.parametrize("interface", [TELLS, TELLS_NOT])
def test_what_was_late_once_is_decided_at_the_next_try(judge: Judge, interface: str) -> None:
    item = judge(once, interface)

    assert item["verdict"] == "pass"
    assert item["reason"] == ""
    assert item["tried"].startswith("timestamps were late by up to 19 ms at try 1 (trace.log:")


def test_what_is_late_always_stays_open_after_three_tries(judge: Judge) -> None:
    item = judge(always)

    assert item["verdict"] == "inconclusive"
    assert item["reason"].endswith("than this bench can tell, at each of 3 tries")
    assert item["tried"].count("19 ms at try ") == 3


def test_timestamps_of_others_may_be_late_as_well(judge: Judge) -> None:
    item = judge(never, "socketcan", jitter_ms=8.0)

    assert item["reason"].endswith("at each of 3 tries")
    assert item["tried"].startswith("timestamps were late by up to 8 ms at try 1")


def test_what_would_wear_the_memory_out_is_not_tried_again(
    judge: Judge, monkeypatch: pytest.MonkeyPatch
) -> None:
    worn = iter(["", "so many writes were made"])
    monkeypatch.setattr(Run, "wears_out", lambda *_: next(worn))

    item = judge(once)

    assert item["verdict"] == "inconclusive"
    assert item["reason"].endswith("nearer to the limit than this bench can tell")
    assert item["tried"].count(" at try ") == 1


def test_what_is_in_time_is_tried_once(judge: Judge) -> None:
    item = judge(never)

    assert (item["verdict"], item["tried"]) == ("pass", "")


def test_on_the_virtual_clock_nothing_is_late(judge: Judge) -> None:
    class Virtual(LateAdapter):
        real_time = False

    item = judge(once, adapter=Virtual)

    assert (item["verdict"], item["tried"]) == ("inconclusive", "")


SLOW = (1.075, 1.1, 1.2)
LATE: list[Lateness] = [
    once,
    always,
    lambda beat: 200 if beat == BEATS else 0,
    lambda beat: 150 if beat % 40 < BEATS else 0,
    lambda beat: 7.0 * (beat % 3),
]


@pytest.mark.parametrize("interface", [TELLS, TELLS_NOT])
@pytest.mark.parametrize("factor", SLOW)
@pytest.mark.parametrize("lateness", LATE)
def test_no_deviation_passes_for_late_timestamps(
    judge: Judge, interface: str, factor: float, lateness: Lateness
) -> None:
    assert judge(lateness, interface, factor)["verdict"] in ("fail", "inconclusive")


def much_once(beat: int) -> float:
    return 60 if beat == BEATS else 0


def test_a_deviation_that_is_seen_at_the_second_try_fails(judge: Judge) -> None:
    item = judge(much_once, TELLS, 1.06)

    assert item["verdict"] == "fail"
    assert item["tried"].startswith("timestamps were late by up to 61 ms at try 1 (trace.log:")


def test_such_a_deviation_is_tried_again_where_the_cable_may_be_bad(judge: Judge) -> None:
    told: list[Item] = []
    item = judge(much_once, TELLS_NOT, 1.06, progress=told.append)

    assert item["verdict"] == "fail"
    assert item["tried"].startswith("failed the time before as well (trace.log:")
    assert [it.verdict for it in told] == ["fail"], "of tries nobody is told"


def test_a_deviation_that_late_timestamps_hide_at_the_second_try_is_open(judge: Judge) -> None:
    """It failed, and then three times nobody could tell."""
    item = judge(lambda beat: 60 if beat > 2 * BEATS and beat % 5 == 0 else 0, TELLS_NOT, 1.06)

    assert item["verdict"] == "inconclusive"
    assert "failed and did not when it was tried again" in item["reason"]
    assert item["reason"].endswith("at each of 3 tries")


def test_reports_tell_of_the_tries(
    judge: Judge, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tried = judge(once)["tried"]

    folder, out = tmp_path / "r", capsys.readouterr().out
    assert f"1 item passed at a further try:\nsiko_ims360/{ITEM}: {tried}\n" in out
    assert f"tried again: {tried}<" in (folder / "report.html").read_text("utf-8")
    assert f"<system-out>{tried}</system-out>" in (folder / "junit.xml").read_text("utf-8")


def test_reports_tell_of_the_tries_of_a_deviation(
    judge: Judge, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tried = judge(much_once, TELLS, 1.06)["tried"]

    assert f"tried     {tried}\n" in capsys.readouterr().out
    assert f"<dt>tried<dd>{tried}\n" in (tmp_path / "r" / "report.html").read_text("utf-8")


class Busy(LateAdapter):
    """Lets nobody look for a while after a turn."""

    turned = False
    for_s = 0.2
    after_s = 0.0
    """When it begins, from the first answer after the turn."""
    _answered_s: float | None = None

    def recv(self, timeout: float | None = None) -> can.Message | None:
        message = super().recv(timeout)
        if message is None or message.arbitration_id != ANSWER or not Busy.turned:
            return message
        self._answered_s = self.now() if self._answered_s is None else self._answered_s
        if self.now() - self._answered_s >= self.after_s:
            Busy.turned, self._answered_s = False, None
            until_s = self.now() + self.for_s
            while (left_s := until_s - self.now()) > 1e-6:
                following = super().recv(left_s)
                if following is not None:
                    self._behind.append(following)
        return message


@pytest.fixture
def turns(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """At which turns the computer is busy; after the last one it is not."""
    busy: list[bool] = []
    turn = Stimulus.turn

    def turned(stimulus: Stimulus, *angles: float) -> float:
        began_s = turn(stimulus, *angles)
        Busy.turned = busy.pop(0) if busy else False
        return began_s

    monkeypatch.setattr(Stimulus, "turn", turned)
    return busy


@pytest.mark.parametrize("interface", [TELLS, "socketcan"])
def test_a_computer_too_late_to_look_looks_again(
    judge: Judge, turns: list[bool], interface: str
) -> None:
    turns.extend([True])

    item = judge(never, interface, adapter=Busy, select=FUSION)

    assert (item["verdict"], item["reason"]) == ("pass", "")
    assert item["tried"].startswith("timestamps were late by up to ")
    assert item["tried"].count(" at try ") == 1


def test_a_computer_always_too_late_to_look_leaves_it_open(judge: Judge, turns: list[bool]) -> None:
    turns.extend([True] * 20)

    item = judge(never, adapter=Busy, select=FUSION)

    assert item["verdict"] == "inconclusive"
    assert item["reason"].startswith("the computer is too busy: nobody could look for 0.2")
    assert item["reason"].endswith("at each of 3 tries")


@pytest.mark.parametrize("late", [[True], [True] * 20, [False, True]])
def test_no_slow_fusion_passes_for_a_computer_that_is_late(
    judge: Judge, turns: list[bool], late: list[bool]
) -> None:
    turns.extend(late)

    item = judge(never, adapter=Busy, select=FUSION, defect="fusion-lags")

    assert item["verdict"] == "fail"


class AwayAtThePeak(Busy):
    """Lets nobody look while a value passes the peak of an overshoot."""

    for_s = 0.8
    after_s = 0.5


OVERSHOOT = "DEV-28/6110h/1"
"""A filter that overshoots, the second one tried, with 2 Hz: it is beyond its end from 0.55 s to 1.2 s."""
NONE = "DEV-27/6110h/2"
"""One that does not, tried as the third and the fourth."""


def test_an_overshoot_that_nobody_could_see_is_looked_for_again(
    judge: Judge, turns: list[bool]
) -> None:
    turns.extend([False, True])

    item = judge(never, adapter=AwayAtThePeak, select=OVERSHOOT)

    assert (item["verdict"], item["reason"]) == ("pass", "")
    assert item["tried"].count(" at try ") == 1


@pytest.mark.parametrize("late", [[True] * 20, [False, False, True, True]])
def test_no_overshoot_passes_for_a_computer_that_is_late(
    judge: Judge, turns: list[bool], late: list[bool]
) -> None:
    turns.extend(late)

    item = judge(never, adapter=AwayAtThePeak, select=NONE, defect="filter-overshoots")

    assert item["verdict"] in ("fail", "inconclusive")


class Dozing(LateAdapter):
    """Takes what comes for a while and hands it over later."""

    def doze(self, duration_s: float) -> None:
        until_s = self.now() + duration_s
        while (left_s := until_s - self.now()) > 1e-6:
            following = SimulatorBus.recv(self, left_s)
            if following is not None:
                self._behind.append(following)


def test_a_computer_that_dozes_after_the_last_heartbeat_makes_no_pause(
    judge: Judge, monkeypatch: pytest.MonkeyPatch
) -> None:
    collect = HeartbeatPort.collect

    def dozing(port: HeartbeatPort, count: int, timeout_s: float) -> list[Stamped]:
        seen = collect(port, count, timeout_s)
        bus = port._node.link._bus
        assert isinstance(bus, Dozing)
        bus.doze(1.0)
        return seen

    monkeypatch.setattr(HeartbeatPort, "collect", dozing)

    item = judge(never, "socketcan", adapter=Dozing, select="HB-12")

    assert item["verdict"] == "pass"
