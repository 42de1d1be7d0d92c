"""A device spec resolved for one variant, node-ID and set of readings; what everything else uses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from conformance.spec.behaviours import Behaviour, Paired, SameValue
from conformance.spec.document import (
    Access,
    Ambiguity,
    DeviceInfo,
    Follows,
    Kind,
    ManualInfo,
    Services,
)
from conformance.spec.fields import key_of
from conformance.wire.datatypes import DataType, Value

StateName: TypeAlias = Literal["pre-operational", "operational", "stopped"]
Key: TypeAlias = tuple[int, int]
Range: TypeAlias = tuple[int, int]
_TEXTS = (DataType.VISIBLE_STRING, DataType.UNICODE_STRING)


def address(index: int, sub: int | None = None) -> str:
    """Return an object's address as the standards print it: ``1017h`` or ``1018h:01``."""
    return f"{index:04X}h" if sub is None else f"{index:04X}h:{sub:02X}"


def is_legal(value: int, ranges: tuple[Range, ...] | None) -> bool:
    """Tell whether a value is inside one of some ranges; None allows all."""
    return ranges is None or any(first <= value <= last for first, last in ranges)


@dataclass(frozen=True, slots=True)
class LimitsBy:
    """Ranges that hold while another entry has a certain value."""

    key: Key
    ranges: Mapping[int, tuple[Range, ...]]
    source: str
    conflict: Literal["kept", "lowered", "refused"] = "kept"


@dataclass(frozen=True, slots=True)
class Condition:
    """What another entry must hold: ``value & mask``."""

    key: Key
    mask: int
    value: int

    def holds(self, value: int) -> bool:
        """Tell whether a value of the other entry satisfies it."""
        return value & self.mask == self.value

    def applied(self, value: int) -> int:
        """Return a value of the other entry with just those bits changed that satisfy it."""
        return value & ~self.mask | self.value


@dataclass(frozen=True, slots=True)
class Entry:
    """One object dictionary entry.

    Args:
        index: 0..FFFFh.
        sub: Sub-index, 0..FFh.
        in_record: The object has sub-indices, so the address is printed with one.
        ranges: Allowed intervals, both ends included; None where the manual gives none.
        values: Documented enumeration: value to meaning.
        octets: Least and greatest length of a string.
        scale: Physical value of one bit, in ``unit``.
        bits: Meaning of each bit.
        mappable: None where the manual says nothing.
        reserved: Listed, but every access must be answered with an abort.
        optional: The manual leaves open whether the entry exists.
        writable_in: NMT states in which a download is allowed; None for all with SDO.
        writable_while: What other entries must hold before a new value is accepted.
        otherwise: What becomes of a new value while that does not hold.
        effective: When the device acts on a new value.
        reads: What an upload returns until a new value takes effect.
        leaves_canopen: Values that take the node off CANopen once they act.
        on_label: The device has a label with what this entry holds.
        after_node_id_change: What a new node-ID makes of a stored value.
        affects: Indices that a download to this command changes.
        follows: What the value shows; for the simulated device.
        source: Section of the manual for the entry.
        sources: Section per attribute, where it differs.
        of_node_id: The default holds the node-ID.
        alternatives: The entry under other readings of an ambiguity judged by either reading.
    """

    index: int
    sub: int
    in_record: bool
    name: str
    type: DataType
    access: Access
    kind: Kind
    default: Value | None = None
    ranges: tuple[Range, ...] | None = None
    values: Mapping[int, str] | None = None
    limits_by: LimitsBy | None = None
    octets: Range | None = None
    unit: str | None = None
    scale: float | None = None
    bits: Mapping[int, str] | None = None
    mappable: bool | None = None
    persistent: bool | None = None
    reserved: bool = False
    optional: bool = False
    writable_in: tuple[StateName, ...] | None = None
    writable_while: tuple[Condition, ...] = ()
    otherwise: Literal["refused", "ignored"] = "refused"
    effective: Literal["at-once", "after-store", "after-store-and-reset"] = "at-once"
    reads: Literal["written", "in-force"] = "written"
    leaves_canopen: tuple[int, ...] = ()
    on_label: bool = False
    after_node_id_change: Literal["kept", "difference-kept", "default"] = "kept"
    affects: tuple[int, ...] = ()
    follows: Follows | None = None
    source: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    of_node_id: bool = False
    alternatives: tuple[Alternative, ...] = ()

    @property
    def key(self) -> Key:
        """Index and sub-index."""
        return self.index, self.sub

    @property
    def address(self) -> str:
        """The address as printed: ``1017h`` or ``1018h:01``."""
        return address(self.index, self.sub if self.in_record else None)

    @property
    def readings(self) -> tuple[Entry, ...]:
        """The entry as judged, then as other readings have it."""
        return (self, *(alternative.entry for alternative in self.alternatives))

    @property
    def readable(self) -> bool:
        """An upload is documented to succeed."""
        return self.access != "wo" and not self.reserved

    @property
    def writable(self) -> bool:
        """A download is documented to succeed."""
        return self.access in ("rw", "wo") and not self.reserved

    def always_legal(self, value: int) -> bool:
        """Tell whether every reading allows a value."""
        return all(is_legal(value, reading.legal) for reading in self.readings)

    def source_of(self, attribute: str) -> str:
        """Return the section that documents one attribute."""
        return self.sources.get(attribute, self.source)

    @property
    def default_value(self) -> Value | None:
        """The default as a value of the type; a spec gives all but integers as text."""
        text = self.default
        if not isinstance(text, str) or self.type in _TEXTS:
            return text
        if self.type in (DataType.REAL32, DataType.REAL64):
            return self.type.decode(self.type.encode(float(text)))
        if self.type is DataType.BOOLEAN:
            return text.lower() in ("1", "true")
        return text.encode("latin-1")

    @property
    def legal(self) -> tuple[Range, ...] | None:
        """The documented intervals, an enumeration counted as one-value intervals."""
        if self.ranges is not None:
            return self.ranges
        if self.values is not None:
            return tuple((value, value) for value in sorted(self.values))
        return None


@dataclass(frozen=True, slots=True)
class Alternative:
    """An entry as another reading of an ambiguity has it."""

    ambiguity: str
    reading: int
    entry: Entry


@dataclass(frozen=True, slots=True)
class OtherServices:
    """The services as another reading of an ambiguity judged by either reading has them."""

    ambiguity: str
    reading: int
    services: Services


@dataclass(frozen=True, slots=True)
class OtherBehaviours:
    """The behaviours as another reading of an ambiguity judged by either reading has them."""

    ambiguity: str
    reading: int
    behaviours: Mapping[str, Behaviour]


@dataclass(frozen=True, slots=True, eq=False)
class DeviceSpec:
    """What a manual says about one variant of a device at one node-ID.

    Args:
        name: Name of the spec: its file's name without the ending.
        variant: Name of the variant.
        node_id: 1..127; expressions in the spec are evaluated with it.
        bitrate: Factory bit rate in bit/s.
        entries: By index and sub-index, in ascending order.
        behaviours: The rules between objects that hold in this variant, by name.
        other_services: The services under other readings of open ambiguities.
        other_behaviours: The behaviours that hold under other readings of open ambiguities.
        readings: Ambiguity id to the reading this spec was resolved with.
        sha256: Hash of the spec file.
    """

    name: str
    device: DeviceInfo
    manual: ManualInfo
    variant: str
    node_id: int
    bitrate: int
    services: Services
    entries: Mapping[Key, Entry]
    ambiguities: tuple[Ambiguity, ...]
    readings: Mapping[str, int]
    sha256: str
    behaviours: Mapping[str, Behaviour] = field(default_factory=dict)
    other_services: tuple[OtherServices, ...] = ()
    other_behaviours: tuple[OtherBehaviours, ...] = ()

    def entry(self, index: int, sub: int = 0) -> Entry | None:
        """Return an entry, or None when the manual has none there."""
        return self.entries.get((index, sub))

    def subs(self, index: int) -> tuple[Entry, ...]:
        """Return all entries of one object, by ascending sub-index."""
        return tuple(entry for key, entry in self.entries.items() if key[0] == index)

    def indices(self) -> tuple[int, ...]:
        """Return every documented index, ascending."""
        return tuple(dict.fromkeys(index for index, _ in self.entries))

    def by_kind(self, *kinds: Kind) -> Iterator[Entry]:
        """Return the entries of some kinds."""
        return (entry for entry in self.entries.values() if entry.kind in kinds)

    def companions(self, key: Key) -> tuple[Key, ...]:
        """Return an entry's key and those of its aliases and of its partner in a pair."""
        keys = {key: None}
        for rule in self.behaviours.values():
            if isinstance(rule, Paired | SameValue):
                named = [key_of(it) for it in rule.objects]
                keys |= dict.fromkeys(named) if key in named else {}
        return tuple(keys)

    def partner(self, key: Key) -> Key | None:
        """Return the other entry of the pair that changes a setting only together, if any."""
        for rule in self.behaviours.values():
            if isinstance(rule, Paired):
                named = [key_of(it) for it in rule.objects]
                if key in named:
                    return named[1 - named.index(key)]
        return None

    @property
    def services_readings(self) -> tuple[tuple[Services, OtherServices | None], ...]:
        """The services as judged, then as other readings have them."""
        return ((self.services, None), *((other.services, other) for other in self.other_services))

    def behaviour_readings(
        self, name: str
    ) -> tuple[tuple[Behaviour | None, OtherBehaviours | None], ...]:
        """A behaviour as judged, then as other readings have it; None where it does not hold."""
        others = ((other.behaviours.get(name), other) for other in self.other_behaviours)
        return ((self.behaviours.get(name), None), *others)

    def cite(self, section: str) -> str:
        """Return a citation: manual, revision and section."""
        return f"{self.manual.name}, {section}"
