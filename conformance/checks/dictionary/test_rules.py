"""Rules between objects: one value with several addresses, conditions, conflicts of settings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.settings.in_force import InForce
from conformance.checks import cases
from conformance.checks.profile.shown import Outcome, confirmed, judge, turn_steps
from conformance.checks.profile.slope_ports import plain_port_of
from conformance.checks.profile.slopes import MeasuredSlope, having, slopes, targets
from conformance.checks.steps import require_writable
from conformance.checks.waiting import at_need, put_in_force
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.behaviours import SameValue, Slope
from conformance.spec.fields import key_of
from conformance.spec.model import (
    Condition,
    DeviceSpec,
    Entry,
    LimitsBy,
    OtherBehaviours,
    address,
)
from conformance.verdict import Verdict


@dataclass(frozen=True, slots=True)
class Twins:
    """One entry of several that show one value.

    Args:
        name: Name of their rule.
        entry: The one to write.
        others: The rest.
    """

    name: str
    entry: Entry
    others: tuple[Entry, ...]


def _twins(spec: DeviceSpec) -> Iterable[Case]:
    for name, rule in spec.behaviours.items():
        if not isinstance(rule, SameValue):
            continue
        entries = [spec.entries[key_of(it)] for it in rule.objects]
        for entry in entries:
            others = tuple(it for it in entries if it is not entry)
            if all(_plain(it, spec) for it in entries):
                yield Case(entry.address, Twins(name, entry, others), rule.source)


def _plain(entry: Entry, spec: DeviceSpec) -> bool:
    every = all(r.writable and r.readable and cases.present(r, spec) for r in entry.readings)
    return every and cases.same_type(entry) and not cases.moves_the_node(entry, spec)


@requirement("DEV-18", level="manual", cases=("twins", _twins), effects=("reads", "writes"))
def test_one_value_is_read_at_all_its_addresses(node: Node, twins: Twins, verdict: Verdict) -> None:
    """A value written at one of its addresses is read at the others."""
    before = {other.key: node.number(*other.key) for other in twins.others}
    value = _another(twins, set(before.values()) | {node.number(*twins.entry.key)})

    data = twins.entry.type.encode(value)
    transfer = node.try_download(*twins.entry.key, data)

    confirmed(verdict, f"download of {value} to {twins.entry.address}", transfer)
    for other in twins.others:
        allowed = _allowed(node.spec, twins, value, before[other.key])
        read = node.number(*other.key)
        verdict.one_of(f"value of {other.address}", read, list(allowed))
        if (reading := allowed.get(read)) is not None:
            verdict.follows(reading.ambiguity, reading.reading)


def _another(twins: Twins, present: set[int]) -> int:
    """Return a small legal value that none of the entries holds, and that is not 0."""
    for value in range(1, 128):
        entries = (twins.entry, *twins.others)
        legal = all(entry.always_legal(value) for entry in entries)
        if legal and value not in present:
            return value
    raise SetupRefused(f"{twins.entry.address} takes no other small value")


def _allowed(
    spec: DeviceSpec, twins: Twins, value: int, before: int
) -> dict[int, OtherBehaviours | None]:
    """Return what a twin may read, and by which reading."""
    allowed: dict[int, OtherBehaviours | None] = {}
    for rule, other in spec.behaviour_readings(twins.name):
        allowed.setdefault(before if rule is None else value, other)
    presets = {
        key_of(rule.preset): name
        for name, rule in spec.behaviours.items()
        if isinstance(rule, Slope) and rule.preset is not None
    }
    for rule, other in spec.behaviour_readings(presets.get(twins.entry.key, "")):
        if isinstance(rule, Slope) and rule.preset_reads == "zero":
            allowed.setdefault(0, other)
    return allowed


def _twin_presets(slope: MeasuredSlope, spec: DeviceSpec) -> bool:
    if not having("preset")(slope, spec) or slope.rule is None:
        return False
    return len(spec.companions(key_of(slope.rule.preset or 0))) > 1


@requirement("DEV-19", level="manual", cases=slopes(_twin_presets), effects=("reads", "writes"))
def test_preset_at_another_address(
    node: Node, slope: MeasuredSlope, in_force: InForce, verdict: Verdict
) -> None:
    """A preset written at another of its addresses acts on the slope too, where the two are one."""
    port = plain_port_of(node, slope, in_force, verdict)
    before, key = port.seen(), key_of(port.rule_of("preset"))
    twin = next(it for it in node.spec.companions(key) if it != key)
    preset = targets(slope, port.step_deg)[-1]

    data = node.spec.entries[twin].type.encode(preset)
    confirmed(verdict, f"preset of {preset} to {address(*twin)}", node.try_download(*twin, data))

    apart = [
        Outcome(before.value, (other,))
        for name, rule in node.spec.behaviours.items()
        if isinstance(rule, SameValue) and key in map(key_of, rule.objects)
        for other_rule, other in node.spec.behaviour_readings(name)
        if other_rule is None
    ]
    judge(
        verdict,
        f"{slope.entry.address} after the preset",
        port.seen(),
        [Outcome(preset), *apart],
        before=before,
        turn_steps=turn_steps(slope, port.step_deg),
    )


@dataclass(frozen=True, slots=True)
class Conditional:
    """An entry that takes a new value only while another one holds something."""

    entry: Entry
    condition: Condition


def _conditional(spec: DeviceSpec) -> Iterable[Case]:
    for entry in spec.entries.values():
        several = len(entry.writable_while) > 1
        for condition in entry.writable_while:
            other = spec.entries.get(condition.key)
            every = other is not None and all(condition in r.writable_while for r in entry.readings)
            if other is not None and every and _plain(other, spec) and _plain(entry, spec):
                label = f"{entry.address}/{other.address}" if several else entry.address
                conditional = Conditional(entry, condition)
                yield Case(label, conditional, entry.source, at_need=at_need(other))


@requirement("DEV-20", level="manual", cases=("case", _conditional), effects=("reads", "writes"))
def test_entry_changes_only_while_another_allows_it(
    node: Node, case: Conditional, in_force: InForce, verdict: Verdict
) -> None:
    """While another object does not hold what is needed, a new value is refused, or ignored as documented."""
    entry, condition = case.entry, case.condition
    require_writable(node, entry)
    other = node.spec.entries[condition.key]
    node.download(*other.key, node.number(*other.key) ^ condition.mask)

    def goes_on() -> bool:
        return _try_another(node, entry).changed

    put_in_force(in_force, verdict, [other], goes_on)

    tried = _try_another(node, entry)

    transfer = tried.transfer
    ways = {reading.otherwise for reading in entry.readings}
    verdict.holds(
        f"download of {tried.value} to {entry.address}",
        expected="an abort" if ways == {"refused"} else "an abort or no effect",
        actual=str(transfer),
        ok=transfer.refused or (transfer.confirmed and "ignored" in ways),
    )
    verdict.equal(f"value of {entry.address}", tried.after, tried.before)
    way = "refused" if transfer.refused else "ignored"
    if way != entry.otherwise:
        for alternative in entry.alternatives:
            if alternative.entry.otherwise == way:
                verdict.follows(alternative.ambiguity, alternative.reading)


@dataclass(frozen=True, slots=True)
class Tried:
    """A new value that was written to an entry.

    Args:
        before: What it held.
        value: What was written.
        transfer: The answer.
        after: What it holds.
    """

    before: int
    value: int
    transfer: Transfer
    after: int

    @property
    def changed(self) -> bool:
        """It was taken."""
        return self.transfer.confirmed and self.after != self.before


def _try_another(node: Node, entry: Entry) -> Tried:
    """Write another documented value to an entry.

    Raises:
        SetupRefused: There is none.
    """
    before = node.number(*entry.key)
    values = [edge for interval in entry.legal or () for edge in interval if edge != before]
    if not values:
        raise SetupRefused(f"{entry.address} has no other documented value")
    transfer = node.try_download(*entry.key, entry.type.encode(values[0]))
    return Tried(before, values[0], transfer, node.number(*entry.key))


@dataclass(frozen=True, slots=True)
class Conflict:
    """Two settings of which one allows a value of an entry and the other does not.

    Args:
        entry: The entry.
        limits: What limits it, as judged.
        allowing: Value of the other entry that allows ``value``.
        forbidding: Value of the other entry that does not.
        value: What the entry holds.
    """

    entry: Entry
    limits: LimitsBy
    allowing: int
    forbidding: int
    value: int


def _conflicts(spec: DeviceSpec) -> Iterable[Case]:
    for entry in spec.entries.values():
        if entry.limits_by is None or not _plain(entry, spec):
            continue
        other = spec.entries[entry.limits_by.key]
        found = next(_forbidden(entry, entry.limits_by), None)
        if found is not None and _plain(other, spec):
            yield Case(other.address, found, entry.limits_by.source)


def _forbidden(entry: Entry, limits: LimitsBy) -> Iterator[Conflict]:
    for allowing, ranges in limits.ranges.items():
        most = max(high for _, high in ranges)
        for forbidding, others in limits.ranges.items():
            if most > max(high for _, high in others):
                yield Conflict(entry, limits, allowing, forbidding, most)


@requirement("DEV-21", level="manual", cases=("conflict", _conflicts), effects=("reads", "writes"))
def test_setting_that_forbids_a_present_value(
    node: Node, conflict: Conflict, verdict: Verdict
) -> None:
    """A setting that does not allow another one's present value is refused, lowers it or leaves it, as documented."""
    entry, other = conflict.entry, node.spec.entries[conflict.limits.key]
    require_writable(node, other)
    node.download(*other.key, conflict.allowing)
    node.download(*entry.key, conflict.value)

    transfer = node.try_download(*other.key, other.type.encode(conflict.forbidding))

    got = (transfer.confirmed, node.number(*other.key), node.number(*entry.key))
    lowered = max(high for _, high in conflict.limits.ranges[conflict.forbidding])
    ends = {
        "refused": (False, conflict.allowing, conflict.value),
        "lowered": (True, conflict.forbidding, lowered),
        "kept": (True, conflict.forbidding, conflict.value),
    }
    ways = {
        r.limits_by.conflict: n for n, r in reversed(list(enumerate(entry.readings))) if r.limits_by
    }
    fitting = [number for way, number in ways.items() if got == ends[way]]
    verdict.holds(
        f"{other.address} and {entry.address} after a download of {conflict.forbidding}",
        expected=" or ".join(_words(ends[way]) for way in ways),
        actual=_words(got),
        ok=bool(fitting) and (transfer.confirmed or transfer.refused),
    )
    if fitting and fitting[0] > 0:
        alternative = entry.alternatives[fitting[0] - 1]
        verdict.follows(alternative.ambiguity, alternative.reading)


def _words(end: tuple[bool, int, int]) -> str:
    done, setting, value = end
    return f"{'confirmed' if done else 'refused'}, {setting} and {value}"
