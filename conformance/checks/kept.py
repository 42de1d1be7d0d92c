"""Store and restore as the checks see them: which entries they judge, and what was observed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import partial

from conformance.bench.keeping import covers, groups_of
from conformance.bench.node import Node
from conformance.bench.second_values import can_be_set
from conformance.bench.session import Bench
from conformance.bench.trials import (
    Kept,
    Refused,
    Restored,
    observe_defaults,
    observe_kept,
    observe_restored,
    observe_wrong_signatures,
)
from conformance.checks.steps import of_documented_length, own_value
from conformance.effects import Effect
from conformance.errors import ConformanceError, SetupRefused
from conformance.requirements import Case, Cases
from conformance.spec.document import Services, Store
from conformance.spec.model import DeviceSpec, Entry, Key, address
from conformance.verdict import Verdict
from conformance.wire.errors import WireError

STORES: tuple[Effect, ...] = ("reads", "writes", "resets", "non-volatile")
RESTORES: tuple[Effect, ...] = (*STORES, "restores")


# Cases


def stored_settings(spec: DeviceSpec) -> Iterable[Case]:
    """Return every setting that a store keeps by every reading."""
    for entry in spec.entries.values():
        documented = all(reading.persistent for reading in entry.readings)
        if documented and can_be_set(entry, spec) and _always_in(spec, "store", None, entry):
            yield Case(entry.address, entry, entry.source_of("persistent"))


def restored_settings(spec: DeviceSpec) -> Iterable[Case]:
    """Return every setting with a documented default that the widest restore brings back."""
    if spec.services.restore is not None:
        for entry in _settings_in(spec, widest_restore(spec)):
            yield Case(entry.address, entry, entry.source_of("default"))


def store_groups(spec: DeviceSpec) -> Iterable[Case]:
    """Return every sub-index by which parameters are stored."""
    return _groups(spec.services.store)


def restore_groups(spec: DeviceSpec) -> Iterable[Case]:
    """Return every sub-index by which defaults are restored."""
    return _groups(spec.services.restore)


def _groups(service: Store | None) -> Iterator[Case]:
    if service is not None:
        for sub in service.groups:
            yield Case(address(service.object, sub), sub, service.source)


def groups_with_rest(spec: DeviceSpec) -> Iterable[Case]:
    """Return every restore sub-index beside which there are settings that it leaves alone."""
    return (case for case in restore_groups(spec) if any(_settings_beside(spec, case.subject)))


def later_restores(spec: DeviceSpec) -> Iterable[Case]:
    """Return every restore sub-index that by no reading acts before the node restarts."""
    every = [it.restore.effective for it, _ in spec.services_readings if it.restore is not None]
    return () if "at-once" in every else restore_groups(spec)


def readable_signatures(name: str) -> Cases:
    """Return cases for every sub-index of a service that can be read by every reading."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        service: Store | None = getattr(spec.services, name)
        for sub in service.groups if service is not None else ():
            entry = spec.entry(service.object, sub) if service is not None else None
            if entry is not None and all(reading.readable for reading in entry.readings):
                yield Case(entry.address, entry, entry.source)

    return generate


def widest_restore(spec: DeviceSpec) -> int:
    """Return the sub-index of restore that acts on the most objects.

    Raises:
        SetupRefused: There is no restore.
    """
    if spec.services.restore is None:
        raise SetupRefused("the manual documents no restore")
    return groups_of(spec.services.restore, {index for index, _ in spec.entries})[0]


def _settings_in(spec: DeviceSpec, sub: int) -> Iterator[Entry]:
    """Return the settings with a default that a restore sub-index brings back by every reading."""
    for entry in spec.entries.values():
        documented = all(reading.default is not None for reading in entry.readings)
        if documented and can_be_set(entry, spec) and _always_in(spec, "restore", sub, entry):
            yield entry


def _settings_beside(spec: DeviceSpec, sub: int) -> Iterator[Entry]:
    """Return the stored settings that a restore sub-index leaves alone by every reading."""
    for case in stored_settings(spec):
        services = [it.restore for it, _ in spec.services_readings]
        if not any(it is not None and covers(it, sub, case.subject.index) for it in services):
            yield case.subject


def _always_in(spec: DeviceSpec, name: str, sub: int | None, entry: Entry) -> bool:
    return all(_is_in(services, name, sub, entry) for services, _ in spec.services_readings)


def _is_in(services: Services, name: str, sub: int | None, entry: Entry) -> bool:
    service: Store | None = getattr(services, name)
    if service is None:
        return False
    subs = service.groups if sub is None else {sub} & set(service.groups)
    return any(covers(service, each, entry.index) for each in subs)


# Observations, each made once in a run


def kept(bench: Bench, node: Node, verdict: Verdict, *, save: bool, power: bool) -> Kept:
    """Return what became of changed settings over a restart."""
    observe = partial(observe_kept, node, save=save, power=power)
    seen = bench.observations.once(f"kept, saved {save}, power {power}", Kept, observe)
    verdict.shown_in(seen.first, seen.last)
    return seen.outcome


def wrong_signatures(
    bench: Bench, node: Node, verdict: Verdict, service: Store | None, sub: int
) -> Refused:
    """Return what became of wrong signatures; those of restore are tried on stored settings."""
    if service is None:
        raise SetupRefused("the manual documents no such service")
    save = service == node.spec.services.restore
    observe = partial(observe_wrong_signatures, node, service, sub, save=save)
    name = f"wrong signatures at {address(service.object, sub)}"
    seen = bench.observations.once(name, Refused, observe)
    verdict.shown_in(seen.first, seen.last)
    return seen.outcome


def restored(bench: Bench, node: Node, verdict: Verdict, sub: int, *, power: bool) -> Restored:
    """Return what a restore of one group did."""
    service = node.spec.services.restore
    if service is None:
        raise SetupRefused("the manual documents no restore")
    observe = partial(observe_restored, node, service, sub, power=power)
    seen = bench.observations.once(f"restore {sub}, power {power}", Restored, observe)
    verdict.shown_in(seen.first, seen.last)
    return seen.outcome


def default_of(bench: Bench, node: Node, verdict: Verdict, entry: Entry) -> bytes:
    """Return what a setting holds once the factory settings are restored.

    Raises:
        SetupRefused: The node does not hold it as documented; another requirement judges that.
    """
    service = node.spec.services.restore
    if service is None:
        return own_value(node, entry)
    observe = partial(observe_defaults, node, service, widest_restore(node.spec))
    seen = bench.observations.once("defaults", dict, observe)
    verdict.shown_in(seen.first, seen.last)
    data = seen.outcome[entry.key]
    if isinstance(data, ConformanceError):
        raise data
    return of_documented_length(entry, data)


# Judgements


def require_changed(entry: Entry, outcome: Kept) -> None:
    """Make sure that a setting took the second value that a check tells it by.

    Raises:
        SetupRefused: It kept the one it had; OD-11 and OD-12 judge that.
    """
    if outcome.chosen.get(entry.key) == outcome.found.get(entry.key):
        raise SetupRefused(f"{entry.address} takes no second value, see OD-11")


def require_confirmed(outcome: Restored) -> None:
    """Make sure that the restore to be judged was not refused.

    Raises:
        SetupRefused: It was; RST-05 judges that.
    """
    if not outcome.answer.confirmed:
        raise SetupRefused(f"restore is not confirmed ({outcome.answer}), see RST-05")


def judge_value(
    verdict: Verdict, entry: Entry, actual: Mapping[Key, bytes], expected: Mapping[Key, bytes]
) -> None:
    """Judge that a setting holds what it is expected to."""
    show = partial(_show, entry)
    verdict.equal(f"value of {entry.address}", actual[entry.key], expected[entry.key], show=show)


def judge_unchanged(
    verdict: Verdict,
    what: str,
    entries: Iterable[Entry],
    actual: Mapping[Key, bytes],
    expected: Mapping[Key, bytes],
) -> None:
    """Judge that each of some settings holds what it is expected to."""
    known = [entry for entry in entries if entry.key in expected]
    wrong = [entry for entry in known if actual[entry.key] != expected[entry.key]]
    verdict.holds(
        what,
        expected=f"{len(known)} settings as they were",
        actual=_list(wrong, actual) or "all as they were",
        ok=not wrong,
    )


def judge_default(verdict: Verdict, entry: Entry, outcome: Restored) -> None:
    """Judge that a setting holds its documented default, by any reading."""
    defaults = _defaults(entry)
    if outcome.chosen[entry.key] in defaults:
        raise SetupRefused(f"{entry.address} takes no value beside its default, see OD-11")
    show = partial(_show, entry)
    verdict.one_of(f"value of {entry.address}", outcome.final[entry.key], defaults, show=show)


def judge_defaults(
    verdict: Verdict, what: str, spec: DeviceSpec, sub: int, values: Mapping[Key, bytes]
) -> None:
    """Judge that all settings of a restore sub-index hold their defaults."""
    known = [entry for entry in _settings_in(spec, sub) if entry.key in values]
    wrong = [entry for entry in known if values[entry.key] not in _defaults(entry)]
    verdict.holds(
        what,
        expected=f"{len(known)} settings at their defaults",
        actual=_list(wrong, values) or "all at their defaults",
        ok=not wrong,
    )


def beside(spec: DeviceSpec, sub: int) -> list[Entry]:
    """Return the stored settings that a restore sub-index leaves alone."""
    return list(_settings_beside(spec, sub))


def inside(spec: DeviceSpec, sub: int) -> list[Entry]:
    """Return the settings that a restore sub-index brings back."""
    return list(_settings_in(spec, sub))


def _defaults(entry: Entry) -> list[bytes]:
    values = [(reading.type, reading.default_value) for reading in entry.readings]
    return list(dict.fromkeys(kind.encode(value) for kind, value in values if value is not None))


def _list(entries: list[Entry], values: Mapping[Key, bytes]) -> str:
    shown = [f"{entry.address} = {_show(entry, values[entry.key])}" for entry in entries[:5]]
    more = f" and {len(entries) - 5} more" if len(entries) > 5 else ""
    return ", ".join(shown) + more


def _show(entry: Entry, data: bytes) -> str:
    try:
        value = entry.type.decode(data)
    except WireError:
        return data.hex(" ").upper()
    if isinstance(value, int) and entry.type.size == 4 and value > 0xFFFF:
        return f"{value:08X}h"
    return str(value)
