"""What a spec says of the rules between objects must name objects that it has."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

from conformance.spec.behaviours import Slope, Zeroing, named_objects
from conformance.spec.document import EntryDoc, RecordDoc, SpecDocument
from conformance.spec.fields import key_of
from conformance.spec.model import address
from conformance.spec.resolve import Report
from conformance.wire.datatypes import DataType


def lint_behaviours(document: SpecDocument, report: Report) -> None:
    """Report objects and slopes that behaviours or conditions name and no variant has."""
    for name, behaviour in document.behaviours.items():
        for place, named in named_objects(behaviour):
            _expect(named, document, ("behaviours", name, *place), report)
        if isinstance(behaviour, Zeroing):
            for bit, slope in behaviour.slopes.items():
                if not isinstance(document.behaviours.get(slope), Slope):
                    text = f"expected the name of a slope behaviour, got {slope!r}"
                    report(("behaviours", name, "slopes", bit), text)
    for path, entry in _entries(document):
        for number, condition in enumerate(entry.writable_while):
            place = (*path, "writable_while", number, "object")
            _expect(condition.object, document, place, report)


def _expect(
    named: int | str, document: SpecDocument, path: tuple[Hashable, ...], report: Report
) -> None:
    index, sub = key_of(named)
    doc = document.objects.get(index)
    entry = doc.subs.get(sub) if isinstance(doc, RecordDoc) else doc if sub == 0 else None
    if entry is None:
        report(path, f"expected a documented object, got {address(index, sub or None)}")
    elif not DataType[entry.type].is_integer:
        report(
            path, f"expected an integer object, got {entry.type} at {address(index, sub or None)}"
        )


def _entries(document: SpecDocument) -> Iterator[tuple[tuple[Hashable, ...], EntryDoc]]:
    for index, doc in document.objects.items():
        if not isinstance(doc, RecordDoc):
            yield ("objects", index), doc
            continue
        for sub, entry in doc.subs.items():
            yield ("objects", index, "subs", sub), entry
