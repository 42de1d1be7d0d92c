"""Zero points of slopes over a store and a restore (CiA 410; CiA 301 v4.2.0, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.bench.settings.zero_points import Tried, ZeroPoint, observe_zero_points
from conformance.checks.memory import storable
from conformance.checks.profile.slopes import having, measured_slopes
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict


def _points(spec: DeviceSpec) -> Iterator[ZeroPoint]:
    """Return the zero points that by some reading a preset alone moves."""
    for slope in measured_slopes(spec):
        rule = slope.rule
        if rule is None or rule.preset is None or rule.offset is None:
            continue
        preset, offset = key_of(rule.preset), key_of(rule.offset)
        fixed = not all(reading.writable for reading in spec.entries[offset].readings)
        if fixed and having("preset", "offset")(slope, spec):
            yield ZeroPoint(slope.entry.key, preset, offset)


def _zero_points(spec: DeviceSpec) -> Iterable[Case]:
    if spec.services.store is None or spec.services.restore is None:
        return
    for point in _points(spec):
        offset = spec.entries[point.offset]
        if all(reading.persistent is not None for reading in offset.readings):
            yield Case(offset.address, point, offset.source_of("persistent"))


def _kept(spec: DeviceSpec) -> Iterable[Case]:
    """Return the presets and offsets of which every reading says whether they are stored."""
    points = _points(spec) if spec.services.store and spec.services.restore else ()
    for key in (key for point in points for key in (point.preset, point.offset)):
        entry = spec.entries[key]
        if all(reading.persistent is not None for reading in entry.readings):
            yield Case(entry.address, entry, entry.source_of("persistent"))


@requirement("DEV-40", level="manual", cases=("entry", _kept), effects=storable.RESTORES)
def test_stored_zero_point_is_kept(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A zero point that was stored is kept over a restart, or gone, as documented."""
    seen = _tried(bench, node, verdict)

    held = {True: seen.stored[entry.key], False: seen.found[entry.key]}
    allowed = dict.fromkeys(held[bool(reading.persistent)] for reading in entry.readings)
    after = seen.after[entry.key]
    verdict.one_of(f"value of {entry.address} after the restart", after, list(allowed))
    fitting = [held[bool(reading.persistent)] == after for reading in entry.readings]
    if any(fitting) and (number := fitting.index(True)):
        other = entry.alternatives[number - 1]
        verdict.follows(other.ambiguity, other.reading)


def _restored(spec: DeviceSpec) -> Iterable[Case]:
    """Return the zero points that every reading restores, with a default."""
    restores = [services.restore for services, _ in spec.services_readings]
    for case in _zero_points(spec):
        entries = [spec.entries[key] for key in (case.subject.preset, case.subject.offset)]
        known = all(reading.default == 0 for it in entries for reading in it.readings)
        sub = storable.widest_restore(spec)
        covered = all(
            restore is not None and restore.covers(sub, entry.index)
            for restore in restores
            for entry in entries
        )
        if known and covered:
            yield Case(case.label, case.subject, entries[1].source_of("default"))


@requirement("RST-14", level="manual", cases=("point", _restored), effects=storable.RESTORES)
def test_restored_zero_point_is_gone(
    bench: Bench, node: Node, point: ZeroPoint, verdict: Verdict
) -> None:
    """After a restore and a restart no preset is left of a stored zero point: it and the offset are 0."""
    seen = _tried(bench, node, verdict)

    for key in (point.preset, point.offset):
        verdict.equal(f"value of {node.spec.entries[key].address}", seen.restored[key], 0)


def _tried(bench: Bench, node: Node, verdict: Verdict) -> Tried:
    """Return what became of the zero points, tried once in a run."""
    restore = node.spec.services.restore
    if restore is None:
        raise SetupRefused("the manual documents no restore")
    sub = storable.widest_restore(node.spec)
    observe = partial(observe_zero_points, node, list(_points(node.spec)), restore, sub)
    seen = bench.observations.once("zero points", Tried, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome
