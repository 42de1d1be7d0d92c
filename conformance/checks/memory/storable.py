"""Which settings a store keeps and a restore brings back, by every reading of the manual."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache

from conformance.bench.node.keeping import groups_of
from conformance.bench.settings.second_values import can_be_set
from conformance.effects import Effect
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases
from conformance.spec.document import Services, Store
from conformance.spec.model import Alternative, DeviceSpec, Entry, OtherServices, address

STORES: tuple[Effect, ...] = ("reads", "writes", "resets", "non-volatile")
RESTORES: tuple[Effect, ...] = (*STORES, "restores")
Other = Alternative | OtherServices


@lru_cache(maxsize=8)
def stored_settings(spec: DeviceSpec) -> tuple[Case, ...]:
    """Return every setting that a store keeps by every reading."""
    return tuple(
        Case(entry.address, entry, entry.source_of("persistent"))
        for entry in spec.entries.values()
        if all(reading.persistent for reading in entry.readings)
        if can_be_set(entry, spec) and _always_in(spec, "store", None, entry)
    )


def stored_defaults(spec: DeviceSpec) -> Iterable[Case]:
    """Return those of them that have a documented default."""
    return (case for case in stored_settings(spec) if case.subject.default is not None)


def late_settings(spec: DeviceSpec) -> Iterable[Case]:
    """Return every setting that a store keeps by every reading and that may read as before until then."""
    for entry in spec.entries.values():
        documented = all(reading.persistent for reading in entry.readings)
        late = {reading.reads for reading in entry.readings} == {"written", "in-force"}
        if documented and late and _always_in(spec, "store", None, entry) and late_values(entry):
            yield Case(entry.address, entry, entry.source_of("persistent"))


def late_restored_settings(spec: DeviceSpec) -> Iterable[Case]:
    """Return those of them that the widest restore brings back by every reading."""
    for case in late_settings(spec) if spec.services.restore else ():
        if _always_in(spec, "restore", widest_restore(spec), case.subject):
            yield Case(case.label, case.subject, case.subject.source_of("default"))


def late_values(entry: Entry) -> list[int]:
    """Return the values of an enumeration that every reading allows and none has as its default."""
    defaults = {reading.default for reading in entry.readings}
    return [it for it in entry.values or () if entry.always_legal(it) and it not in defaults]


def disputed_settings(spec: DeviceSpec) -> Iterable[Case]:
    """Return every setting that a store keeps by some readings alone."""
    for entry in spec.entries.values():
        if can_be_set(entry, spec) and {kept for kept, _ in keeping(spec, entry)} == {True, False}:
            yield Case(entry.address, entry, entry.source_of("persistent"))


def keeping(spec: DeviceSpec, entry: Entry) -> Iterator[tuple[bool, Other | None]]:
    """Return whether a store keeps a setting, as judged and by every reading that says otherwise."""
    stored = _is_in(spec.services, "store", None, entry)
    yield stored and entry.persistent is not False, None
    for alternative in entry.alternatives:
        yield stored and alternative.entry.persistent is not False, alternative
    for other in spec.other_services:
        covered = _is_in(other.services, "store", None, entry)
        yield covered and entry.persistent is not False, other


def restored_settings(spec: DeviceSpec) -> Iterable[Case]:
    """Return every setting with a documented default that the widest restore brings back."""
    if spec.services.restore is not None:
        for entry in settings_in(spec, widest_restore(spec)):
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
    return (case for case in restore_groups(spec) if any(settings_beside(spec, case.subject)))


def later_restores(spec: DeviceSpec) -> Iterable[Case]:
    """Return every restore sub-index that as judged does not act before the node restarts."""
    restore = spec.services.restore
    return restore_groups(spec) if restore and restore.effective != "at-once" else ()


def restore_at_once(spec: DeviceSpec) -> OtherServices | None:
    """Return the reading by which a restore acts at once, if there is one."""
    for other in spec.other_services:
        restore = other.services.restore
        if restore is not None and restore.effective == "at-once":
            return other
    return None


def passing_restores(spec: DeviceSpec) -> Iterable[Case]:
    """Return the widest restore, where by every reading it does not outlast a second start."""
    every = [it.restore for it, _ in spec.services_readings]
    if all(it is not None and it.lasting is False for it in every):
        wide = widest_restore(spec)
        yield from (case for case in restore_groups(spec) if case.subject == wide)


def readable_signatures(name: str) -> Cases:
    """Return cases for every sub-index of a service that can be read by every reading."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        service: Store | None = getattr(spec.services, name)
        for sub in service.groups if service is not None else ():
            entry = spec.entry(service.object, sub) if service is not None else None
            if entry is not None and all(reading.readable for reading in entry.readings):
                yield Case(entry.address, entry, entry.source)

    return generate


def documented_signatures(name: str) -> Cases:
    """Return those cases whose value every reading of the manual tells."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for case in readable_signatures(name)(spec):
            entry: Entry = case.subject
            if all(isinstance(reading.default, int) for reading in entry.readings):
                yield Case(case.label, entry, entry.source_of("default"))

    return generate


def answers(entry: Entry) -> list[int]:
    """Return the values that the readings have an entry answer with."""
    return list(dict.fromkeys(it.default for it in entry.readings if isinstance(it.default, int)))


@lru_cache(maxsize=8)
def restore_of(spec: DeviceSpec) -> Store:
    """Return the restore service.

    Raises:
        SetupRefused: There is none.
    """
    if spec.services.restore is None:
        raise SetupRefused("the manual documents no restore")
    return spec.services.restore


def widest_restore(spec: DeviceSpec) -> int:
    """Return the sub-index of restore that acts on the most objects.

    Raises:
        SetupRefused: There is no restore.
    """
    return groups_of(restore_of(spec), {index for index, _ in spec.entries})[0]


@lru_cache(maxsize=64)
def settings_in(spec: DeviceSpec, sub: int) -> tuple[Entry, ...]:
    """Return the settings with a default that a restore sub-index brings back by every reading."""
    return tuple(
        entry
        for entry in spec.entries.values()
        if all(reading.default is not None for reading in entry.readings)
        if can_be_set(entry, spec) and _always_in(spec, "restore", sub, entry)
    )


def settings_beside(spec: DeviceSpec, sub: int) -> Iterator[Entry]:
    """Return the stored settings that a restore sub-index leaves alone by every reading."""
    for case in stored_settings(spec):
        services = [it.restore for it, _ in spec.services_readings]
        if not any(it is not None and it.covers(sub, case.subject.index) for it in services):
            yield case.subject


def _always_in(spec: DeviceSpec, name: str, sub: int | None, entry: Entry) -> bool:
    return all(_is_in(services, name, sub, entry) for services, _ in spec.services_readings)


def _is_in(services: Services, name: str, sub: int | None, entry: Entry) -> bool:
    service: Store | None = getattr(services, name)
    if service is None:
        return False
    subs = service.groups if sub is None else {sub} & set(service.groups)
    return any(service.covers(each, entry.index) for each in subs)
