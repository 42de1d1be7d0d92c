"""New node-IDs and bit rates: the values to try, and where each reading leads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias

from conformance.bench.node.reach import Place
from conformance.bench.settings.moves import (
    Step,
)
from conformance.effects import Effect
from conformance.requirements import Case, Cases
from conformance.spec.behaviours import Paired, SameValue
from conformance.spec.bit_rates import bits_per_second
from conformance.spec.document import Changeable, Services
from conformance.spec.fields import key_of
from conformance.spec.model import (
    Alternative,
    DeviceSpec,
    Entry,
    Key,
    OtherServices,
    is_legal,
)

Setting: TypeAlias = Literal["node_id", "bitrate"]

_EFFECTS: dict[Setting, Effect] = {"node_id": "node-id", "bitrate": "bitrate"}
_NODE_IDS = (*range(32, 127), *range(1, 32))


@dataclass(frozen=True, slots=True)
class Change:
    """A new node-ID or bit rate.

    Args:
        setting: Which of the two.
        keys: The objects that hold it: aliases and partners included.
        value: As the objects have it.
        figure: The node-ID, or the bit rate in bit/s.
    """

    setting: Setting
    keys: tuple[Key, ...]
    value: int
    figure: int

    def place(self, home: Place) -> Place:
        """Return where it leads."""
        if self.setting == "node_id":
            return Place(self.figure, home.bitrate)
        return Place(home.node_id, self.figure)


def effects(setting: Setting) -> tuple[Effect, ...]:
    """Return what a check of node-ID or bit rate does to the node."""
    return "reads", "writes", "resets", "non-volatile", _EFFECTS[setting]


# Cases


def node_ids(spec: DeviceSpec) -> Iterable[Case]:
    """Return the node-ID object with a node-ID that every reading allows."""
    for entry in _object(spec, "node_id"):
        legal = [it for it in _NODE_IDS if entry.always_legal(it) and it != spec.node_id]
        if legal:
            yield _case(spec, "node_id", entry, entry.address, legal[0], legal[0])


def bit_rates(spec: DeviceSpec) -> Iterable[Case]:
    """Return the bit rate object with each bit rate that every reading documents, but the present."""
    for entry in _object(spec, "bitrate"):
        for value in entry.values or {}:
            figure = bits_per_second(entry, value)
            documented = all(value in (reading.values or {}) for reading in entry.readings)
            if documented and figure != spec.bitrate:
                yield _case(spec, "bitrate", entry, f"{entry.address}/{figure}", value, figure)


def one_bit_rate(spec: DeviceSpec) -> Iterable[Case]:
    """Return the bit rate object with one other bit rate."""
    for case in bit_rates(spec):
        label, _, _ = case.label.partition("/")
        yield Case(label, case.subject, case.section, case.effects)
        return


def halves(setting: Setting) -> Cases:
    """Return cases for each object of a pair, to be written alone."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for case in (node_ids if setting == "node_id" else one_bit_rate)(spec):
            for key in case.subject.keys:
                if any(key in pair for pair in _groups(spec, Paired)):
                    change = Change(setting, (key,), case.subject.value, case.subject.figure)
                    yield Case(spec.entries[key].address, change, case.section, case.effects)

    return generate


def aliases(setting: Setting) -> Cases:
    """Return cases for an object with aliases; the subject names the rule too."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for case in (node_ids if setting == "node_id" else one_bit_rate)(spec):
            for name, rule in spec.behaviours.items():
                keys = (
                    tuple(key_of(it) for it in rule.objects) if isinstance(rule, SameValue) else ()
                )
                if case.subject.keys[0] in keys:
                    change = Change(setting, keys, case.subject.value, case.subject.figure)
                    yield Case(case.label, (name, change), rule.source, case.effects)

    return generate


def held(cases: Cases) -> Cases:
    """Return a case for each object, aliases and partners included, that holds what a case changes."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for case in cases(spec):
            for entry in (spec.entries[key] for key in case.subject.keys):
                if all(reading.readable for reading in entry.readings):
                    yield Case(entry.address, (entry, case.subject), entry.source, case.effects)

    return generate


def _object(spec: DeviceSpec, setting: Setting) -> Iterator[Entry]:
    service: Changeable | None = getattr(spec.services, setting)
    entry = None if service is None else spec.entry(service.object)
    if entry is not None and all(reading.writable for reading in entry.readings):
        yield entry


def _case(
    spec: DeviceSpec, setting: Setting, entry: Entry, label: str, value: int, figure: int
) -> Case:
    service: Changeable = getattr(spec.services, setting)
    change = Change(setting, spec.companions(entry.key), value, figure)
    power: tuple[Effect, ...] = ("power",) if by_power(spec, setting) else ()
    return Case(label, change, service.source, power)


def _groups(spec: DeviceSpec, kind: type[Paired]) -> list[list[Key]]:
    rules = [rule for rule in spec.behaviours.values() if isinstance(rule, kind)]
    return [[key_of(it) for it in rule.objects] for rule in rules]


def useless(change: Change, spec: DeviceSpec) -> list[int]:
    """Return values that stand for no node-ID, or for no bit rate of the manual's."""
    entry = spec.entries[change.keys[0]]
    if change.setting == "node_id":
        tried = [0, 128, 255]
    else:
        tried = [max(entry.values or (0,)) + 1, entry.type.maximum]
    return [value for value in tried if not is_legal(value, entry.legal)]


def disputed(change: Change, spec: DeviceSpec) -> list[int]:
    """Return values that the judged reading allows and another one does not, and that have to wait."""
    entry = spec.entries[change.keys[0]]
    services = (getattr(services, change.setting) for services, _ in spec.services_readings)
    if any(service is not None and service.effective == "at-once" for service in services):
        return []
    return [value for value in entry.values or () if not entry.always_legal(value)]


# Where each reading leads


def by_power(spec: DeviceSpec, setting: Setting) -> bool:
    """Tell whether by some reading only a power cycle puts a new value in force."""
    every: list[Changeable | None] = [getattr(it, setting) for it, _ in spec.services_readings]
    return any(it is not None and it.effective.endswith("power-cycle") for it in every)


def steps(spec: DeviceSpec, setting: Setting, *, save: bool) -> tuple[Step, ...]:
    """Return what is done to put a new value in force, by whichever reading."""
    saving: tuple[Step, ...] = ("store",) if save else ()
    power: tuple[Step, ...] = ("power cycle",) if by_power(spec, setting) else ()
    return "write", *saving, "reset", *power


def allowed(
    spec: DeviceSpec, change: Change, made: tuple[Step, ...], home: Place
) -> dict[tuple[Place, ...], OtherServices | None]:
    """Return where the node may be found after each step, and by which reading."""
    found: dict[tuple[Place, ...], OtherServices | None] = {}
    persistent = all(reading.persistent for reading in spec.entries[change.keys[0]].readings)
    for services, other in spec.services_readings:
        by_itself = persistent and services.store is None
        for places in _places(services, change, made, home, by_itself=by_itself):
            found.setdefault(places, other)
    return found


def _places(
    services: Services, change: Change, made: tuple[Step, ...], home: Place, *, by_itself: bool
) -> Iterator[tuple[Place, ...]]:
    """Return where the node is after each step; ``by_itself``: it keeps a setting without a store."""
    service: Changeable | None = getattr(services, change.setting)
    if service is None:
        return
    to, store = change.place(home), services.store
    stored = (
        "store" in made
        and store is not None
        and any(store.covers(sub, service.object) for sub in store.groups)
    )
    if service.effective == "at-once":
        yield (to,) * len(made)
        if not (stored or by_itself):  # whether it outlives a restart then is not said
            yield to, *(home,) * (len(made) - 1)
        return
    kept = stored or not service.effective.startswith("after-store")
    due: Callable[[Step], bool] = lambda step: (  # noqa: E731 - one line of a rule
        step == "power cycle" or (step == "reset" and not service.effective.endswith("power-cycle"))
    )
    places, here = [], home
    for step in made:
        here = to if kept and due(step) else here
        places.append(here)
    yield tuple(places)


def holds(spec: DeviceSpec, entry: Entry, service: Changeable) -> bool:
    """Tell whether an entry is the object of a service, its partner or an alias."""
    return entry.key in spec.companions((service.object, 0))


def place_at_once(spec: DeviceSpec, entry: Entry, value: int, home: Place) -> Place | None:
    """Return where a value leads at once by some reading, None where it has to wait."""
    places = {
        "node_id": Place(value, home.bitrate),
        "bitrate": Place(home.node_id, bits_per_second(entry, value)),
    }
    for services, _ in spec.services_readings:
        for setting, place in places.items():
            service: Changeable | None = getattr(services, setting)
            at_once = service is not None and service.effective == "at-once"
            if service is not None and at_once and holds(spec, entry, service):
                return place
    return None


# Where a restore leads


def restored(cases: Cases) -> Cases:
    """Return those cases of a new node-ID or bit rate whose documented default a restore brings back."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for case in cases(spec):
            default = spec.entries[case.subject.keys[0]].default
            sub = restoring_sub(spec, case.subject)
            if sub is not None and isinstance(default, int) and default != case.subject.value:
                yield case

    return generate


def restoring_sub(spec: DeviceSpec, change: Change) -> int | None:
    """Return the sub-index of restore that acts on an object by the most readings, None without one."""
    index, restore = change.keys[0][0], spec.services.restore
    every = [services.restore for services, _ in spec.services_readings]
    acting = {
        sub: sum(it is not None and it.covers(sub, index) for it in every)
        for sub in (restore.groups if restore is not None else ())
    }
    return max(acting, key=lambda sub: acting[sub]) if any(acting.values()) else None


def restored_places(
    spec: DeviceSpec, change: Change, sub: int, home: Place
) -> dict[Place, OtherServices | None]:
    """Return where a node may be that was moved and restored, and by which reading.

    A restore that brings one of node-ID and bit rate back may bring the other.
    """
    to = change.place(home)
    found: dict[Place, OtherServices | None] = {}
    for services, other in spec.services_readings:
        node_ids = _restored(spec, services, "node_id", sub) or [to.node_id]
        rates = _restored(spec, services, "bitrate", sub) or [to.bitrate]
        for place in (Place(*it) for it in product(node_ids, rates)):
            found.setdefault(place, other)
    return found


def _restored(spec: DeviceSpec, services: Services, setting: Setting, sub: int) -> list[int]:
    """Return the documented defaults of a node-ID or bit rate that a reading restores."""
    service: Changeable | None = getattr(services, setting)
    entry = None if service is None else spec.entry(service.object)
    restore = services.restore
    if entry is None or restore is None or not restore.covers(sub, entry.index):
        return []
    known = ((it, it.default) for it in entry.readings if isinstance(it.default, int))
    figures = (value if setting == "node_id" else bits_per_second(it, value) for it, value in known)
    return list(dict.fromkeys(figures))


# What follows the node-ID


def followers(spec: DeviceSpec) -> Iterator[Entry]:
    """Return the entries whose default holds the node-ID."""
    for entry in spec.entries.values():
        readings = entry.readings
        if not entry.optional and all(it.readable and it.of_node_id for it in readings):
            yield entry


def own_values(spec: DeviceSpec) -> Iterator[Entry]:
    """Return those of which the manual says what becomes of a stored value of their own."""
    for entry in followers(spec):
        told = any(reading.after_node_id_change != "kept" for reading in entry.readings)
        if told and all(reading.persistent and reading.writable for reading in entry.readings):
            yield entry


def followed(entry: Entry, before: int, change: int) -> dict[int, Alternative | None]:
    """Return what an entry may hold at a node-ID that is higher by ``change``, by which reading."""
    if not change:
        return {before: None}
    found: dict[int, Alternative | None] = {}
    for reading, other in ((entry, None), *((it.entry, it) for it in entry.alternatives)):
        default = int(reading.default or 0)
        if not reading.writable or reading.after_node_id_change == "default":
            found.setdefault(default + change, other)
        elif reading.after_node_id_change == "difference-kept":
            found.setdefault(before + change, other)
        else:
            found.setdefault(before, other)
            if before == default:  # one that was never written may follow
                found.setdefault(default + change, other)
    return found
