"""The node's filters tried one after the other: how the values follow a sudden turn under each."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.sensor.settling import MOST_S, STEPS, hertz
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.settings.settings import Settings
from conformance.errors import HostLate, SetupRefused
from conformance.spec.behaviours import LowPassFilter
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry, Key, Range, is_legal

LOW_HZ: Final = 0.5
HIGH_HZ: Final = 2.0
"""Cut-off frequencies to try: slow enough to be seen through SDO, far enough apart to be told."""

PAUSE_S: Final = 0.005
"""Between two looks at a value that follows."""

LEAST_CALM_S: Final = 0.5
"""A value that has not changed for so long, and for as long as it took, is at rest."""

Angles = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Choice:
    """A filter to try.

    Args:
        selector: Value of the object that chooses it.
        cut_off_hz: Its cut-off frequency; None where it has none.
    """

    selector: int
    cut_off_hz: float | None


class Look(NamedTuple):
    """A look at a value.

    Args:
        time_s: When its answer was there, in s since the turn.
        value: In steps.
        answered_s: How long answers took since the turn, of all looks together, in s.
    """

    time_s: float
    value: int
    answered_s: float


class Gap(NamedTuple):
    """A time in which nobody looked at a value: the slower the bus, the longer.

    Args:
        unseen_s: How long, in s.
        idle_s: How much of that neither an answer took nor the pause between two looks, in s.
    """

    unseen_s: float
    idle_s: float


@dataclass(frozen=True, slots=True)
class Response:
    """How a value followed a sudden turn.

    Args:
        before: The value before it, in steps.
        looks: The looks since, the first at the turn itself.
    """

    before: int
    looks: tuple[Look, ...]

    @property
    def step(self) -> int:
        """By how much the value has changed in the end, in steps."""
        return self.looks[-1].value - self.before

    @property
    def half_s(self) -> float:
        """When it had made half of the way, in s."""
        return self.looks[self._half].time_s

    @property
    def gap(self) -> Gap:
        """How long nobody looked before it had."""
        return self._gap(max(self._half, 1))

    @property
    def longest_gap(self) -> Gap:
        """How long nobody looked at most."""
        return max(self._gap(place) for place in range(1, len(self.looks)))

    def _gap(self, place: int) -> Gap:
        before, after = self.looks[place - 1 : place + 1]
        unseen_s = after.time_s - before.time_s
        return Gap(unseen_s, max(0.0, unseen_s - PAUSE_S - (after.answered_s - before.answered_s)))

    @property
    def _half(self) -> int:
        far = (2 * abs(look.value - self.before) >= abs(self.step) for look in self.looks)
        return next(place for place, reached in enumerate(far) if reached)

    @property
    def overshoot(self) -> float:
        """By how much it went further than in the end, in steps."""
        sign = -1 if self.step < 0 else 1
        return max(sign * (look.value - self.before) for look in self.looks) - abs(self.step)


Responses = Mapping[Key, Response]


@dataclass(frozen=True, slots=True)
class Tried:
    """What became of the filters.

    Args:
        responses: By filter, once all was done that a reading asks for.
        unsaved: With the last filter written and not stored, the first one in force.
    """

    responses: Mapping[Choice, Responses]
    unsaved: Responses | None


def filters(spec: DeviceSpec) -> list[LowPassFilter]:
    """Return the filters whose values every reading has."""
    rules = (rule for rule in spec.behaviours.values() if isinstance(rule, LowPassFilter))
    return [rule for rule in rules if _present(spec, rule)]


def _present(spec: DeviceSpec, rule: LowPassFilter) -> bool:
    named = (rule.value, rule.selector, *([] if rule.cut_off is None else [rule.cut_off]))
    return not any(spec.entries[key_of(it)].optional for it in named)


def choices(spec: DeviceSpec, rule: LowPassFilter) -> list[Choice]:
    """Return the filters to try, the slowest first where the manual has an order."""
    return [
        Choice(selector, rate)
        for selector in rule.slowest_first or rule.kinds
        for rate in _rates(spec, rule, selector)
    ]


def _rates(spec: DeviceSpec, rule: LowPassFilter, selector: int) -> list[float | None]:
    """Return the cut-off frequencies to try with a filter that are legal by every reading."""
    kind = rule.kinds.get(selector, "any")
    if rule.cut_off is None or kind == "off":
        return [None]
    entry = spec.entries[key_of(rule.cut_off)]
    rates = (LOW_HZ, HIGH_HZ) if kind == "critically-damped" else (HIGH_HZ,)
    return [rate for rate in rates if _legal(entry, selector, _steps(entry, rate))]


def _steps(entry: Entry, rate_hz: float) -> int:
    return round(rate_hz / hertz(entry, 1))


def _legal(entry: Entry, selector: int, value: int) -> bool:
    """Tell whether a cut-off frequency is legal with a filter, by every reading."""
    return all(is_legal(value, _ranges(reading, selector)) for reading in entry.readings)


def _ranges(entry: Entry, selector: int) -> tuple[Range, ...] | None:
    if entry.limits_by is None:
        return entry.legal
    return entry.limits_by.ranges.get(selector, entry.legal)


def moments(spec: DeviceSpec, rule: LowPassFilter) -> set[str]:
    """Return when a new filter acts, under each reading."""
    named = [rule.selector, *([] if rule.cut_off is None else [rule.cut_off])]
    named += [] if rule.fusion is None else [rule.fusion.object]
    return {it.effective for one in named for it in spec.entries[key_of(one)].readings}


def observe_filters(
    node: Node, stimulus: Stimulus, rules: Sequence[LowPassFilter], before: Angles, after: Angles
) -> Tried:
    """Try every filter; the node is left with what it had stored.

    Args:
        node: The node under test.
        stimulus: What turns it.
        rules: The filters of all axes, chosen by one object.
        before: The tilt of both axes from which it is turned, in deg.
        after: The tilt to which it is turned.
    """
    rule, keys = rules[0], [key_of(it.value) for it in rules]
    when = moments(node.spec, rule)
    settings = Settings(node)
    responses: dict[Choice, Responses] = {}
    unsaved = None
    try:
        settings.begin()
        tried = choices(node.spec, rule)
        for choice in tried:
            wanted = dict(written(node.spec, rule, choice))
            require_held(node, put_in_force(node, settings, wanted, when))
            responses[choice] = respond(node, stimulus, keys, before, after)
            if choice == tried[0] and "at-once" not in when:
                settings.write(dict(written(node.spec, rule, tried[-1])))
                unsaved = respond(node, stimulus, keys, before, after)
    finally:
        settings.put_back()
    return Tried(responses, unsaved)


def written(spec: DeviceSpec, rule: LowPassFilter, choice: Choice) -> Iterator[tuple[Key, bytes]]:
    """Return what to write to choose a filter."""
    if rule.fusion is not None:
        fusion = spec.entries[key_of(rule.fusion.object)]
        yield fusion.key, fusion.type.encode(rule.fusion.otherwise)
    selector = spec.entries[key_of(rule.selector)]
    yield selector.key, selector.type.encode(choice.selector)
    if rule.cut_off is not None:
        entry = spec.entries[key_of(rule.cut_off)]
        steps = _steps(entry, choice.cut_off_hz or LOW_HZ)  # what still acts without a filter shows
        if _legal(entry, choice.selector, steps):
            yield entry.key, entry.type.encode(steps)


def put_in_force(
    node: Node, settings: Settings, wanted: Mapping[Key, bytes], when: Collection[str]
) -> list[Key]:
    """Write settings, with a store and a restart unless they surely act at once.

    Returns:
        Those that then hold something else.
    """
    settings.write(wanted)
    if when != {"at-once"}:
        settings.save()
        node.reset()
    return [key for key, data in wanted.items() if node.upload(*key) != data]


def require_held(node: Node, lost: Iterable[Key]) -> None:
    """Make sure that the node holds what was written.

    Raises:
        SetupRefused: It does not.
    """
    for key in lost:
        raise SetupRefused(f"{node.spec.entries[key].address} does not take a legal value")


def respond(
    node: Node, stimulus: Stimulus, keys: Sequence[Key], before: Angles, after: Angles
) -> Responses:
    """Turn the node and look at its values until they are at rest."""
    stimulus.tilt(*before)
    start = {key: node.number(*key) for key in keys}
    looks = {key: [Look(0.0, start[key], 0.0)] for key in keys}
    last = dict(start)
    began = stimulus.turn(*after)
    changed_s = passed_s = answered_s = 0.0
    while passed_s < MOST_S and (not changed_s or passed_s - changed_s < _calm_s(changed_s)):
        for key in keys:
            asked_s, mark = node.link.time_s, node.link.mark()
            value = node.number(*key)
            answer = node.link.since(mark, lambda _: True)[-1]
            answered_s += max(0.0, answer.time_s - answer.late_ms / 1000 - asked_s)
            passed_s = node.link.now() - began
            if abs(value - last[key]) > STEPS:
                last[key], changed_s = value, passed_s
            looks[key].append(Look(passed_s, value, answered_s))
        node.link.listen(PAUSE_S, lambda _: False)
    return {key: Response(start[key], tuple(looks[key])) for key in keys}


def require_looks(gaps: Iterable[Gap], apart_s: float) -> None:
    """Make sure that values were looked at often enough.

    Args:
        gaps: In which nobody looked at them.
        apart_s: How long one may be.

    Raises:
        HostLate: One is longer, and would not be on a computer that is in time.
        SetupRefused: One is longer.
    """
    blind = [it for it in gaps if it.unseen_s > apart_s]
    if not blind:
        return
    words = f"nobody could look for {max(it.unseen_s for it in blind):.3f} s"
    if all(it.unseen_s - it.idle_s <= apart_s for it in blind):
        late_ms = max(it.idle_s for it in blind) * 1000
        raise HostLate(f"the computer is too busy: {words}", late_ms)
    raise SetupRefused(f"the bus is too busy: {words}")


def _calm_s(changed_s: float) -> float:
    return max(LEAST_CALM_S, changed_s / 2)
