"""What a spec says must hold together: defaults in their ranges, sub-index 0, mapping words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from conformance.spec.document import Ambiguity, Services, SpecDocument
from conformance.spec.model import Entry, Key, address, is_legal
from conformance.spec.resolve import Report, apply_changes, parse_path
from conformance.spec.yaml_reader import Path_
from conformance.wire.pdo import MappingEntry

_MOST_PDO_BITS = 64


def entry_path(entry: Entry) -> Path_:
    """Return where an entry stands in the file."""
    top: Path_ = ("objects", entry.index)
    return (*top, "subs", entry.sub) if entry.in_record else top


def lint_entries(
    some: Mapping[Key, Entry],
    entries: Mapping[Key, Entry],
    document: SpecDocument,
    report: Report,
) -> None:
    """Report each of some entries that contradicts itself or its neighbours among all entries."""
    doubted = set(_doubted(document.ambiguities))
    for entry in some.values():
        path = entry_path(entry)
        for attribute, text in _own_mistakes(entry):
            report((*path, attribute), text)
        for text in _limits_mistakes(entry, entries):
            report((*path, "limits_by"), text)
    for index in dict.fromkeys(index for index, _ in some):
        _lint_highest_sub(index, entries, doubted, report)
    _lint_mapping(entries, document.services, report)


def _own_mistakes(entry: Entry) -> Iterator[tuple[str, str]]:
    if entry.type.is_integer:
        yield from _integer_mistakes(entry)
    elif entry.ranges is not None or entry.values is not None:
        yield "ranges", f"expected no ranges or values for {entry.type.name}, got some"
    elif isinstance(entry.default, str) and entry.octets is not None:
        low, high = entry.octets
        if not low <= len(entry.default) <= high:
            yield "default", f"expected {low} to {high} octets, got {len(entry.default)}"


def _integer_mistakes(entry: Entry) -> Iterator[tuple[str, str]]:
    low, high = entry.type.minimum, entry.type.maximum
    inside = f"expected {low} to {high} for {entry.type.name}"
    for first, last in entry.ranges or ():
        if first > last:
            yield "ranges", f"expected the lower end first, got {first} to {last}"
        if first < low or last > high:
            yield "ranges", f"{inside}, got {first} to {last}"
    for value in entry.values or ():
        if not low <= value <= high:
            yield "values", f"{inside}, got {value}"
    if not isinstance(entry.default, int):
        return
    if not low <= entry.default <= high:
        yield "default", f"{inside}, got {entry.default}"
    elif entry.kind == "config" and not is_legal(entry.default, entry.legal):
        ranges = entry.legal or ()
        wanted = ", ".join(f"{a}" if a == b else f"{a} to {b}" for a, b in ranges)
        yield "default", f"expected a value in its range ({wanted}), got {entry.default}"


def _limits_mistakes(entry: Entry, entries: Mapping[Key, Entry]) -> Iterator[str]:
    if entry.limits_by is not None and entry.limits_by.key not in entries:
        yield f"expected a documented object, got {address(*entry.limits_by.key)}"


def _doubted(ambiguities: list[Ambiguity]) -> Iterator[Path_]:
    """Return the paths that the manual itself contradicts."""
    for ambiguity in ambiguities:
        for reading in ambiguity.readings:
            yield from (parse_path(text) for text in reading.changes)


def _lint_highest_sub(
    index: int, entries: Mapping[Key, Entry], doubted: set[Path_], report: Report
) -> None:
    subs = [entry for key, entry in entries.items() if key[0] == index]
    first = subs[0]
    if not first.in_record:
        return
    path = ("objects", index, "subs")
    if first.sub != 0:
        report(path, "expected sub-index 0, got none")
        return
    highest = max(entry.sub for entry in subs)
    counts_something_else = first.access == "rw"
    if counts_something_else or (*path, 0, "default") in doubted:
        return
    if first.default != highest:
        report(
            (*path, 0, "default"),
            f"expected {highest}, the highest sub-index listed, got {first.default!r}",
        )


def _lint_mapping(entries: Mapping[Key, Entry], services: Services, report: Report) -> None:
    tpdo = services.tpdo
    if tpdo is None:
        return
    for number in range(tpdo.count):
        for base in (tpdo.communication, tpdo.mapping):
            if (base + number, 0) not in entries:
                report(("services", "tpdo"), f"expected object {address(base + number)}, got none")
        bits = 0
        for (index, sub), entry in entries.items():
            if index != tpdo.mapping + number or sub == 0 or not isinstance(entry.default, int):
                continue
            bits += MappingEntry.from_word(entry.default).bits
            for text in _word_mistakes(entry.default, entries):
                report((*entry_path(entry), "default"), text)
            if bits > _MOST_PDO_BITS:
                report(
                    (*entry_path(entry), "default"),
                    f"expected at most {_MOST_PDO_BITS} mapped bits, got {bits}",
                )


def _word_mistakes(word: int, entries: Mapping[Key, Entry]) -> Iterator[str]:
    if word == 0:
        return
    mapped = MappingEntry.from_word(word)
    target = entries.get((mapped.index, mapped.sub))
    place = f"{address(mapped.index, mapped.sub)} in mapping word {word:08X}h"
    if target is None:
        yield f"expected a documented object, got {place}"
    elif target.mappable is False:
        yield f"expected a mappable object, got {place}"
    elif target.type.bits != mapped.bits:
        yield f"expected {target.type.bits} bits for {target.type.name}, got {mapped.bits} for {place}"


def lint_services(entries: Mapping[Key, Entry], services: Services, report: Report) -> None:
    """Report every service that names an object the spec does not have."""
    for name in type(services).model_fields:
        index = getattr(getattr(services, name), "object", None)
        if index is not None and (index, 0) not in entries:
            report(
                ("services", name, "object"), f"expected a documented object, got {address(index)}"
            )
    heartbeat = services.heartbeat_producer
    if heartbeat is not None and heartbeat.min_ms > heartbeat.max_ms:
        report(
            ("services", "heartbeat_producer", "min_ms"),
            f"expected at most max_ms ({heartbeat.max_ms}), got {heartbeat.min_ms}",
        )


def lint_document(document: SpecDocument, data: object, report: Report) -> None:
    """Report what is wrong whatever the variant: names of variants, ambiguities."""
    for index, doc in document.objects.items():
        _lint_variant_names(doc.variants, ("objects", index), document, report)
        for sub, sub_doc in getattr(doc, "subs", {}).items():
            _lint_variant_names(sub_doc.variants, ("objects", index, "subs", sub), document, report)
    seen: set[str] = set()
    for number, ambiguity in enumerate(document.ambiguities):
        path = ("ambiguities", number)
        if ambiguity.id in seen:
            report((*path, "id"), f"expected each id once, got {ambiguity.id} again")
        seen.add(ambiguity.id)
        judged = ambiguity.judged_by
        if isinstance(judged, int) and not 1 <= judged <= len(ambiguity.readings):
            report(
                (*path, "judged_by"),
                f"expected 'either' or 1 to {len(ambiguity.readings)}, got {judged}",
            )
        for place, reading in enumerate(ambiguity.readings):
            try:
                apply_changes(data, reading.changes)
            except KeyError as error:
                report(
                    (*path, "readings", place, "changes"),
                    f"expected a path in this file, got {error.args[0]!r}",
                )


def _lint_variant_names(
    names: list[str] | None, path: Path_, document: SpecDocument, report: Report
) -> None:
    for name in names or ():
        if name not in document.variants:
            known = ", ".join(document.variants)
            report((*path, "variants"), f"expected a variant of this file ({known}), got {name!r}")
