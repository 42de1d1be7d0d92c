"""Boot-up: one message after each start, then Pre-operational (CiA 301 v4.2.0, 7.3.2.2, 7.2.8.3.3)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import HeartbeatPort
from conformance.checks.cases import with_heartbeat
from conformance.checks.states.starts import (
    RESETS,
    Start,
    begin_start,
    count_boot_ups,
    judge_start_state,
)
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict


def _starts(spec: DeviceSpec) -> Iterable[Case]:
    section = spec.services.nmt.source
    for label, command in RESETS.items():
        yield Case(label, Start(command), section, ("resets",))
        yield Case(
            f"{label}/broadcast",
            Start(command, broadcast=True),
            section,
            ("resets", "other-nodes"),
        )
    yield Case("power-on", Start(None), section, ("power",))


@requirement(
    "BOOT-01", level="shall", cases=("way", _starts), source=f"{CIA301}, 7.2.8.3.3", effects=()
)
def test_one_boot_up_message_per_start(node: Node, way: Start, verdict: Verdict) -> None:
    """After each start the node sends exactly one boot-up message, one octet 00h."""
    mark = begin_start(node, way)
    started_s = node.link.time_s

    boot_ups = count_boot_ups(node, mark)

    seen = node.link.since(mark, node.is_boot_up)
    after = f", the first after {(seen[0].time_s - started_s) * 1000:.0f} ms" if seen else ""
    verdict.holds("boot-up messages", expected="1", actual=f"{boot_ups}{after}", ok=boot_ups == 1)


@requirement(
    "BOOT-02",
    level="shall",
    cases=("way", with_heartbeat(_starts)),
    source=f"{CIA301}, 7.3.2.2",
    effects=("reads", "writes"),
)
def test_state_after_start(
    node: Node, heartbeat: HeartbeatPort, way: Start, spec: DeviceSpec, verdict: Verdict
) -> None:
    """After a start the node is Pre-operational, or Operational where it starts by itself."""
    node.await_boot_up(begin_start(node, way))

    seen = heartbeat.state()

    judge_start_state(spec, verdict, seen)


def _timed_starts(spec: DeviceSpec) -> Iterable[Case]:
    return _starts(spec) if spec.services.nmt.boot_up_ms is not None else ()


@requirement("BOOT-05", level="manual", cases=("way", _timed_starts), effects=())
def test_boot_up_comes_in_time(node: Node, way: Start, spec: DeviceSpec, verdict: Verdict) -> None:
    """The boot-up message comes within the documented time."""
    mark = begin_start(node, way)
    started_s = node.link.time_s

    boot_up = node.link.wait(node.is_boot_up, node.boot_up_timeout_s, mark)

    if boot_up is None:
        raise SetupRefused("there is no boot-up message, see BOOT-01")
    limit_ms = float(spec.services.nmt.boot_up_ms or 0)
    taken_s = boot_up.time_s - node.link.longest_wait_s(boot_up) - started_s
    verdict.at_most("time to boot-up", taken_s * 1000, limit_ms, unit="ms")
