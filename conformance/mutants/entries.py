"""Defects of single entries: every figure of the object dictionary, a little different."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, get_args

from conformance.checks.cases import accelerations
from conformance.mutants.defect import Defect, change, path, without
from conformance.spec.behaviours import named_objects
from conformance.spec.document import Access, EntryDoc, Follows, ObjectDoc, RecordDoc
from conformance.spec.fields import key_of
from conformance.spec.load import SpecFile
from conformance.spec.model import DeviceSpec, Entry, Range, StateName
from conformance.wire.datatypes import DataType

OTHER_LENGTHS = {8: (16,), 16: (8, 32), 32: (16,)}
"""Bits of an integer, and those of the types it is mistaken for; 32 for any other."""

OTHER_SOURCES: dict[Follows, Follows] = {
    "tilt-x": "tilt-y",
    "tilt-y": "tilt-x",
    "acceleration-x": "acceleration-y",
    "acceleration-y": "acceleration-z",
    "acceleration-z": "acceleration-x",
    "rate-x": "rate-y",
    "rate-y": "rate-z",
    "rate-z": "rate-x",
    "temperature": "supply-voltage",
}
"""What a measured entry shows by mistake instead."""

SEEN_BY = {
    "missing": ("OD-", "EMCY-", "DEV-"),
    "default": ("OD-", "RST-", "NID-", "BIT-", "STO-", "EMCY-", "TPDO-"),
    "type": ("OD-", "EMCY-", "STO-", "RST-", "DEV-"),
    "access": ("OD-", "EMCY-", "STO-", "RST-", "DEV-", "TPDO-"),
    "ranges": ("OD-", "TPDO-", "NID-"),
    "values": ("OD-", "DEV-", "BIT-"),
    "limits_by": ("OD-", "DEV-"),
    "mappable": ("TPDO-",),
    "persistent": ("STO-", "BOOT-", "NID-", "BIT-", "DEV-34", "DEV-40"),
    "reserved": ("OD-",),
    "octets": ("OD-",),
    "writable_in": ("OD-",),
    "writable_while": ("DEV-",),
    "otherwise": ("DEV-",),
    "effective": ("DEV-", "TPDO-", "EMCY-", "SYNC-", "HB-"),
    "reads": ("DEV-", "NID-", "BIT-"),
    "after_node_id_change": ("NID-",),
    "follows": ("DEV-", "EMCY-", "OD-"),
    "scale": ("DEV-",),
    "affects": ("DEV-",),
    "extra": ("OD-", "EMCY-15"),
}
"""Beginnings of the requirements that a kind of figure is judged by."""


def entry_defects(file: SpecFile, spec: DeviceSpec) -> Iterator[Defect]:
    """Return a defect for every figure of every entry of a variant.

    Names, units and meanings of values and bits are no figures: no bus carries them.

    Args:
        file: The device spec.
        spec: It, resolved for the variant.
    """
    for entry in spec.entries.values():
        doc = file.document.objects.get(entry.index)
        if doc is not None and not entry.optional:
            yield from _Entry(entry, doc, _related(spec, entry.index)).defects()
    for index in spec.indices():
        yield from _extra_sub(spec, index)


class _Entry:
    """The defects of one entry.

    Args:
        entry: The entry.
        doc: Its object in the file.
        related: Indices that a behaviour ties to it.
    """

    def __init__(self, entry: Entry, doc: ObjectDoc, related: tuple[int, ...]) -> None:
        self._entry = entry
        self._related = related
        self._place = path(
            "objects", entry.index, *(("subs", entry.sub) if entry.in_record else ())
        )
        one = doc.subs[entry.sub] if isinstance(doc, RecordDoc) else doc
        self._doc: EntryDoc = one

    def _made(self, attribute: str, value: Any, short: str, what: str, knob: str = "") -> Defect:
        return Defect(
            id=f"{self._entry.address}/{attribute}={short}"
            if short
            else f"{self._entry.address}/{attribute}",
            what=f"{self._entry.address}: {what}",
            faults=(change(f"{self._place}/{knob or attribute}", value),),
            attribute=attribute,
            area="objects",
            key=self._entry.key,
            related=self._related,
            seen_by=SEEN_BY[attribute],
        )

    def defects(self) -> Iterator[Defect]:
        """Return them all; what is reserved has no figure but that."""
        if self._entry.reserved:
            yield self._made("reserved", value=False, short="", what="can be accessed")
            return
        yield self._made("missing", [], "", "does not exist", "variants")
        yield from self._default()
        yield from self._type()
        yield from self._access()
        yield from self._ranges()
        yield from self._values()
        yield from self._limits_by()
        yield from self._flags()
        yield from self._octets()
        yield from self._conditions()
        yield from self._choices()

    def _default(self) -> Iterator[Defect]:
        entry, own = self._entry, self._entry.default
        if entry.kind in ("live", "counter"):
            return
        if entry.type is DataType.VISIBLE_STRING and isinstance(own, str):
            yield self._made("default", f"{own}~", f"{own}~", "another default")
        elif entry.type.is_integer and isinstance(own, int):
            near = [value for value in _near(own) if value != own and _fits(entry.type, value)]
            value = next((it for it in near if entry.always_legal(it)), near[0])
            what = f"default {value} instead of {own}"
            yield self._made("default", value, str(value), what)

    def _type(self) -> Iterator[Defect]:
        kind, default = self._entry.type, self._entry.default
        if not kind.is_integer:
            return
        sign = "UNSIGNED" if kind.name.startswith("U") else "INTEGER"
        for bits in OTHER_LENGTHS.get(kind.bits or 0, (32,)):
            name = f"{sign}{bits}"
            made = self._made("type", name, name, f"{name} instead of {kind.name}")
            other = DataType[name]
            if isinstance(default, int) and not _fits(other, default):
                cut = change(f"{self._place}/default", default & other.maximum)
                made = replace(made, faults=(*made.faults, cut))
            yield made

    def _access(self) -> Iterator[Defect]:
        own = self._entry.access
        for other in get_args(Access):
            if other != own and {own, other} != {"ro", "const"} and other != "const":
                yield self._made("access", other, other, f"{other} instead of {own}")

    def _ranges(self) -> Iterator[Defect]:
        entry = self._entry
        if not entry.type.is_integer or not entry.writable or entry.kind == "command":
            return
        for ranges, short, what in _other_ranges(entry.ranges or (), entry.type):
            yield self._range(ranges, short, what)

    def _range(self, ranges: list[Range], short: str, what: str) -> Defect:
        return self._made("ranges", [list(it) for it in ranges], short, what)

    def _values(self) -> Iterator[Defect]:
        entry = self._entry
        if entry.values is None or not entry.writable or entry.ranges is not None:
            return
        for value in entry.values:
            if len(entry.values) > 1:
                rest = without(entry.values, value)
                yield self._made("values", rest, f"{value} missing", f"{value} is refused")
        extra = next(
            (v for v in _near(max(entry.values)) if v not in entry.values and _fits(entry.type, v)),
            None,
        )
        if extra is not None:
            more = {**entry.values, extra: "undocumented"}
            yield self._made("values", more, f"{extra} too", f"{extra} is accepted")

    def _limits_by(self) -> Iterator[Defect]:
        limits = self._entry.limits_by
        if limits is None:
            return
        for value, known in limits.ranges.items():
            for ranges, short, what in _other_ranges(known, self._entry.type):
                yield self._made(
                    "limits_by",
                    [list(it) for it in ranges],
                    f"{value}: {short}",
                    f"{what} with {value} in {limits.key[0]:04X}h",
                    f"limits_by/ranges/{value}",
                )
        for conflict in ("kept", "lowered", "refused"):
            if conflict != limits.conflict:
                what = f"a value not allowed any more is {conflict}"
                yield self._made("limits_by", conflict, conflict, what, "limits_by/conflict")

    def _flags(self) -> Iterator[Defect]:
        if self._entry.mappable is not None:
            other = not self._entry.mappable
            yield self._made(
                "mappable", other, "", "can be mapped" if other else "cannot be mapped"
            )
        if self._entry.persistent is not None and self._entry.kind == "config":
            other = not self._entry.persistent
            yield self._made("persistent", other, "", "is stored" if other else "is not stored")

    def _octets(self) -> Iterator[Defect]:
        if self._entry.octets is None or not self._entry.writable:
            return
        low, high = self._entry.octets
        for octets in ([low + 1, high], [low, high - 1], [low, high + 1], [low - 1, high]):
            if 0 <= octets[0] <= octets[1]:
                yield self._made(
                    "octets",
                    octets,
                    f"{octets[0]}..{octets[1]}",
                    f"takes {octets[0]} to {octets[1]} octets",
                )

    def _conditions(self) -> Iterator[Defect]:
        entry = self._entry
        if entry.writable_in is not None:
            yield self._made("writable_in", None, "any", "can be written in every state")
            for state in entry.writable_in:
                rest: list[StateName] = [it for it in entry.writable_in if it != state]
                if rest:
                    yield self._made(
                        "writable_in", rest, f"not {state}", f"cannot be written in {state}"
                    )
        for number, condition in enumerate(self._doc.writable_while):
            rest_ = [
                it.model_dump() for n, it in enumerate(self._doc.writable_while) if n != number
            ]
            yield self._made(
                "writable_while",
                rest_,
                f"not {condition.object}",
                f"does not look at {condition.object}",
            )

    def _choices(self) -> Iterator[Defect]:
        """Return the other choices of what the file names."""
        others = {
            "otherwise": ("refused", "ignored"),
            "effective": ("at-once", "after-store", "after-store-and-reset"),
            "reads": ("written", "in-force"),
            "after_node_id_change": ("kept", "difference-kept", "default"),
        }
        for attribute, choices in others.items():
            if attribute not in self._doc.model_fields_set:
                continue
            own = getattr(self._entry, attribute)
            for choice in choices:
                if own is not None and choice != own:
                    yield self._made(
                        attribute,
                        choice,
                        choice,
                        f"{attribute.replace('_', ' ')}: {choice} instead of {own}",
                    )
        if self._entry.follows is not None and self._entry.kind == "live":
            choice = OTHER_SOURCES.get(self._entry.follows, "temperature")
            yield self._made("follows", choice, choice, f"shows {choice}")
        if self._doc.scale is not None and self._entry.follows is not None:
            yield self._made(
                "scale", self._doc.scale * 1.25, "", "one bit stands for a quarter more"
            )
        if self._doc.affects:
            yield self._made("affects", [], "", "changes nothing")


def _related(spec: DeviceSpec, index: int) -> tuple[int, ...]:
    indices: dict[int, None] = {}
    for behaviour in spec.behaviours.values():
        named = [key_of(it)[0] for _, it in named_objects(behaviour)]
        indices |= dict.fromkeys(named if index in named else ())
    for x, y, z in accelerations(spec):
        named = [x.index, y.index, z.index]
        indices |= dict.fromkeys(named if index in named else ())
    return tuple(indices)


def _extra_sub(spec: DeviceSpec, index: int) -> Iterator[Defect]:
    subs = spec.subs(index)
    if subs[0].in_record and (extra := subs[-1].sub + 1) < 0xFF:
        entry = {"name": "Undocumented", "type": "UNSIGNED8", "access": "ro", "kind": "live"}
        yield Defect(
            id=f"{index:04X}h/sub-index {extra:02X} too",
            what=f"{index:04X}h has a sub-index {extra:02X}h",
            faults=(change(path("objects", index, "subs", extra), entry),),
            attribute="extra",
            area="objects",
            key=(index, 0),
            seen_by=SEEN_BY["extra"],
        )


def _other_ranges(
    ranges: tuple[Range, ...], kind: DataType
) -> Iterator[tuple[list[Range], str, str]]:
    """Return ranges with one edge moved by one, either way, and the words for it."""

    def inside(value: int) -> bool:
        return not _fits(kind, value) or any(low <= value <= high for low, high in ranges)

    for n, (low, high) in enumerate(ranges):
        before, after = list(ranges[:n]), list(ranges[n + 1 :])
        if low < high:
            yield [*before, (low + 1, high), *after], f"{low} refused", f"{low} is refused"
            yield [*before, (low, high - 1), *after], f"{high} refused", f"{high} is refused"
        elif len(ranges) > 1:
            yield [*before, *after], f"{low} refused", f"{low} is refused"
        if not inside(low - 1):
            yield (
                [*before, (low - 1, high), *after],
                f"{low - 1} accepted",
                f"{low - 1} is accepted",
            )
        if not inside(high + 1):
            yield (
                [*before, (low, high + 1), *after],
                f"{high + 1} accepted",
                f"{high + 1} is accepted",
            )


def _near(value: int) -> tuple[int, ...]:
    return (value + 1, value - 1, value + 2, value ^ 1, value + 10, 0, 1, 2, 3)


def _fits(kind: DataType, value: int) -> bool:
    return kind.minimum <= value <= kind.maximum
