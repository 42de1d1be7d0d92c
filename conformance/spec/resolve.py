"""From the document to the resolved spec: variants chosen, expressions evaluated, readings applied."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar, cast

from conformance.spec.document import (
    Ambiguity,
    EntryDoc,
    RecordDoc,
    SpecDocument,
)
from conformance.spec.expressions import ExpressionError, evaluate
from conformance.spec.fields import key_of, of_variant, shape
from conformance.spec.model import Alternative, Condition, Entry, Key, LimitsBy, Range
from conformance.spec.yaml_reader import Path_
from conformance.wire.datatypes import DataType, Value

T = TypeVar("T")
Report = Callable[[Path_, str], None]


def chosen_readings(
    ambiguities: list[Ambiguity], asked: Mapping[str, int] | None = None
) -> dict[str, int]:
    """Return the 1-based reading in force per ambiguity: the one asked for, judged, or first."""
    chosen = {a.id: 1 if isinstance(a.judged_by, str) else a.judged_by for a in ambiguities}
    chosen.update(asked or {})
    return chosen


@dataclass(slots=True)
class EntryResolver:
    """Builds entries for one variant and node-ID.

    Args:
        variant: Name of the variant.
        node_id: 1..127.
        report: Called with the path in the file and ``expected …, got …`` for each mistake.
    """

    variant: str
    node_id: int
    report: Report
    path: Path_ = field(default=(), init=False)

    def entries(self, document: SpecDocument) -> dict[Key, Entry]:
        """Return every entry of the variant, ascending."""
        return {
            entry.key: entry
            for index in sorted(document.objects)
            for entry in self.object(document, index)
        }

    def object(self, document: SpecDocument, index: int) -> Iterator[Entry]:
        """Return the entries of one object, ascending."""
        doc = document.objects[index]
        if doc.variants is not None and self.variant not in doc.variants:
            return
        if not isinstance(doc, RecordDoc):
            yield self._entry(doc, index, 0, doc.source, ("objects", index))
            return
        for sub, sub_doc in sorted(doc.subs.items()):
            if sub_doc.variants is None or self.variant in sub_doc.variants:
                yield self._entry(sub_doc, index, sub, doc.source, ("objects", index, "subs", sub))

    def _entry(self, doc: EntryDoc, index: int, sub: int, source: str, path: Path_) -> Entry:
        self.path = path
        kind = DataType[doc.type]
        values = self._of_variant(doc.values, "values")
        return Entry(
            index=index,
            sub=sub,
            in_record="subs" in path,
            name=doc.name,
            type=kind,
            access=doc.access,
            kind=doc.kind,
            default=self._default(doc, kind),
            ranges=self._ranges(self._of_variant(doc.ranges, "ranges"), "ranges"),
            values=None if values is None else dict(sorted(values.items())),
            limits_by=self._limits_by(doc),
            octets=None if doc.octets is None else (doc.octets[0], doc.octets[1]),
            unit=doc.unit,
            scale=doc.scale,
            bits=doc.bits,
            mappable=doc.mappable,
            persistent=doc.persistent,
            reserved=doc.reserved,
            optional=doc.optional,
            writable_in=None if doc.writable_in is None else tuple(doc.writable_in),
            writable_while=tuple(
                Condition(key_of(it.object), it.mask, it.value) for it in doc.writable_while
            ),
            otherwise=doc.otherwise,
            effective=doc.effective,
            reads=doc.reads,
            leaves_canopen=tuple(doc.leaves_canopen),
            on_label=doc.on_label,
            after_node_id_change=doc.after_node_id_change,
            affects=tuple(doc.affects),
            follows=of_variant(doc.follows, self.variant),
            source=doc.source or source,
            sources=dict(doc.sources),
            of_node_id="NODEID" in str(self._of_variant(doc.default, "default")).upper(),
        )

    def _of_variant(self, value: T | dict[str, T] | None, attribute: str) -> T | None:
        by_variant = shape(value) == "by_variant"
        if not by_variant or not isinstance(value, dict):
            return cast("T | None", value)
        if self.variant not in value:
            text = f"expected a value for variant {self.variant!r}, got nothing"
            self.report((*self.path, attribute), text)
        return value.get(self.variant)

    def _default(self, doc: EntryDoc, kind: DataType) -> Value | None:
        value = cast("int | str | None", self._of_variant(doc.default, "default"))
        if value is None or not kind.is_integer:
            if isinstance(value, int):
                text = f"expected a text (in quotes) for {doc.type}, got {value}"
                self.report((*self.path, "default"), text)
                return None
            return value
        return self._integer(value, "default")

    def _integer(self, value: int | str, *place: Hashable) -> int:
        if isinstance(value, int):
            return value
        try:
            return evaluate(value, self.node_id)
        except ExpressionError as error:
            self.report((*self.path, *place), str(error))
            return 0

    def _ranges(
        self, ranges: list[list[int | str]] | None, *place: Hashable
    ) -> tuple[Range, ...] | None:
        if ranges is None:
            return None
        return tuple(
            (self._integer(low, *place), self._integer(high, *place)) for low, high in ranges
        )

    def _limits_by(self, doc: EntryDoc) -> LimitsBy | None:
        if doc.limits_by is None:
            return None
        ranges = {
            value: self._ranges(limits, "limits_by", "ranges", value) or ()
            for value, limits in doc.limits_by.ranges.items()
        }
        limits = doc.limits_by
        return LimitsBy(key_of(limits.object), ranges, limits.source, limits.conflict)


def with_alternatives(
    entries: dict[Key, Entry], others: list[tuple[str, int, list[int], dict[Key, Entry]]]
) -> dict[Key, Entry]:
    """Return the entries, each with what other readings make of it.

    An entry that one reading has and another has not is optional.

    Args:
        entries: As judged.
        others: Ambiguity, number of the reading, indices it touches, and their entries under it.
    """
    result = dict(entries)
    for ambiguity, reading, indices, others_entries in others:
        for key, base in entries.items():
            if key[0] not in indices:
                continue
            other = others_entries.get(key)
            known = result[key]
            if other is None:
                result[key] = replace(known, optional=True)
            elif other != base:
                more = Alternative(ambiguity, reading, other)
                result[key] = replace(known, alternatives=(*known.alternatives, more))
        for key, other in others_entries.items():
            result.setdefault(key, replace(other, optional=True))
    return dict(sorted(result.items()))
