"""TPDO mapping: what must not be mapped, and how it is refused (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.services.mapping import MappingPort, Step, word_of
from conformance.bench.session import Bench
from conformance.checks import cases
from conformance.checks.pdo import mapping
from conformance.checks.pdo.mapping import (
    MAPPING,
    NOT_MAPPABLE,
    NOT_POSSIBLE,
    PDO_BITS,
    Frame,
    bits_of,
    by_size,
    places_of,
)
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode
from conformance.wire.pdo import MappingEntry

NO_SUCH_SUB = (*NOT_MAPPABLE, AbortCode.SUB_INDEX_DOES_NOT_EXIST)
NO_INDEX = 0xC000
"""No device has it (CiA 301 v4.2.0, 7.4.1)."""


def _can_map(spec: DeviceSpec) -> bool:
    return next(iter(mapping.remappable(spec)), None) is not None


def _excluded(spec: DeviceSpec) -> Iterable[Case]:
    """Return the entries that by every reading cannot be mapped."""
    for entry in spec.entries.values() if _can_map(spec) else ():
        if all(reading.mappable is False for reading in entry.readings):
            yield Case(entry.address, entry, entry.source_of("mappable"))


def _excluded_of_fixed_length(spec: DeviceSpec) -> Iterable[Case]:
    for case in _excluded(spec):
        if case.subject.type.bits is not None and cases.same_type(case.subject):
            yield case


def _word(entry: Entry) -> int:
    """Return the mapping word of an entry, that of a text with the octets it has at most."""
    octets = entry.octets[1] if entry.octets is not None else 1
    bits = entry.type.bits or min(8 * octets, PDO_BITS)
    return MappingEntry(entry.index, entry.sub, bits).to_word()


def _offered(bench: Bench, node: Node, port: MappingPort, entry: Entry, verdict: Verdict) -> Step:
    """Return what became of an excluded object's mapping word, offered once in a run."""
    observe = partial(mapping.refusal, node, port, [_word(entry)])
    seen = bench.observations.once(f"{entry.address} offered for mapping", Step, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


@requirement(
    "TPDO-40",
    level="manual",
    cases=("entry", _excluded),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_excluded_object_is_not_mapped(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """An object that the manual excludes from mapping cannot be mapped into a TPDO."""
    port = mapping.first_port(node)
    if mapping.is_fixed(port, verdict):
        return

    step = _offered(bench, node, port, entry, verdict)

    mapping.judge_refused(verdict, step)


@requirement(
    "TPDO-41",
    level="shall",
    cases=("entry", _excluded_of_fixed_length),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_excluded_object_has_its_abort_code(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """The abort of an object that is not mapped says that it cannot be, or does not exist."""
    port = mapping.first_port(node)
    if mapping.is_fixed(port, verdict):
        return

    step = _offered(bench, node, port, entry, verdict)

    mapping.require_refused(step, "TPDO-40")
    mapping.judge_step_code(verdict, step)


def _no_index(spec: DeviceSpec) -> Iterable[Case]:
    if _can_map(spec) and NO_INDEX not in spec.indices():
        yield Case(address(NO_INDEX), MappingEntry(NO_INDEX, 0, 8).to_word(), "")


@requirement(
    "TPDO-42",
    level="shall",
    cases=("word", _no_index),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_missing_object_is_not_mapped(node: Node, word: int, verdict: Verdict) -> None:
    """An object that does not exist cannot be mapped, and the abort says so."""
    port = mapping.first_port(node)
    if mapping.is_fixed(port, verdict):
        return

    step = mapping.refusal(node, port, [word])

    mapping.judge_step_code(verdict, step)


def _no_sub_index(spec: DeviceSpec) -> Iterable[Case]:
    """Return the sub-index behind the last one of the first object that can be mapped."""
    for entry in by_size(spec)[:1] if _can_map(spec) else ():
        counts = [reading.default for reading in spec.subs(entry.index)[0].readings]
        claimed = [count for count in counts if isinstance(count, int) and entry.in_record]
        sub = max(0, *(it.sub for it in spec.subs(entry.index)), *claimed) + 1
        if sub < 0xFF:
            word = MappingEntry(entry.index, sub, entry.type.bits or 0).to_word()
            yield Case(address(entry.index, sub), word, entry.source)


@requirement(
    "TPDO-43",
    level="shall",
    cases=("word", _no_sub_index),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_missing_sub_index_is_not_mapped(node: Node, word: int, verdict: Verdict) -> None:
    """A sub-index that does not exist cannot be mapped, and the abort says so."""
    port = mapping.first_port(node)
    if mapping.is_fixed(port, verdict):
        return

    step = mapping.refusal(node, port, [word])

    codes = (*NOT_POSSIBLE, AbortCode.SUB_INDEX_DOES_NOT_EXIST)
    mapping.judge_code(verdict, step.what, step.answer, codes if step.counts else NO_SUCH_SUB)


def _shorter_than_a_pdo(spec: DeviceSpec) -> Iterable[Case]:
    for entry in by_size(spec) if _can_map(spec) else ():
        if bits_of([entry]) + 8 <= PDO_BITS:
            yield Case(entry.address, entry, entry.source_of("mappable"))


@requirement(
    "TPDO-44",
    level="should",
    cases=("entry", _shorter_than_a_pdo),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_object_is_not_mapped_longer(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An object cannot be mapped with more bits than it has."""
    port = mapping.first_port(node)
    if mapping.is_fixed(port, verdict):
        return

    step = mapping.refusal(node, port, [word_of(entry) + 8])

    mapping.judge_refused(verdict, step)


def _too_long(spec: DeviceSpec) -> Iterable[Case]:
    """Return TPDOs with just more mapped objects than have room."""
    for case in mapping.remappable(spec):
        chosen: list[Entry] = []
        for entry in by_size(spec):
            if bits_of((*chosen, entry)) <= PDO_BITS:
                chosen.append(entry)
        del chosen[places_of(spec, case.subject) - 1 :]
        more = (it for it in by_size(spec)[::-1] if it not in chosen)
        last = next((it for it in more if bits_of((*chosen, it)) > PDO_BITS), None)
        if last is not None:
            yield Case(case.label, Frame(case.subject, (*chosen, last)), case.section)


@requirement(
    "TPDO-45",
    level="shall",
    cases=("frame", _too_long),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_mapping_of_more_than_64_bits_is_refused(
    node: Node, frame: Frame, verdict: Verdict
) -> None:
    """Objects of more than 64 bits together cannot be mapped, and the abort says so."""
    port = mapping.port_of(node, frame.number)
    if mapping.is_fixed(port, verdict):
        return

    step = mapping.refusal(node, port, [word_of(entry) for entry in frame.entries])

    mapping.judge_code(verdict, step.what, step.answer, NOT_POSSIBLE)


@requirement(
    "TPDO-46",
    level="shall",
    cases=("number", mapping.remappable),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_more_objects_than_places_are_refused(node: Node, number: int, verdict: Verdict) -> None:
    """The number of mapped objects is refused above the greatest that the TPDO may have."""
    port = mapping.port_of(node, number)
    if mapping.is_fixed(port, verdict):
        return
    words = [word_of(entry) for entry in mapping.small(node.spec, number)]

    step = mapping.refusal(node, port, words, mapping.most_mapped(node.spec) + 1)

    mapping.judge_refused(verdict, step)


def _without_gaps(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs that as delivered, by any reading, count no empty mapping entry."""
    for case in mapping.remappable(spec):
        if places_of(spec, case.subject) > 1 and not mapping.has_gaps(spec, case.subject):
            yield case


@requirement(
    "TPDO-47",
    level="should",
    cases=("number", _without_gaps),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_number_counts_no_empty_entry(node: Node, number: int, verdict: Verdict) -> None:
    """The number of mapped objects is refused while it counts an entry that names nothing."""
    port = mapping.port_of(node, number)
    if mapping.is_fixed(port, verdict):
        return

    step = mapping.refusal(node, port, [word_of(by_size(node.spec)[-1]), 0])

    mapping.judge_refused(verdict, step)
