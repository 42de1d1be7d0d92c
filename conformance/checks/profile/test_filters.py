"""Low-pass filters of measured angles: how a value follows a sudden turn under each of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.sensor.filters import (
    HIGH_HZ,
    LOW_HZ,
    Choice,
    Response,
    Tried,
    choices,
    filters,
    moments,
    observe_filters,
    require_looks,
)
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.session import Bench
from conformance.checks.limits import STEPS
from conformance.checks.profile.slopes import measured_slopes, tilted
from conformance.effects import Effect
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases, requirement
from conformance.spec.behaviours import FilterKind, LowPassFilter
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict

EFFECTS: tuple[Effect, ...] = ("reads", "writes", "resets")
SHARES = (0.1, 0.4)
"""Of the range: from where to where the device is turned."""

OVERSHOOT = 0.02
"""Share of a step that a rig on which the device is turned may overshoot itself."""

PEAK = 0.2
"""How long an overshoot lasts beyond what the rig may add, by the cut-off frequency: 0.38 of its inverse
with a Butterworth filter of second order."""

PROPORTION = 0.2
"""How far times may be out of proportion: the device and the bus add theirs to the filter's."""

RESOLUTION_S = 0.01
"""How exactly a time is seen through SDO."""


class Filtered(NamedTuple):
    """A filter of a value and what of it is judged."""

    rule: LowPassFilter
    tried: tuple[Choice, ...]


def _filtered(
    label: str, pick: Callable[[DeviceSpec, LowPassFilter], Iterable[tuple[Choice, ...]]]
) -> tuple[str, Cases]:
    def generate(spec: DeviceSpec) -> Iterable[Case]:
        shown = {slope.entry.key for slope in measured_slopes(spec)}
        for rule in filters(spec):
            entry = spec.entries[key_of(rule.value)]
            stores: tuple[Effect, ...] = (
                () if moments(spec, rule) == {"at-once"} else ("non-volatile",)
            )
            for tried in pick(spec, rule) if entry.key in shown else ():
                name = label.format(address=entry.address, selector=tried[0].selector)
                yield Case(name, Filtered(rule, tried), rule.source, stores)

    return "filtered", generate


def _of_kind(
    *kinds: FilterKind,
) -> Callable[[DeviceSpec, LowPassFilter], Iterable[tuple[Choice, ...]]]:
    def pick(spec: DeviceSpec, rule: LowPassFilter) -> Iterable[tuple[Choice, ...]]:
        for selector, kind in rule.kinds.items():
            tried = tuple(it for it in choices(spec, rule) if it.selector == selector)
            if kind in kinds and tried:
                yield tried

    return pick


@requirement(
    "DEV-27",
    level="manual",
    cases=_filtered("{address}/{selector}", _of_kind("critically-damped", "without-overshoot")),
    effects=EFFECTS,
    needs=("sudden-tilt",),
)
def test_filter_does_not_overshoot(
    bench: Bench, node: Node, stimulus: Stimulus, filtered: Filtered, verdict: Verdict
) -> None:
    """With a filter that is documented not to overshoot, a value does not when the device is turned."""
    seen = _tried(bench, node, stimulus, verdict)

    for choice in filtered.tried:
        response = _response(seen, choice, filtered)
        _require_peak(response, choice)
        verdict.at_most("overshoot", response.overshoot, _most_overshoot(response), unit="steps")


@requirement(
    "DEV-28",
    level="manual",
    cases=_filtered("{address}/{selector}", _of_kind("butterworth")),
    effects=EFFECTS,
    needs=("sudden-tilt",),
)
def test_filter_overshoots(
    bench: Bench, node: Node, stimulus: Stimulus, filtered: Filtered, verdict: Verdict
) -> None:
    """With a filter that is documented to overshoot, a value does when the device is turned."""
    seen = _tried(bench, node, stimulus, verdict)

    for choice in filtered.tried:
        response = _response(seen, choice, filtered)
        _require_peak(response, choice)
        verdict.at_least("overshoot", response.overshoot, _most_overshoot(response), unit="steps")


def _require_peak(response: Response, choice: Choice) -> None:
    """Make sure that an overshoot would have been seen, unless one was.

    Raises:
        SetupRefused: Nobody looked at the value for so long that it may have passed.
    """
    if response.overshoot <= _most_overshoot(response):
        require_looks([response.longest_gap], PEAK / (choice.cut_off_hz or HIGH_HZ))


def _responding(spec: DeviceSpec, rule: LowPassFilter) -> Iterable[tuple[Choice, ...]]:
    if rule.response is not None:
        every = _of_kind("critically-damped")(spec, rule)
        yield from (tried for tried in every if len(tried) > 1)


@requirement(
    "DEV-29",
    level="manual",
    cases=_filtered("{address}/{selector}", _responding),
    effects=EFFECTS,
    needs=("sudden-tilt",),
)
def test_response_time_goes_with_the_cut_off(
    bench: Bench, node: Node, stimulus: Stimulus, filtered: Filtered, verdict: Verdict
) -> None:
    """The response time is the inverse of the cut-off frequency: half of a step takes less, in proportion."""
    seen = _tried(bench, node, stimulus, verdict)

    rates = [choice.cut_off_hz or 0.0 for choice in filtered.tried]
    responses = [_response(seen, choice, filtered) for choice in filtered.tried]
    times = [response.half_s for response in responses]

    gaps = [response.gap for response in responses]
    require_looks(gaps, max(RESOLUTION_S, PROPORTION / 2 * min(times)))
    for rate, time in zip(rates, times, strict=True):
        verdict.at_most(f"half of a step at {rate:g} Hz", time, 1 / rate, unit="s")
    wanted = rates[-1] / rates[0]
    proportion = times[0] / max(times[-1], RESOLUTION_S)
    quantity = f"time at {rates[0]:g} Hz by that at {rates[-1]:g} Hz"
    verdict.within(quantity, [proportion], wanted, wanted * PROPORTION, unit="times")


def _in_order(spec: DeviceSpec, rule: LowPassFilter) -> Iterable[tuple[Choice, ...]]:
    """Return the filters of a documented order, or a slow filter and none at all."""
    found = choices(spec, rule)
    off = [it for it in found if rule.kinds.get(it.selector) == "off"]
    slow = [it for it in found if it.cut_off_hz == LOW_HZ]
    ordered = found if rule.slowest_first else [*slow[:1], *off[:1]]
    if len(ordered) > 1:
        yield tuple(ordered)


@requirement(
    "DEV-30",
    level="manual",
    cases=_filtered("{address}", _in_order),
    effects=EFFECTS,
    needs=("sudden-tilt",),
)
def test_slower_filter_is_slower(
    bench: Bench, node: Node, stimulus: Stimulus, filtered: Filtered, verdict: Verdict
) -> None:
    """With a filter that is documented as the slower one, or on, a value follows a turn later."""
    seen = _tried(bench, node, stimulus, verdict)

    responses = [_response(seen, choice, filtered) for choice in filtered.tried]
    times = [response.half_s for response in responses]
    gaps = [response.gap for response in responses]

    for slow, fast, one, other in zip(
        times, times[1:], filtered.tried, filtered.tried[1:], strict=False
    ):
        if slow <= fast <= RESOLUTION_S:
            raise SetupRefused("both filters are too fast to be told apart through SDO")
        require_looks(gaps, max(RESOLUTION_S, abs(slow - fast)))
        verdict.holds(
            f"half of a step with {one.selector} and with {other.selector}",
            expected="the first later",
            actual=f"{slow:.3f} s and {fast:.3f} s",
            ok=slow - fast > RESOLUTION_S / 2,
        )


def _stored_only(spec: DeviceSpec, rule: LowPassFilter) -> Iterable[tuple[Choice, ...]]:
    found = choices(spec, rule)
    if "at-once" not in moments(spec, rule) and len(found) > 1:
        yield found[0], found[-1]


@requirement(
    "DEV-31",
    level="manual",
    cases=_filtered("{address}", _stored_only),
    effects=EFFECTS,
    needs=("sudden-tilt",),
)
def test_new_filter_waits_for_a_store(
    bench: Bench, node: Node, stimulus: Stimulus, filtered: Filtered, verdict: Verdict
) -> None:
    """A new filter that was written and not stored leaves a value as fast as it was."""
    seen = _tried(bench, node, stimulus, verdict)
    responses = [_response(seen, choice, filtered) for choice in filtered.tried]
    slow, fast = (response.half_s for response in responses)
    if seen.unsaved is None or slow - fast <= RESOLUTION_S:
        raise SetupRefused("the two filters take the same time, see DEV-30")

    unsaved = seen.unsaved[key_of(filtered.rule.value)]

    tolerance = RESOLUTION_S + PROPORTION * min(slow, slow - fast)
    require_looks([it.gap for it in (*responses, unsaved)], tolerance)
    verdict.within("half of a step, not stored", [unsaved.half_s], slow, tolerance, unit="s")


def _tried(bench: Bench, node: Node, stimulus: Stimulus, verdict: Verdict) -> Tried:
    """Return how the values followed under every filter, tried once in a run."""
    rules = filters(node.spec)
    before, after = (tilted(node.spec, share) for share in SHARES)
    observe = partial(observe_filters, node, stimulus, rules, before, after)
    seen = bench.observations.once("filters", Tried, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def _response(seen: Tried, choice: Choice, filtered: Filtered) -> Response:
    """Return how a value followed under one filter.

    Raises:
        SetupRefused: It did not follow at all; DEV-01 judges that.
    """
    response = seen.responses[choice][key_of(filtered.rule.value)]
    if abs(response.step) <= STEPS:
        raise SetupRefused("the value does not follow the tilt, see DEV-01")
    return response


def _most_overshoot(response: Response) -> float:
    return STEPS + OVERSHOOT * abs(response.step)
