"""What a spec says of its services must fit its objects: addresses, groups, mapping words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from conformance.spec.document import Changeable, Services, Store, Tpdo
from conformance.spec.fields import key_of
from conformance.spec.lint import Mistakes, entry_path, interval_mistakes
from conformance.spec.model import Entry, Key, address
from conformance.spec.resolve import Report
from conformance.wire.pdo import MappingEntry

_MOST_PDO_BITS = 64
_WITH_OBJECT = ("start_by", "manufacturer_code", "on_error", "byte_order")
_MOST_WORD = 0xFFFF_FFFF


def lint_services(entries: Mapping[Key, Entry], services: Services, report: Report) -> None:
    """Report every service that contradicts itself or names an object the spec does not have.

    Args:
        entries: All entries of one variant.
        services: The services.
        report: Called with path and sentence.
    """
    for path, text in (*_object_mistakes(entries, services), *_store_mistakes(services)):
        report(("services", *path), text)
    for name, service in (("store", services.store), ("restore", services.restore)):
        if service is not None:
            for path, text in _group_mistakes(entries, service):
                report(("services", name, *path), text)
    heartbeat = services.heartbeat_producer
    if heartbeat is not None and heartbeat.min_ms > heartbeat.max_ms:
        text = f"expected at most max_ms ({heartbeat.max_ms}), got {heartbeat.min_ms}"
        report(("services", "heartbeat_producer", "min_ms"), text)
    if services.tpdo is not None:
        for path, text in _tpdo_mistakes(entries, services.tpdo):
            report(("services", "tpdo", *path), text)
        for number in range(services.tpdo.count):
            _lint_mapping(services.tpdo.mapping + number, entries, report)


def _object_mistakes(entries: Mapping[Key, Entry], services: Services) -> Mistakes:
    for name in type(services).model_fields:
        service = getattr(services, name)
        for attribute in ("object", "error_register", "history", "inhibit"):
            index = getattr(service, attribute, None)
            if index is not None and (index, 0) not in entries:
                yield (name, attribute), f"expected a documented object, got {address(index)}"
        for attribute in _WITH_OBJECT:
            named = getattr(getattr(service, attribute, None), "object", None)
            if named is not None and key_of(named) not in entries:
                index, sub = key_of(named)
                got = address(index, sub or None)
                yield (name, attribute, "object"), f"expected a documented object, got {got}"


def _store_mistakes(services: Services) -> Mistakes:
    for name in ("node_id", "bitrate"):
        service: Changeable | None = getattr(services, name)
        waits = service is not None and service.effective.startswith("after-store")
        if service is not None and waits and services.store is None:
            text = f"expected a moment without a store, as there is no such service, got {service.effective}"
            yield (name, "effective"), text


def _group_mistakes(entries: Mapping[Key, Entry], service: Store) -> Mistakes:
    for sub, ranges in service.groups.items():
        if (service.object, 0) in entries and (service.object, sub) not in entries:
            got = address(service.object, sub)
            yield ("groups", sub), f"expected a documented sub-index, got {got}"
        pairs = [(low, high) for low, high in ranges]
        for text in interval_mistakes(pairs, 0, 0xFFFF, "indices"):
            yield ("groups", sub), text


def _tpdo_mistakes(entries: Mapping[Key, Entry], tpdo: Tpdo) -> Mistakes:
    pairs = [(low, high) for low, high in tpdo.transmission_types]
    for text in interval_mistakes(pairs, 0, 0xFF, "transmission types"):
        yield ("transmission_types",), text
    for attribute, base in (("communication", tpdo.communication), ("mapping", tpdo.mapping)):
        missing = [base + n for n in range(tpdo.count) if (base + n, 0) not in entries]
        if missing:
            first, last = address(missing[0]), address(missing[-1])
            got = first if first == last else f"{first} to {last}"
            yield (attribute,), f"expected {tpdo.count} documented objects, got none for {got}"


def _lint_mapping(index: int, entries: Mapping[Key, Entry], report: Report) -> None:
    """Report the default mapping words of one TPDO that cannot be mapped."""
    count = entries[index, 0].default if (index, 0) in entries else None
    most = count if isinstance(count, int) else 0xFF
    bits = 0
    for sub in range(1, min(most, 0xFF) + 1):
        entry = entries.get((index, sub))
        word = None if entry is None else entry.default
        if entry is None or not isinstance(word, int) or not 0 < word <= _MOST_WORD:
            continue
        path = (*entry_path(entry), "default")
        for text in _word_mistakes(word, entries):
            report(path, text)
        before, bits = bits, bits + MappingEntry.from_word(word).bits
        if before <= _MOST_PDO_BITS < bits:
            report(path, f"expected at most {_MOST_PDO_BITS} mapped bits, got {bits}")


def _word_mistakes(word: int, entries: Mapping[Key, Entry]) -> Iterator[str]:
    mapped = MappingEntry.from_word(word)
    target = entries.get((mapped.index, mapped.sub))
    place = f"{address(mapped.index, mapped.sub)} in mapping word {word:08X}h"
    if target is None:
        yield f"expected a documented object, got {place}"
    elif target.mappable is False:
        yield f"expected a mappable object, got {place}"
    elif target.type.bits is None:
        yield f"expected an object of fixed length, got {target.type.name} at {place}"
    elif target.type.bits != mapped.bits:
        wanted = f"{target.type.bits} bits for {target.type.name}"
        yield f"expected {wanted}, got {mapped.bits} for {place}"
