"""How late timestamps may be, and what follows for a verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest

from conformance.bench.bus.link import Link
from conformance.bench.bus.stamps import SLICE_S, Stamps, WallClock, stamper_of
from conformance.bench.bus.trace import Trace
from conformance.bench.definition import load_bench
from conformance.errors import BenchError
from conformance.resources import find
from conformance.verdict import Nonconformity, Unresolved, Verdict
from conformance.wire.frame import Frame, bit_length

BITRATE = 125_000
FRAME = Frame(0x705, b"\x05")
LENGTH_S = bit_length(FRAME) / BITRATE


def test_who_stamps_frames_is_known_of_interfaces() -> None:
    assert stamper_of("canopen_simulator") == "bus"
    assert stamper_of("socketcan") == "kernel"
    assert stamper_of("pcan") == "adapter"
    assert stamper_of("slcan") == stamper_of("anything else") == "host"


@pytest.mark.parametrize(("stamper", "late_ms"), [("bus", 0.0), ("kernel", 1.5)])
def test_stamps_of_others_are_late_by_what_the_bench_says(stamper: Any, late_ms: float) -> None:
    stamps = Stamps(stamper, late_ms)
    stamps.nothing(1.0)
    assert stamps.late_ms(9.0, LENGTH_S) == late_ms
    assert stamps.summary() == {"by": stamper, "late_ms": late_ms}


def test_a_frame_came_no_earlier_than_when_nothing_was_there() -> None:
    stamps = Stamps("host", 0.25)
    stamps.nothing(1.0)
    stamps.nothing(0.5)
    assert stamps.late_ms(1.003, LENGTH_S) == pytest.approx(3.25)


def test_frames_taken_over_in_a_row_came_one_after_the_other() -> None:
    stamps = Stamps("host", 0.0)
    stamps.nothing(1.0)
    late = [stamps.late_ms(1.0 + n * LENGTH_S + 0.0004, LENGTH_S) for n in range(50)]
    assert late == pytest.approx([0.4] * 50)
    assert stamps.late_ms(2.0, LENGTH_S) == pytest.approx((1 - 50 * LENGTH_S) * 1000)


class HostBus:
    """A bus without timestamps of its own, whose frames the suite takes over at given times.

    Args:
        arrivals: When each frame is there, in seconds, and by how much it is taken over later.
    """

    def __init__(self, arrivals: Iterable[tuple[float, float]]) -> None:
        self.now_s = 0.0
        self._arrivals = list(arrivals)

    def now(self) -> float:
        return self.now_s

    def recv(self, timeout: float) -> Any:
        assert timeout <= SLICE_S
        if self._arrivals and self._arrivals[0][0] <= self.now_s + timeout:
            there_s, delay_s = self._arrivals.pop(0)
            self.now_s = max(self.now_s, there_s + delay_s)
            return Message()
        self.now_s += timeout
        return None


class Message:
    is_error_frame = is_fd = is_remote_frame = is_extended_id = False
    is_rx = True
    timestamp = 1e9  # when the library got round to asking, on a clock that may be set
    arbitration_id = FRAME.can_id
    data = FRAME.data
    dlc = FRAME.dlc


def link_of(bus: HostBus) -> Link:
    link = Link(bus, Trace(), BITRATE, stamps=Stamps("host", 0.0))  # type: ignore[arg-type]  # it has the shape
    link.now = bus.now
    link.stamps = Stamps("host", 0.0)
    link.stamps.nothing(0.0)
    return link


def test_the_suite_looks_often_and_stamps_by_its_own_clock() -> None:
    link = link_of(HostBus([(0.1, 0.0), (0.2, 0.0)]))
    first, second = link.listen(0.3, lambda _: True)
    assert second.time_s - first.time_s == pytest.approx(0.1, abs=1e-6)
    assert 0 < link.uncertainty_ms() <= SLICE_S * 1000 + 0.001


def test_a_computer_that_was_busy_knows_less() -> None:
    link = link_of(HostBus([(0.1, 0.008), (0.2, 0.0)]))
    first, second = link.listen(0.3, lambda _: True)
    assert second.time_s - first.time_s == pytest.approx(0.092, abs=1e-6)
    assert 8 <= link.uncertainty_ms() <= 8 + SLICE_S * 1000 + 0.001
    link.forget()
    assert link.uncertainty_ms() == 0


class StampingBus(HostBus):
    """A bus whose frames have timestamps of an adapter, on a clock of its own."""

    AHEAD_S = 500.0
    FASTER = 5e-5

    def recv(self, timeout: float) -> Any:
        message = None
        if self._arrivals and self._arrivals[0][0] <= self.now_s + timeout:
            there_s, delay_s = self._arrivals.pop(0)
            self.now_s = max(self.now_s, there_s + delay_s)
            message = Message()
            message.timestamp = self.stamp_s(there_s)
            return message
        self.now_s += timeout
        return message

    @classmethod
    def stamp_s(cls, at_s: float) -> float:
        return cls.AHEAD_S + at_s * (1 + cls.FASTER)


class SlowlyStampingBus(StampingBus):
    FASTER = -5e-5


@pytest.mark.parametrize("kind", [StampingBus, SlowlyStampingBus])
def test_a_frame_taken_over_late_does_not_put_the_clock_back(kind: type[StampingBus]) -> None:
    bus = kind([*((n * 0.1, 0.0) for n in range(1, 600)), (60.0, 0.4)])
    link = link_of(bus)
    link.stamps = Stamps("adapter", 0.0)
    assert len(link.listen(60.2, lambda _: True)) == 600
    assert link.time_s == pytest.approx(kind.stamp_s(bus.now_s), abs=1e-4)


def clock(wall_step_s: float, mono_step_s: float) -> WallClock:
    mono = iter([0.0, 0.0, mono_step_s, mono_step_s])
    wall = iter([1e9, 1e9 + wall_step_s])
    return WallClock(lambda: next(mono), lambda: next(wall))


@pytest.mark.parametrize(("wall_s", "mono_s"), [(0.2, 0.2), (100.0, 99.95), (5.004, 5.0)])
def test_clocks_that_drift_a_little_are_alright(wall_s: float, mono_s: float) -> None:
    clock(wall_s, mono_s).look()


@pytest.mark.parametrize(
    ("wall_s", "mono_s", "by"), [(60.2, 0.2, "60.0 s"), (-3600.0, 1.0, "-3601.0 s")]
)
def test_a_computer_that_slept_is_no_fault_of_the_device(
    wall_s: float, mono_s: float, by: str
) -> None:
    with pytest.raises(BenchError, match=f"slept or its clock was set, by {by}"):
        clock(wall_s, mono_s).look()


def test_a_pause_between_the_clocks_is_no_step() -> None:
    mono, wall = iter([0, 0, 1, 3, 3.5, 3.5]), iter([1e9, 1e9 + 3, 1e9 + 3.5])
    WallClock(lambda: next(mono), lambda: next(wall)).look()


Judge = Callable[[Verdict], bool]


def word_of(uncertainty_ms: float, judge: Judge) -> str:
    verdict = Verdict(lambda: uncertainty_ms)
    judge(verdict)
    try:
        verdict.conclude()
    except Nonconformity:
        return "fail"
    except Unresolved:
        return "inconclusive"
    return "pass"


def within(actual: float, *, unit: str = "ms", over: int = 1) -> Judge:
    return lambda verdict: verdict.within("period", [actual], 100, 7, unit=unit, over=over)


@pytest.mark.parametrize(
    ("uncertainty_ms", "judge", "word"),
    [
        (0, within(107), "pass"),
        (0, within(107.1), "fail"),
        (3, within(103.9), "pass"),
        (3, within(104), "inconclusive"),
        (3, within(96), "inconclusive"),
        (3, within(110), "inconclusive"),
        (3, within(110.1), "fail"),
        (3, within(89.9), "fail"),
        (8, within(100), "inconclusive"),
        (3, within(106.5, over=10), "pass"),
        (3, within(107.2, over=10), "inconclusive"),
        (3, within(107.4, over=10), "fail"),
        (3, within(107.1, unit="°"), "fail"),
        (30, within(107.1, unit="s"), "fail"),
        (300, within(107.1, unit="s"), "inconclusive"),
        (3, lambda it: it.at_least("gap", 22.9, 20, unit="ms"), "inconclusive"),
        (3, lambda it: it.at_least("gap", 23.1, 20, unit="ms"), "pass"),
        (3, lambda it: it.at_least("gap", 16.9, 20, unit="ms"), "fail"),
        (3, lambda it: it.at_most("delay", 22.9, 20, unit="ms"), "inconclusive"),
        (3, lambda it: it.at_most("delay", 23.1, 20, unit="ms"), "fail"),
        (3, lambda it: it.at_most("delay", 16.9, 20, unit="ms"), "pass"),
        (3, lambda it: it.equal("frames", 5, 5), "pass"),
    ],
)
def test_times_are_judged_by_what_the_bench_can_tell(
    uncertainty_ms: float, judge: Judge, word: str
) -> None:
    assert word_of(uncertainty_ms, judge) == word


def test_a_time_is_told_with_its_uncertainty() -> None:
    verdict = Verdict(lambda: 3.25)
    within(104.5)(verdict)
    assert verdict.measurements[0].actual == "104.5 ms ± 3.2 ms"
    with pytest.raises(Unresolved, match="nearer to the limit than this bench can tell"):
        verdict.conclude()


def test_what_failed_beyond_doubt_fails_beside_what_is_open() -> None:
    verdict = Verdict(lambda: 3)
    within(104.5)(verdict)
    verdict.equal("frames", 4, 5)
    with pytest.raises(Nonconformity) as raised:
        verdict.conclude()
    assert [it.quantity for it in raised.value.measurements] == ["frames"]


def test_a_bench_file_may_say_how_far_its_stamps_may_be_off(tmp_path: Any) -> None:
    path = tmp_path / "bench.yaml"
    text = find("fixtures/benches", "socketcan", "--bench").read_text("utf-8")
    assert load_bench(find("fixtures/benches", "socketcan", "--bench")).stamps().jitter_ms == 1
    path.write_text(text + "timestamp_jitter_ms: 0.2\n", encoding="utf-8")
    assert load_bench(path).stamps() == Stamps("kernel", 0.2)


@pytest.mark.parametrize(("here_ms", "then_ms"), [(0, 8), (8, 0)])
def test_what_an_earlier_item_saw_is_judged_by_how_late_it_was_then(
    here_ms: float, then_ms: float
) -> None:
    verdict = Verdict(lambda: here_ms)
    verdict.shown_in(1, 2, then_ms)

    verdict.at_most("half of a step", 0.105, 0.1, unit="s")

    with pytest.raises(Unresolved) as caught:
        verdict.conclude()
    assert caught.value.late_ms == 8
