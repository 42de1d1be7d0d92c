"""TPDO mapping as several checks need it: what can be mapped, what to try, and how it is judged.

CiA 301 v4.2.0, 7.5.2.38.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.services.mapping import MappingPort, Step, word_of
from conformance.checks.pdo.tpdos import mappable_entries, tpdos
from conformance.checks.steps import tpdo_service
from conformance.errors import NodeTimeout, SetupRefused
from conformance.requirements import CIA301, Case
from conformance.spec.document import Services
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode

MAPPING = f"{CIA301}, 7.5.2.38"
PDO_BITS = 64
NOT_MAPPABLE = (
    AbortCode.OBJECT_NOT_MAPPABLE,
    AbortCode.OBJECT_DOES_NOT_EXIST,
    AbortCode.GENERAL_ERROR,
)
"""For a mapping word that names nothing to be mapped."""
NOT_POSSIBLE = (*NOT_MAPPABLE, AbortCode.PDO_LENGTH_EXCEEDED)
"""For a number of mapped objects that makes no valid mapping."""


class Frame(NamedTuple):
    """A TPDO and what is mapped into it."""

    number: int
    entries: tuple[Entry, ...]


# Cases


def remappable(spec: DeviceSpec) -> Iterable[Case]:
    """Return the TPDOs whose mapping can be written, by their number."""
    tpdo = spec.services.tpdo
    for number in range(1, (tpdo.count if tpdo is not None else 0) + 1):
        places = places_of(spec, number)
        if tpdo is not None and places and _can_map(spec):
            index = tpdo.mapping + number - 1
            yield Case(address(index), number, spec.entries[index, 0].source_of("access"))


def heard(cases: Iterable[Case], spec: DeviceSpec) -> Iterator[Case]:
    """Return the cases of TPDOs that can be made to come."""
    numbers = {case.subject for case in tpdos(spec)}
    return (case for case in cases if case.subject in numbers)


def places_of(spec: DeviceSpec, number: int) -> int:
    """Return how many objects every reading lets be mapped into a TPDO; 0 where it is fixed."""
    tpdo = spec.services.tpdo
    count = tpdo and spec.entry(tpdo.mapping + number - 1)
    if tpdo is None or not count or not count.writable:
        return 0
    most = min(it.tpdo.max_mapped for it, _ in spec.services_readings if it.tpdo is not None)
    places = 0
    while (
        places < most
        and count.always_legal(places + 1)
        and _is_place(spec.entry(count.index, places + 1))
    ):
        places += 1
    return places


def _is_place(entry: Entry | None) -> bool:
    return entry is not None and entry.writable and not entry.optional


def _can_map(spec: DeviceSpec) -> bool:
    return next(iter(mappable(spec)), None) is not None


def mappable(spec: DeviceSpec) -> Iterator[Entry]:
    """Return the entries that can surely be mapped."""
    for entry in spec.entries.values():
        if entry.mappable and all(mappable_entries(it, spec) for it in entry.readings):
            yield entry


def bits_of(entries: Iterable[Entry]) -> int:
    """Return how many bits entries have together."""
    return sum(entry.type.bits or 0 for entry in entries)


def by_size(spec: DeviceSpec) -> list[Entry]:
    """Return the entries that can surely be mapped, the longest first."""
    return sorted(mappable(spec), key=lambda entry: -(entry.type.bits or 0))


def frames(spec: DeviceSpec) -> Iterable[Case]:
    """Return TPDOs with as full a mapping as can be, which together carry every mappable object."""
    for case in heard(remappable(spec), spec):
        for place, entries in enumerate(_full(spec, places_of(spec, case.subject)), start=1):
            frame = Frame(case.subject, tuple(entries))
            yield Case(f"{case.label}/frame-{place}", frame, case.section)


def _full(spec: DeviceSpec, places: int) -> list[list[Entry]]:
    """Share the mappable entries out to as few frames as will do."""
    full: list[list[Entry]] = []
    for entry in by_size(spec):
        for frame in full:
            if len(frame) < places and bits_of((*frame, entry)) <= PDO_BITS:
                frame.append(entry)
                break
        else:
            full.append([entry])
    return full


def pairs(spec: DeviceSpec) -> Iterable[Case]:
    """Return TPDOs with two objects of whole octets that fit, of different length if there are."""
    whole = [entry for entry in by_size(spec) if (entry.type.bits or 0) % 8 == 0]
    if len(whole) < 2:
        return
    first, last = whole[0], whole[-1]
    for case in heard(remappable(spec), spec):
        if places_of(spec, case.subject) > 1 and bits_of((first, last)) <= PDO_BITS:
            yield Case(case.label, Frame(case.subject, (first, last)), case.section)


def small(spec: DeviceSpec, number: int) -> list[Entry]:
    """Return as many short objects as a TPDO has places and room for."""
    chosen: list[Entry] = []
    for entry in by_size(spec)[::-1]:
        if len(chosen) < places_of(spec, number) and bits_of((*chosen, entry)) <= PDO_BITS:
            chosen.append(entry)
    return chosen


def most_mapped(spec: DeviceSpec) -> int:
    """Return the greatest number of mapped objects by any reading."""
    return max(it.tpdo.max_mapped for it, _ in spec.services_readings if it.tpdo is not None)


def has_gaps(spec: DeviceSpec, number: int) -> bool:
    """Tell whether a TPDO as delivered, by any reading, counts an empty mapping entry."""
    tpdo = spec.services.tpdo
    count = tpdo and spec.entry(tpdo.mapping + number - 1)
    if not count:
        return False
    words = [spec.entry(count.index, place) for place in range(1, most_mapped(spec) + 1)]
    used = [word for word in words if word is not None and word.default]
    counts = [reading.default for reading in count.readings]
    return any(isinstance(most, int) and most > len(used) for most in counts)


# Set-up


def first_port(node: Node) -> MappingPort:
    """Return the first TPDO whose mapping can be written."""
    return port_of(node, next(iter(remappable(node.spec))).subject)


def port_of(node: Node, number: int) -> MappingPort:
    """Return the mapping of a TPDO of the node."""
    return MappingPort(node, tpdo_service(node), number)


def is_fixed(port: MappingPort, verdict: Verdict) -> bool:
    """Tell whether the node follows a reading by which the mapping is fixed, and note it."""
    fixed = port.fixed_mapping()
    if fixed is not None:
        verdict.follows(fixed.ambiguity, fixed.reading)
        verdict.holds("mapping", expected="writable, or fixed", actual="fixed", ok=True)
    return fixed is not None


def refusal(node: Node, port: MappingPort, words: Sequence[int], count: int | None = None) -> Step:
    """Offer a mapping to be refused, then one that is not; return the last step of the first.

    Raises:
        SetupRefused: The other is not taken either, so that nothing can be told from a refusal.
        NodeTimeout: The node does not answer.
    """
    port.open()
    step = port.offer(words, count)[-1]
    require_answered(step)
    if step.counts:
        node.download(port.mapping_index, 0, 0)
    node.download(port.mapping_index, 1, word_of(by_size(node.spec)[-1]))
    return step


def require_answered(step: Step) -> None:
    """Make sure that a step was answered at all.

    Raises:
        NodeTimeout: It was not.
    """
    if not step.answer.answered:
        raise NodeTimeout(f"{step.what}: {step.answer}")


def require_confirmed(steps: Sequence[Step]) -> None:
    """Make sure that a mapping that can be made was taken; for set-up.

    Raises:
        SetupRefused: It was not.
    """
    for step in steps:
        if not step.answer.confirmed:
            raise SetupRefused(f"{step.what}: {step.answer}, see TPDO-33")


def other_words(spec: DeviceSpec, number: int, present: list[int]) -> list[int]:
    """Return a mapping of as many objects as can be, not the present one if there is another."""
    every = [[word_of(it) for it in frame] for frame in _full(spec, places_of(spec, number))]
    return max([words for words in every if words != present] or every, key=len)


# Judgements


def judge_confirmed(verdict: Verdict, steps: Sequence[Step]) -> None:
    """Judge that each step of a procedure was confirmed."""
    for step in steps:
        answer = step.answer
        verdict.holds(step.what, expected="confirmed", actual=str(answer), ok=answer.confirmed)


def shown(words: Sequence[int]) -> str:
    """Return mapping words in print."""
    return ", ".join(f"{word:08X}h" for word in words) or "nothing"


def judge_refused(verdict: Verdict, step: Step) -> None:
    """Judge that a mapping was refused, by whatever abort."""
    verdict.holds(step.what, expected="an abort", actual=str(step.answer), ok=step.answer.refused)


def judge_code(verdict: Verdict, what: str, answer: Transfer, codes: Collection[AbortCode]) -> None:
    """Judge that a download was refused by one of some aborts."""
    expected = " or ".join(f"{code >> 16:04X} {code & 0xFFFF:04X}h" for code in codes)
    verdict.holds(
        what,
        expected=f"abort {expected}",
        actual=str(answer),
        ok=answer.abort in codes,
    )


def judge_step_code(verdict: Verdict, step: Step) -> None:
    """Judge that a step was refused because an object is not to be mapped, or the mapping not possible."""
    codes = NOT_POSSIBLE if step.counts else NOT_MAPPABLE
    judge_code(verdict, step.what, step.answer, codes)


def require_refused(step: Step, see: str) -> None:
    """Make sure that there is an abort whose code can be judged.

    Raises:
        SetupRefused: There is none; another requirement judges that.
    """
    if not step.answer.refused:
        raise SetupRefused(f"{step.what}: {step.answer}, see {see}")


def judge_by_reading(
    spec: DeviceSpec,
    verdict: Verdict,
    quantity: str,
    actual: str,
    wanted: Callable[[Services], str],
) -> bool:
    """Judge that something is as any reading of the services has it, and note which one."""
    readings = {wanted(services): other for services, other in spec.services_readings[::-1]}
    followed = readings.get(actual)
    if followed is not None:
        verdict.follows(followed.ambiguity, followed.reading)
    expected = " or ".join(sorted(readings))
    return verdict.holds(quantity, expected=expected, actual=actual, ok=actual in readings)


def outcome(answer: Transfer) -> str:
    """Return what became of a download in a word."""
    return "confirmed" if answer.confirmed else "refused" if answer.refused else "not answered"
