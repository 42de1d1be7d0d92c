"""Sensor fusion: how an angle that it forms follows a sudden turn."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.sensor.filters import LOW_HZ, choices, filters, moments, require_looks
from conformance.bench.sensor.fusion import Fused, observe_fusion
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.session import Bench
from conformance.checks.cases import OUT_OF_RANGE, REFUSED_WRITE
from conformance.checks.limits import STEPS
from conformance.checks.profile.slopes import measured_slopes, tilted
from conformance.effects import Effect
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.behaviours import LowPassFilter
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, is_legal
from conformance.verdict import Verdict

SHARES = (0.1, 0.4)
"""Of the range: from where to where the device is turned."""

AT_ONCE_S = 0.1
"""Half of a step after so long has a delay to be neglected."""


def _fusions(spec: DeviceSpec) -> list[LowPassFilter]:
    return [rule for rule in filters(spec) if rule.fusion is not None]


def _fused(spec: DeviceSpec) -> Iterable[Case]:
    shown = {slope.entry.key for slope in measured_slopes(spec)}
    for rule in _fusions(spec):
        entry = spec.entries[key_of(rule.value)]
        stores: tuple[Effect, ...] = () if moments(spec, rule) == {"at-once"} else ("non-volatile",)
        if entry.key in shown and rule.fusion is not None:
            yield Case(entry.address, rule, rule.fusion.source, stores)


@requirement(
    "DEV-34",
    level="manual",
    cases=("rule", _fused),
    effects=("reads", "writes", "resets"),
    needs=("sudden-tilt",),
)
def test_fusion_follows_at_once(
    bench: Bench, node: Node, stimulus: Stimulus, rule: LowPassFilter, verdict: Verdict
) -> None:
    """With the sensor fusion a value follows a turn at once, whatever its settings, or the node has none."""
    seen = _tried(bench, node, stimulus, verdict)

    if not seen.answer.confirmed:
        _judge_refused(node.spec, rule, seen, verdict)
    if rule.fusion is not None and not seen.chosen:
        place = node.spec.entries[key_of(rule.fusion.object)].address
        verdict.equal(f"{place} once the fusion is to be in force", "lost", "as written")
    for name, responses in seen.responses.items():
        response = responses[key_of(rule.value)]
        if abs(response.step) <= STEPS:
            raise SetupRefused("the value does not follow the tilt, see DEV-01")
        if response.half_s > AT_ONCE_S:
            require_looks([response.gap], response.half_s - AT_ONCE_S)
        verdict.at_most(f"half of a step with {name}", response.half_s, AT_ONCE_S, unit="s")


def _judge_refused(spec: DeviceSpec, rule: LowPassFilter, seen: Fused, verdict: Verdict) -> None:
    """Judge that a node without the fusion refuses it, where a reading has it so."""
    if rule.fusion is None:
        return
    entry, value = spec.entries[key_of(rule.fusion.object)], rule.fusion.value
    without = [it for it in entry.alternatives if not is_legal(value, it.entry.legal)]
    verdict.holds(
        f"download of {value} to {entry.address}",
        expected="confirmed, or refused" if without else "confirmed",
        actual=str(seen.answer),
        ok=bool(without) and seen.answer.abort in (*OUT_OF_RANGE, *REFUSED_WRITE),
    )
    for other in without[:1]:
        verdict.follows(other.ambiguity, other.reading)


def _tried(bench: Bench, node: Node, stimulus: Stimulus, verdict: Verdict) -> Fused:
    """Return how the values followed with the fusion, tried once in a run."""
    rules = _fusions(node.spec)
    slow = next(it for it in choices(node.spec, rules[0]) if it.cut_off_hz == LOW_HZ)
    before, after = (tilted(node.spec, share) for share in SHARES)
    observe = partial(observe_fusion, node, stimulus, rules, slow, before, after)
    seen = bench.observations.once("fusion", Fused, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome
