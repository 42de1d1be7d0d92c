"""Which entries of a spec a rule applies to, and the figures to try on each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from conformance.effects import Effect
from conformance.requirements import Case, Cases
from conformance.spec.document import Changeable, Services
from conformance.spec.model import DeviceSpec, Entry, Range, is_legal
from conformance.wire.abort import AbortCode

STATES = {"pre-operational", "operational", "stopped"}
_MOVING: dict[str, Effect] = {"node_id": "node-id", "bitrate": "bitrate"}


def entries(
    which: Callable[[Entry, DeviceSpec], bool], attribute: str = "access"
) -> tuple[str, Cases]:
    """Return cases for every entry that ``which`` picks, cited by one attribute's source.

    An entry that an ambiguity leaves open either way is picked only if every reading agrees.
    """

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for entry in spec.entries.values():
            if all(which(reading, spec) for reading in entry.readings):
                yield Case(entry.address, entry, entry.source_of(attribute), reach(entry, spec))

    return "entry", generate


def with_heartbeat(cases: Cases) -> Cases:
    """Return cases of a rule on the NMT state: none without a heartbeat in each, by which it is seen."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        producer = spec.services.heartbeat_producer
        return cases(spec) if producer is not None and set(producer.states) >= STATES else ()

    return generate


def neighbours(node_id: int) -> list[int]:
    """Return the node-IDs next to one, round the end of the range."""
    return sorted({node_id % 127 + 1, (node_id - 2) % 127 + 1})


def reach(entry: Entry, spec: DeviceSpec) -> tuple[Effect, ...]:
    """Return what a download to an entry does beyond changing its value until the next reset.

    A command may keep what it did for good: whether it does is mostly not documented.
    """
    for service, effect in _MOVING.items():
        moved: Changeable | None = getattr(spec.services, service)
        if moved is not None and entry.key in spec.companions((moved.object, 0)):
            return (effect, "resets", "non-volatile")
    return ("non-volatile",) if entry.affects else ()


def moves_the_node(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether a download to an entry may change the node-ID or bit rate at once."""
    return bool({"node-id", "bitrate"} & set(reach(entry, spec)))


def service_objects(services: Services) -> set[int]:
    """Return the objects that store and restore parameters."""
    return {s.object for s in (services.store, services.restore) if s is not None}


def is_pdo_object(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether an entry is a TPDO's communication or mapping parameter."""
    tpdo = spec.services.tpdo
    if tpdo is None:
        return False
    return any(
        base <= entry.index < base + tpdo.count for base in (tpdo.communication, tpdo.mapping)
    )


def is_mapping(entry: Entry, spec: DeviceSpec) -> bool:
    """Tell whether an entry is a TPDO's mapping parameter."""
    tpdo = spec.services.tpdo
    return tpdo is not None and tpdo.mapping <= entry.index < tpdo.mapping + tpdo.count


def present(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what the manual says exists."""
    del spec
    return not entry.optional and not entry.reserved


def is_history(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick the entries of the error history: without an error they need not hold anything."""
    emcy = spec.services.emcy_producer
    return emcy is not None and entry.index == emcy.history and entry.sub > 0


def readable(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what an upload must be able to read."""
    return present(entry, spec) and entry.readable and not is_history(entry, spec)


def writable(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what accepts its own value without any further effect.

    The number of mapped objects is left out: a factory setting may count empty mapping entries, and
    a node may refuse to be told so.
    """
    counts_mapping = is_mapping(entry, spec) and entry.sub == 0
    is_setting = entry.access == "rw" and entry.kind == "config" and not counts_mapping
    return present(entry, spec) and is_setting


def read_only(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what no download may change."""
    return readable(entry, spec) and entry.access in ("ro", "const")


def write_only(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what no upload may read."""
    return present(entry, spec) and entry.access == "wo"


def fixed(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what has one documented value that nothing changes."""
    return (
        readable(entry, spec)
        and entry.default is not None
        and (entry.kind in ("identity", "constant"))
    )


def configured(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what has a documented factory setting."""
    return readable(entry, spec) and entry.default is not None and entry.kind == "config"


def limited(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what has a documented range or enumeration and can be put back afterwards."""
    restorable = entry.kind == "config" or (entry.kind == "command" and bool(entry.affects))
    return (
        present(entry, spec)
        and entry.writable
        and entry.type.is_integer
        and (entry.legal is not None or entry.limits_by is not None)
        and restorable
        and not is_mapping(entry, spec)
        and entry.index not in service_objects(spec.services)
    )


@dataclass(frozen=True, slots=True)
class Limits:
    """Ranges of an entry, for those that depend on another one at one of its values.

    Args:
        setting: The other entry's value; None where there is no other.
        ranges: As judged.
        readings: As every reading has them, the judged one included.
    """

    setting: int | None
    ranges: tuple[Range, ...]
    readings: tuple[tuple[Range, ...] | None, ...]


def limits(entry: Entry) -> list[Limits]:
    """Return an entry's ranges, one set per value of the entry they depend on."""
    if entry.limits_by is None:
        readings = tuple(reading.legal for reading in entry.readings)
        return [Limits(None, entry.legal or (), readings)]
    return [
        Limits(setting, ranges, tuple(_limits_at(reading, setting) for reading in entry.readings))
        for setting, ranges in entry.limits_by.ranges.items()
    ]


def _limits_at(entry: Entry, setting: int) -> tuple[Range, ...] | None:
    if entry.limits_by is None:
        return entry.legal
    return entry.limits_by.ranges.get(setting, entry.legal)


def legal_values(limit: Limits) -> list[int]:
    """Return both edges of every range that are legal under every reading, ascending."""
    edges = {edge for interval in limit.ranges for edge in interval}
    return sorted(
        edge for edge in edges if all(is_legal(edge, ranges) for ranges in limit.readings)
    )


def illegal_values(entry: Entry, limit: Limits) -> list[int]:
    """Return values just outside every range and the type's extremes, illegal in every reading."""
    low, high = entry.type.minimum, entry.type.maximum
    near = {value for first, last in limit.ranges for value in (first - 1, last + 1)}
    return sorted(
        value
        for value in near | {low, high}
        if low <= value <= high and not any(is_legal(value, ranges) for ranges in limit.readings)
    )


def has_illegal_values(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what has a range narrower than its type."""
    return limited(entry, spec) and any(illegal_values(entry, limit) for limit in limits(entry))


def accelerations(spec: DeviceSpec) -> Iterator[tuple[Entry, Entry, Entry]]:
    """Return the accelerations along X, Y and Z that belong together."""
    along = [
        [
            entry
            for entry in spec.entries.values()
            if entry.follows == f"acceleration-{axis}" and readable(entry, spec)
        ]
        for axis in "xyz"
    ]
    yield from zip(*along, strict=False)


def same_type(entry: Entry) -> bool:
    """Tell whether every reading gives the entry the same type."""
    return {reading.type for reading in entry.readings} == {entry.type}


REFUSED_WRITE = (
    AbortCode.UNSUPPORTED_ACCESS,
    AbortCode.WRITE_OF_READ_ONLY,
    AbortCode.GENERAL_ERROR,
)
REFUSED_READ = (
    AbortCode.UNSUPPORTED_ACCESS,
    AbortCode.READ_OF_WRITE_ONLY,
    AbortCode.GENERAL_ERROR,
)
OUT_OF_RANGE = (
    AbortCode.INVALID_VALUE,
    AbortCode.VALUE_TOO_HIGH,
    AbortCode.VALUE_TOO_LOW,
    AbortCode.GENERAL_ERROR,
)
WRONG_LENGTH = (
    AbortCode.LENGTH_MISMATCH,
    AbortCode.LENGTH_TOO_HIGH,
    AbortCode.LENGTH_TOO_LOW,
    AbortCode.GENERAL_ERROR,
)
NO_OBJECT = (AbortCode.OBJECT_DOES_NOT_EXIST, AbortCode.GENERAL_ERROR)
NO_SUB_INDEX = (AbortCode.SUB_INDEX_DOES_NOT_EXIST, AbortCode.GENERAL_ERROR)
