"""TPDO mapping: what can be mapped, how, and that the TPDO carries it (CiA 301 v4.2.0, 7.5.2.38)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.services.mapping import MappingPort, word_of
from conformance.checks.dictionary.held import Held, held, judge_content
from conformance.checks.limits import gap_tolerance_ms
from conformance.checks.pdo import mapping
from conformance.checks.pdo.mapping import MAPPING, Frame
from conformance.checks.pdo.tpdos import listen, paced
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.model import Alternative, DeviceSpec, Entry, address
from conformance.spec.services import MappingExample
from conformance.verdict import Verdict
from conformance.wire.pdo import MappingEntry

PERIODS = 5


def _sent(node: Node, port: MappingPort, number: int, mapped: Sequence[Entry] = ()) -> bytes:
    """Let a TPDO come and return what it carries; what settings change is to be read after that.

    Raises:
        SetupRefused: It does not come.
    """
    pace = paced(node, number)
    port.configure(pace.transmission_type, event_ms=pace.event_ms, mapped=mapped)
    port.start()
    return _first(listen(node, port, pace))


def _first(seen: Sequence[Stamped]) -> bytes:
    """Return what the first of some TPDOs carries.

    Raises:
        SetupRefused: There is none.
    """
    if not seen:
        raise SetupRefused("the TPDO does not come, see TPDO-01")
    return seen[0].frame.data


@requirement(
    "TPDO-30",
    level="manual",
    cases=("frame", mapping.frames),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_every_mappable_object_is_carried(node: Node, frame: Frame, verdict: Verdict) -> None:
    """Each TPDO carries every mappable object, in frames as full as they can be."""
    port = mapping.port_of(node, frame.number)
    if mapping.is_fixed(port, verdict):
        return

    data = _sent(node, port, frame.number, frame.entries)

    judge_content(node.spec, verdict, data, [held(node, entry) for entry in frame.entries])


def _single(spec: DeviceSpec) -> Iterable[Case]:
    numbers = [case.subject for case in mapping.heard(mapping.remappable(spec), spec)]
    for entry in mapping.mappable(spec) if 1 in numbers else ():
        yield Case(entry.address, entry, entry.source_of("mappable"))


@requirement(
    "TPDO-31",
    level="manual",
    cases=("entry", _single),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_object_mapped_alone_is_carried(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A TPDO to which one object alone is mapped has the length and the value of that object."""
    port = mapping.port_of(node, 1)
    if mapping.is_fixed(port, verdict):
        return

    data = _sent(node, port, 1, [entry])

    judge_content(node.spec, verdict, data, [held(node, entry)])


def _disputed(spec: DeviceSpec) -> Iterable[Case]:
    """Return the objects of which the readings leave open whether, or how long, they are mapped."""
    numbers = [case.subject for case in mapping.heard(mapping.remappable(spec), spec)]
    sure = {entry.key for entry in mapping.mappable(spec)}
    for entry in spec.entries.values() if 1 in numbers else ():
        if _wanted(entry) and entry.key not in sure and not entry.optional:
            yield Case(entry.address, entry, entry.source_of("mappable"))


def _readings(entry: Entry) -> list[tuple[Entry, Alternative | None]]:
    return [(entry, None), *((other.entry, other) for other in entry.alternatives)]


def _wanted(entry: Entry) -> list[tuple[Entry, Alternative | None]]:
    """Return an entry as each reading has it by which it is mapped."""
    every = _readings(entry)
    return [(it, other) for it, other in every if it.mappable and it.readable and it.type.bits]


@requirement(
    "TPDO-66",
    level="manual",
    cases=("entry", _disputed),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_object_of_disputed_mapping_is_carried_or_refused(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """An object of which readings leave open whether or how long it is mapped is carried, or refused."""
    port = mapping.port_of(node, 1)
    if mapping.is_fixed(port, verdict):
        return

    words = {word_of(it): (it, other) for it, other in _wanted(entry)[::-1]}
    for word, (reading, other) in sorted(words.items()):
        port.open()
        step = port.offer([word])[-1]
        if step.answer.confirmed:
            data = _sent(node, port, 1)
            judge_content(node.spec, verdict, data, [held(node, reading)])
            if other is not None:
                verdict.follows(other.ambiguity, other.reading)
            return
        mapping.require_answered(step)

    refusing = [other for it, other in _readings(entry) if it.mappable is not True]
    verdict.holds(
        f"mapping of {entry.address}",
        expected="confirmed, or refused" if refusing else "confirmed",
        actual="refused",
        ok=bool(refusing),
    )
    if refusing and refusing[0] is not None:
        verdict.follows(refusing[0].ambiguity, refusing[0].reading)


@requirement(
    "TPDO-32",
    level="shall",
    cases=("frame", mapping.pairs),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_objects_that_count_are_carried(node: Node, frame: Frame, verdict: Verdict) -> None:
    """With the number of mapped objects at n a TPDO carries the first n of its mapping."""
    port = mapping.port_of(node, frame.number)
    if mapping.is_fixed(port, verdict):
        return
    port.open()
    mapping.require_confirmed(port.offer([word_of(entry) for entry in frame.entries], 1))

    data = _sent(node, port, frame.number)

    judge_content(node.spec, verdict, data, [held(node, frame.entries[0])])


@requirement(
    "TPDO-33",
    level="manual",
    cases=("number", mapping.remappable),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_mapping_procedure_is_confirmed(node: Node, number: int, verdict: Verdict) -> None:
    """Each step of the mapping procedure is confirmed, and the mapping is read back as written."""
    port = mapping.port_of(node, number)
    if mapping.is_fixed(port, verdict):
        return
    words = mapping.other_words(node.spec, number, port.words())

    steps = port.remap(words)

    mapping.judge_confirmed(verdict, steps)
    verdict.equal("mapping as read back", port.words(), words, show=mapping.shown)


def _examples(spec: DeviceSpec) -> Iterable[Case]:
    tpdo = spec.services.tpdo
    for example in tpdo.examples if tpdo is not None else ():
        label = address((tpdo.mapping if tpdo is not None else 0) + example.tpdo - 1)
        yield Case(f"{label}/example-{example.words[0]:08X}h", example, example.source)


@requirement(
    "TPDO-34",
    level="manual",
    cases=("example", _examples),
    source=MAPPING,
    effects=("reads", "writes"),
)
def test_mapping_example_is_sent(node: Node, example: MappingExample, verdict: Verdict) -> None:
    """A mapping that the manual shows makes the TPDO carry these objects at the time it shows."""
    port = mapping.port_of(node, example.tpdo)
    port.configure(paced(node, example.tpdo).transmission_type, event_ms=example.event_ms)

    steps = port.remap(example.words)
    port.start()
    seen = port.collect(PERIODS + 2, (PERIODS + 3) * example.event_ms / 1000)

    mapping.judge_confirmed(verdict, steps)
    judge_content(node.spec, verdict, _first(seen), [_named(node, word) for word in example.words])
    gaps_ms = port.gaps_ms(seen[1:], example.event_ms)
    verdict.within(
        "TPDO period", gaps_ms, example.event_ms, gap_tolerance_ms(example.event_ms), unit="ms"
    )


def _named(node: Node, word: int) -> Held:
    mapped = MappingEntry.from_word(word)
    return held(node, node.spec.entries[mapped.index, mapped.sub])


def _mapped_tpdos(spec: DeviceSpec) -> Iterable[Case]:
    tpdo = spec.services.tpdo
    for number in range(1, (tpdo.count if tpdo is not None else 0) + 1):
        count = tpdo and spec.entry(tpdo.mapping + number - 1)
        if count and not count.optional:
            yield Case(address(count.index), number, count.source)


@requirement("TPDO-35", level="shall", cases=("number", _mapped_tpdos), source=MAPPING)
def test_mapping_names_objects_there_are(node: Node, number: int, verdict: Verdict) -> None:
    """Every mapping entry that counts names an object of the device with its length, or nothing."""
    port = mapping.port_of(node, number)

    words = port.words()

    named = {word_of(entry) for entry in node.spec.entries.values() if entry.type.bits}
    unknown = [word for word in words if word and word not in named]
    verdict.equal("mapping entries that name no documented object", unknown, [], show=mapping.shown)
