"""A node is given back as it was found, what it had not stored included; what is not is named."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.given_back.as_found import AsFound
from conformance.bench.given_back.journal import Found
from conformance.bench.services.heartbeat import HeartbeatPort
from conformance.bench.session import Bench
from conformance.report.junit import to_junit
from conformance.report.results import Item, Results
from conformance.spec.load import load_spec
from conformance.wire.frame import Frame
from conformance.wire.nmt import NmtCommand

HEARTBEAT = (0x1017, 0)
EVENT_TIMER = (0x1800, 5)


@pytest.fixture
def bench() -> Iterator[Bench]:
    """A bench with a node that has booted."""
    path = resources.find("device_specs", "siko_ims360", "DEVICE")
    definition = load_bench(resources.find("fixtures/benches", "simulator", "--bench"))
    bench = Bench.open(definition, load_spec(path).resolve(), {"channel": str(path)}, None)
    bench.link.listen(0.5, lambda _: False)
    yield bench
    bench.close()


def look(bench: Bench, *, restarts: bool) -> AsFound:
    return AsFound.look(bench, lambda _: None, restarts=restarts)


@pytest.mark.parametrize("restarts", [True, False])
def test_what_was_not_stored_is_written_again(bench: Bench, restarts: bool) -> None:
    bench.node().download(*EVENT_TIMER, 250)
    bench.find_node()
    found = look(bench, restarts=restarts)
    bench.node().reset()

    differences = found.give_back()

    assert differences == [] if restarts else [it.object for it in differences] == ["1800h:05"]
    assert len(found) > 50
    if restarts:
        assert bench.node().number(*EVENT_TIMER) == 250


def test_what_is_stored_and_was_not_is_named(bench: Bench) -> None:
    bench.find_node()
    found = look(bench, restarts=True)
    node = bench.node()
    node.download(*EVENT_TIMER, 250)
    node.save({EVENT_TIMER[0]})
    node.write(*EVENT_TIMER, bytes(2))

    (difference,) = found.give_back()

    assert difference.object == "1800h:05"
    assert (difference.before, difference.after) == ("00 00", "FA 00")


@pytest.mark.parametrize("period_ms", [0, 500, 60_000])
@pytest.mark.parametrize(
    ("command", "state"),
    [
        (NmtCommand.START, "Operational (05h)"),
        (NmtCommand.STOP, "Stopped (04h)"),
        (NmtCommand.ENTER_PRE_OPERATIONAL, "Pre-operational (7Fh)"),
    ],
)
def test_the_nmt_state_is_given_back(
    bench: Bench, command: NmtCommand, state: str, period_ms: int
) -> None:
    node = bench.node()
    node.download(*HEARTBEAT, period_ms)
    node.nmt(command)
    bench.find_node()

    found = look(bench, restarts=True)
    assert found.nmt_state == state
    assert found.give_back() == []

    if command is not NmtCommand.STOP:
        node = bench.node()
        port = HeartbeatPort(node, bench.spec.services.heartbeat_producer)
        assert node.number(*HEARTBEAT) == period_ms
        assert port.state() == state
    else:
        assert not bench.node().answers()


def test_a_run_that_only_reads_restarts_nothing(judge: Callable[..., Any]) -> None:
    finished = judge("--select", "OD-02/1000h")

    trace = (finished.folder / "trace.log").read_text("ascii")
    assert " 000#81" not in trace
    assert finished.record["run"]["as_found"] == {
        "objects": 69,
        "nmt_state": "Pre-operational (7Fh)",
        "differences": [],
    }
    assert "left as found: 69 settings, Pre-operational" in finished.out


@pytest.mark.parametrize(("verdict", "code"), [("pass", 2), ("fail", 1)])
def test_a_run_that_left_a_change_is_inconclusive_at_best(verdict: Any, code: int) -> None:
    item = Item("x/A-01", "A-01", "", "manual", "", "sdo", "", verdict)
    results = Results({}, {"spec": "x", "serial": ""}, [item], complete=True)
    assert results.exit_code == 2 - 2 * (verdict == "pass") - (verdict == "fail")

    results.left_changed = "the node is not left as it was found: 1800h:05"

    assert results.exit_code == code
    assert "not left as it was found: 1800h:05" in to_junit(results)


def test_what_was_found_is_safe_before_anything_is_written(bench: Bench) -> None:
    bench.node().download(*EVENT_TIMER, 250)
    bench.find_node()
    kept: list[tuple[Found, int]] = []

    def keep(found: Found) -> None:
        kept.append((found, len(bench.link.sent(_writes))))

    AsFound.look(bench, keep, restarts=True)

    first, second, last = (found for found, _ in kept)
    assert kept[0][1] == 0
    assert first.held[EVENT_TIMER] == b"\xfa\0"
    assert (first.stored, first.nmt_state) == (None, "")
    assert (second.stored, second.nmt_state) == (None, "Pre-operational (7Fh)")
    assert last.stored is not None
    assert last.stored[EVENT_TIMER] != b"\xfa\0"
    assert last.had_no_errors


def _writes(frame: Frame) -> bool:
    return frame.can_id == 0 or (frame.can_id == 0x632 and frame.data[0] >> 5 == 1)


@pytest.mark.parametrize("unsaved", [True, False])
def test_what_somebody_else_stored_is_put_back(bench: Bench, *, unsaved: bool) -> None:
    before = bench.node().upload(*EVENT_TIMER)
    if unsaved:
        bench.node().download(*EVENT_TIMER, 250)
    bench.find_node()
    found = look(bench, restarts=True)
    node = bench.node()
    node.download(*EVENT_TIMER, 750)
    node.save({EVENT_TIMER[0]})

    later = AsFound(bench, found.found, restarts=True)
    later.put_back()
    assert bench.node().upload(*EVENT_TIMER) == before
    assert later.give_back() == []
    assert bench.node().number(*EVENT_TIMER) == (
        250 if unsaved else int.from_bytes(before, "little")
    )


def test_what_a_run_without_restarts_left_is_written_back(bench: Bench) -> None:
    bench.node().download(*EVENT_TIMER, 250)
    bench.find_node()
    found = look(bench, restarts=False)
    bench.node().download(*EVENT_TIMER, 750)
    later = AsFound(bench, found.found, restarts=False)
    later.put_back()
    assert bench.node().number(*EVENT_TIMER) == 250
    assert later.give_back() == []
