"""NMT resets: in every state, and what reset communication resets (CiA 301 v4.2.0, 7.3.2.2.1)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.services.heartbeat import NO_HEARTBEAT, HeartbeatPort
from conformance.bench.session import Bench
from conformance.bench.settings.second_values import can_be_set
from conformance.bench.settings.trials import Kept, observe_reset_communication
from conformance.checks.cases import with_heartbeat
from conformance.checks.memory.kept import judge_value, require_changed
from conformance.checks.states.starts import (
    RESETS,
    Start,
    begin_start,
    count_boot_ups,
    judge_start_state,
)
from conformance.checks.steps import require_state, state_word
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtState

POWER_ON_VALUES = f"{CIA301}, 7.3.2.2.1"
COMMUNICATION = range(0x1000, 0x2000)
"""The communication profile area, which reset communication sets back."""


class Restart(NamedTuple):
    """A reset command in a state."""

    before: NmtState
    way: Start


def _restarts(spec: DeviceSpec) -> Iterable[Case]:
    for before in (NmtState.OPERATIONAL, NmtState.STOPPED):
        for word, command in RESETS.items():
            for broadcast in (False, True):
                yield Case(
                    f"{state_word(before)}/{word}{'/broadcast' if broadcast else ''}",
                    Restart(before, Start(command, broadcast)),
                    spec.services.nmt.source,
                    ("other-nodes",) if broadcast else (),
                )


@requirement(
    "NMT-08",
    level="shall",
    cases=("restart", with_heartbeat(_restarts)),
    source=f"{CIA301}, 7.3.2.2",
    effects=("reads", "writes", "resets"),
)
def test_reset_works_in_every_state(
    node: Node, heartbeat: HeartbeatPort, restart: Restart, spec: DeviceSpec, verdict: Verdict
) -> None:
    """Reset node and reset communication restart the node from Operational and Stopped as well."""
    require_state(node, heartbeat, restart.before)

    count_boot_ups(node, begin_start(node, restart.way))

    # a node that did not restart still sends the heartbeats that were switched on
    seen = heartbeat.state_now()
    judge_start_state(spec, verdict, heartbeat.state() if seen == NO_HEARTBEAT else seen)


def _resets_all(spec: DeviceSpec) -> set[bool]:
    """Return whether reset communication resets everything, under each reading."""
    return {it.nmt.reset_communication == "everything" for it, _ in spec.services_readings}


def _communication(spec: DeviceSpec) -> Iterable[Case]:
    return (case for case in _unsaved(spec) if case.subject.index in COMMUNICATION)


def _application_kept(spec: DeviceSpec) -> Iterable[Case]:
    return _application(spec) if _resets_all(spec) == {False} else ()


def _application_reset(spec: DeviceSpec) -> Iterable[Case]:
    return _application(spec) if _resets_all(spec) == {True} else ()


def _application(spec: DeviceSpec) -> Iterable[Case]:
    return (case for case in _unsaved(spec) if case.subject.index not in COMMUNICATION)


def _unsaved(spec: DeviceSpec) -> Iterable[Case]:
    """Return every setting that can be changed without storing it, alone in its area."""
    for entry in spec.entries.values():
        stays = any(reading.persistent for reading in entry.readings) and any(
            services.store is None for services, _ in spec.services_readings
        )
        areas = {key[0] in COMMUNICATION for key in spec.companions(entry.key)}
        others = [spec.entry(*condition.key) for condition in entry.writable_while]
        settled = all(other is not None and not other.optional for other in others)
        if can_be_set(entry, spec) and settled and not stays and len(areas) == 1:
            yield Case(entry.address, entry, spec.services.nmt.source)


@requirement(
    "NMT-13",
    level="shall",
    cases=("entry", _communication),
    source=POWER_ON_VALUES,
    effects=("reads", "writes", "resets"),
)
def test_reset_communication_resets_the_communication(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """Reset communication returns a setting of 1000h to 1FFFh to its value at power-on."""
    outcome = _observed(bench, node, verdict)

    require_changed(entry, outcome)

    judge_value(verdict, entry, outcome.after, outcome.found)


@requirement(
    "NMT-14",
    level="should",
    cases=("entry", _application_kept),
    source=POWER_ON_VALUES,
    effects=("reads", "writes", "resets"),
)
def test_reset_communication_leaves_the_application(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """Reset communication leaves a setting from 2000h on as it was written."""
    outcome = _observed(bench, node, verdict)

    require_changed(entry, outcome)

    judge_value(verdict, entry, outcome.after, outcome.chosen)


@requirement(
    "NMT-15",
    level="manual",
    cases=("entry", _application_reset),
    effects=("reads", "writes", "resets"),
)
def test_reset_communication_resets_the_application_where_documented(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """Reset communication returns a setting from 2000h on too, where the manual has it so."""
    outcome = _observed(bench, node, verdict)

    require_changed(entry, outcome)

    judge_value(verdict, entry, outcome.after, outcome.found)


def _observed(bench: Bench, node: Node, verdict: Verdict) -> Kept:
    """Return what became of changed settings over one reset communication."""
    seen = bench.observations.once(
        "reset communication", Kept, lambda: observe_reset_communication(node)
    )
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome
