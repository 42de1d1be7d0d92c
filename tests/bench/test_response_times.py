"""The time of an SDO transfer is its longest wait for a response."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from conformance.bench.node.response_times import ResponseTimes

UPLOAD = bytes.fromhex("4008100000000000")
SEGMENT = bytes.fromhex("6000000000000000")
ABORT = bytes.fromhex("8008100000000008")
UNKNOWN = bytes.fromhex("E000100000000000")


def test_without_a_transfer_there_is_nothing_to_tell() -> None:
    assert ResponseTimes().summary() == {"transfers": 0}


def test_a_transfer_takes_as_long_as_its_slowest_response() -> None:
    times = ResponseTimes()
    for request, sent_s, received_s in (
        (UPLOAD, 1.0, 1.002),
        (SEGMENT, 2.0, 2.010),
        (SEGMENT, 3.0, 3.001),
    ):
        times.sent(request, sent_s)
        times.received(received_s)

    assert times.summary() == {
        "transfers": 1,
        "median_ms": 10.0,
        "p99_ms": 10.0,
        "max_ms": 10.0,
        "max_object": "1008h:00",
        "histogram": [(11.22, 1)],
    }


def test_only_the_first_response_to_a_request_counts_and_silence_does_not() -> None:
    times = ResponseTimes()
    times.sent(UPLOAD, 1.0)
    times.received(1.001)
    times.received(1.9)
    times.sent(ABORT, 2.0)
    times.sent(UPLOAD, 3.0)

    assert times.summary() == {
        "transfers": 1,
        "median_ms": 1.0,
        "p99_ms": 1.0,
        "max_ms": 1.0,
        "max_object": "1008h:00",
        "histogram": [(1.122, 1)],
    }


def test_what_names_no_object_is_no_transfer() -> None:
    times = ResponseTimes()
    for request in (SEGMENT, UNKNOWN, b"\x40"):
        times.sent(request, 1.0)
        times.received(1.5)

    assert times.summary() == {"transfers": 0}


def test_ninety_nine_per_cent_leave_out_the_slowest_of_a_hundred() -> None:
    times = ResponseTimes()
    for count in range(1, 101):
        times.sent(UPLOAD, count)
        times.received(count + count / 1000)

    found = times.summary()
    assert (found["median_ms"], found["p99_ms"], found["max_ms"]) == (50.0, 99.0, 100.0)


def test_the_histogram_has_every_transfer_in_a_step_that_holds_its_time() -> None:
    times = ResponseTimes()
    for waited_ms in (1.9, 2.0, 2.1, 5.0):
        times.sent(UPLOAD, 1.0)
        times.received(1.0 + waited_ms / 1000)

    steps = times.summary()["histogram"]

    assert [count for _, count in steps] == [1, 2, 0, 0, 0, 0, 0, 0, 1]
    assert [step[0] for step in steps][:2] == [1.995, 2.239]
    assert steps[-1][0] > 5.0 >= steps[-2][0]


def test_a_run_reports_them(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "OD-02 and 1000h")

    times = finished.record["run"]["sdo_response_times"]
    assert times["transfers"] > 1
    assert 0 < times["median_ms"] <= times["p99_ms"] <= times["max_ms"]
    assert f"{times['transfers']} SDO transfers answered: median" in finished.out
