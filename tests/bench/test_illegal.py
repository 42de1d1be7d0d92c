"""What a node may never do keeps a run from conforming, whatever it judges; what never ends is ended."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import pytest

from conformance.bench.definition import load_bench
from conformance.bench.sensor.settling import Settling
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.session import Bench
from conformance.resources import data
from conformance.spec.load import load_spec
from conformance.wire.nmt import NmtCommand

HEARTBEAT = (0x1017, 0)
CHANNEL = str(data("device_specs") / "siko_ims360.yaml")


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """Return a bench with a node that was found."""
    definition = load_bench(data("fixtures/benches") / "simulator.yaml")
    spec = load_spec(Path(CHANNEL)).resolve()
    opened = Bench.open(definition, spec, {"channel": CHANNEL}, tmp_path / "trace.log")
    opened.find_node()
    opened.node()
    yield opened
    opened.close()


def restart(bench: Bench) -> None:
    """Let the node restart behind the back of the bench, and wait until it has."""
    assert bench.link.rig is not None
    bench.link.rig.power_off()
    bench.link.rig.power_on()
    bench.link.listen(1.0, lambda _: False)


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


@pytest.mark.parametrize(
    ("can_id", "data", "what"),
    [
        (0x732, "", "1 heartbeat that shows no NMT state"),
        (0x7E4, "44", "1 LSS response that no slave gives"),
        (0x7E4, "45 00 00 00 00 00 00 00", "1 LSS response that no slave gives"),
        (0x7E4, "44 00 00 00 00 00 00 00", ""),
    ],
)
def test_what_comes_outside_of_the_checks_counts(
    bench: Bench, can_id: int, data: str, what: str
) -> None:
    frame = can.Message(arbitration_id=can_id, is_extended_id=False, data=bytes.fromhex(data))
    with can.Bus(interface="canopen_simulator", channel=CHANNEL) as other:
        other.send(frame)
    bench.link.listen(0.1, lambda _: False)
    bench.node()

    assert str(bench.illegal) == (f"the node sent what no node may: {what}" if what else "")


def test_a_restart_that_nothing_led_to_is_counted(bench: Bench) -> None:
    node = bench.node()
    node.download(*HEARTBEAT, 100)
    restart(bench)
    bench.done(node, doubtful=False)
    bench.look()

    assert str(bench.illegal) == "the node restarted by itself"


def test_a_restart_before_the_bench_resets_the_node_is_counted(bench: Bench) -> None:
    node = bench.node()
    restart(bench)
    node.nmt(NmtCommand.RESET_NODE)
    bench.link.listen(1.0, lambda _: False)
    bench.done(node, doubtful=False)
    bench.look()

    assert bench.illegal.restarts == 1


@pytest.mark.parametrize("command", [NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION])
def test_a_restart_by_command_is_not_counted(bench: Bench, command: NmtCommand) -> None:
    for wait_s in (0.0, 1.0):
        node = bench.node()
        if not wait_s:
            node.nmt(command)
        bench.link.listen(wait_s, lambda _: False)
        bench.done(node, doubtful=False)
    bench.look()

    assert str(bench.illegal) == ""


def test_a_restart_by_the_supply_is_not_counted(bench: Bench) -> None:
    node = bench.node()
    node.power_cycle()
    bench.done(node, doubtful=False)
    node = bench.node()
    Stimulus(bench.link, Settling(node)).supply(24.0)
    restart(bench)
    bench.done(node, doubtful=False)
    bench.look()

    assert str(bench.illegal) == ""


def test_an_object_of_the_manufacturer_may_restart_the_node(bench: Bench) -> None:
    node = bench.node()
    node.download(0x2001, 0, node.number(0x2001))
    restart(bench)
    bench.done(node, doubtful=False)
    bench.look()

    assert bench.illegal.restarts == 0


def test_requests_of_the_set_up_left_unanswered_conform_to_nothing(
    judge: Callable[..., Any],
) -> None:
    finished = judge("--fault", "sdo-loses-answers", "--select", "BOOT-01")

    assert finished.code == 2
    assert finished.record["run"]["unanswered_sdo_requests"] > 0
    assert "request of the set-up unanswered" in finished.record["summary"]["illegal"]
