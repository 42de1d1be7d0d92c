"""Object dictionary where a manual leaves something open: the device follows one of its readings.

CiA 301 v4.2.0, 7.2.4.3.17 (abort codes), 7.4 (object dictionary).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.session import Bench
from conformance.bench.settings.second_values import is_cob_id
from conformance.checks import cases
from conformance.checks.place.moved import tried
from conformance.checks.steps import make_writable, own_value, require_writable
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases, requirement
from conformance.spec.model import Alternative, DeviceSpec, Entry, is_legal
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode, describe

MISSING = (AbortCode.OBJECT_DOES_NOT_EXIST, AbortCode.SUB_INDEX_DOES_NOT_EXIST)


def _disputed(which: Callable[[Entry, DeviceSpec], bool], attribute: str) -> tuple[str, Cases]:
    """Return cases for every entry that ``which`` picks by one reading and not by another."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        for entry in spec.entries.values():
            picked = {which(reading, spec) for reading in entry.readings}
            if picked == {True, False}:
                source = entry.source_of(attribute)
                yield Case(entry.address, entry, source, cases.reach(entry, spec))

    return "entry", generate


def _judge_answer(
    verdict: Verdict, what: str, transfer: Transfer, taken: str, codes: Collection[AbortCode]
) -> None:
    """Judge that a transfer was carried out, or refused with one of some codes."""
    verdict.holds(
        what,
        expected=f"{taken} or {' or '.join(describe(code) for code in codes)}",
        actual=str(transfer),
        ok=transfer.confirmed or transfer.abort in codes,
    )


def _follow(verdict: Verdict, entry: Entry, agrees: Callable[[Entry], bool]) -> None:
    """Note the first reading that agrees with what was seen, unless it is the judged one."""
    if agrees(entry):
        return
    for other in entry.alternatives:
        if agrees(other.entry):
            verdict.follows(other.ambiguity, other.reading)
            return


def _optional(spec: DeviceSpec) -> Iterable[Case]:
    for entry in spec.entries.values():
        if entry.optional and not entry.reserved:
            yield Case(entry.address, entry, entry.source)


@requirement("OD-19", level="manual", cases=("entry", _optional))
def test_optional_entry_is_there_or_not(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An entry whose existence the manual leaves open answers an upload, or does not exist."""
    transfer = node.sdo.upload(*entry.key)

    codes = (*MISSING, *(cases.REFUSED_READ if entry.access == "wo" else ()))
    _judge_answer(verdict, f"upload of {entry.address}", transfer, "a value", codes)


def _read(entry: Entry, spec: DeviceSpec) -> bool:
    del spec
    return entry.readable


@requirement("OD-20", level="manual", cases=_disputed(_read, "access"))
def test_entry_of_disputed_access_is_read_or_refused(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """An entry that is write-only or reserved by some readings is uploaded, or refused as such."""
    transfer = node.sdo.upload(*entry.key)
    if transfer.abort in MISSING:
        raise SetupRefused(f"{entry.address} does not exist, see OD-01")

    what = f"upload of {entry.address}"
    _judge_answer(verdict, what, transfer, "a value", cases.REFUSED_READ)
    _follow(verdict, entry, lambda it: it.readable == transfer.confirmed)


def _write_cases(spec: DeviceSpec) -> Iterable[Case]:
    _, generate = _disputed(cases.writable, "access")
    for case in generate(spec):
        entry: Entry = case.subject
        ways = (cases.writable(it, spec) or cases.read_only(it, spec) for it in entry.readings)
        if all(ways) and not cases.is_mapping(entry, spec):  # a fixed mapping is judged by itself
            yield case


@requirement("OD-21", level="manual", cases=("entry", _write_cases), effects=("reads", "writes"))
def test_entry_of_disputed_access_is_written_or_refused(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """An entry that is read-only by some readings takes its own value, or refuses it as such."""
    data = own_value(node, entry)
    make_writable(node, entry)

    transfer = node.try_download(*entry.key, data)

    what = f"download of its own value to {entry.address}"
    _judge_answer(verdict, what, transfer, "confirmed", cases.REFUSED_WRITE)
    _follow(verdict, entry, lambda it: it.writable == transfer.confirmed)


def _value_cases(spec: DeviceSpec) -> Iterable[Case]:
    """Values of settings alone: what others count on, or what moves the node, has its own rules."""
    for entry in spec.entries.values():
        plain = any(cases.limited(it, spec) for it in entry.readings) and all(
            cases.writable(it, spec) and it.limits_by is None and it.reads == "written"
            for it in entry.readings
        )
        left = _is_of_service(entry, spec) or cases.moves_the_node(entry, spec)
        if plain and not left and _disputed_values(entry):
            yield Case(entry.address, entry, entry.source, cases.reach(entry, spec))


def _is_of_service(entry: Entry, spec: DeviceSpec) -> bool:
    heartbeat = spec.services.heartbeat_producer
    return (
        cases.is_pdo_object(entry, spec)
        or is_cob_id(entry, spec)
        or (heartbeat is not None and entry.index == heartbeat.object)
    )


def _parameter_cases(spec: DeviceSpec) -> Iterable[Case]:
    """Return the parameters of heartbeat, TPDOs, node-ID and bit rate of which values are disputed."""
    for entry in spec.entries.values():
        ranged = all(
            cases.limited(it, spec) and it.writable and it.limits_by is None
            for it in entry.readings
        )
        of_service = _is_of_service(entry, spec) or cases.moves_the_node(entry, spec)
        if ranged and of_service and _disputed_values(entry):
            section = entry.source_of("ranges")
            yield Case(entry.address, entry, section, cases.reach(entry, spec))


def _disputed_values(entry: Entry) -> list[int]:
    """Return the edges of what one reading allows and another does not."""
    edges = {edge for it in entry.readings for interval in it.legal or () for edge in interval}
    near = {value for edge in edges for value in (edge - 1, edge, edge + 1)}
    low, high = entry.type.minimum, entry.type.maximum
    return sorted(
        value
        for value in near
        if low <= value <= high
        and value not in entry.leaves_canopen
        and _is_disputed(value, entry.readings)
    )


def _judge_as_one_reading(verdict: Verdict, entry: Entry, taken: Mapping[int, bool]) -> None:
    """Judge that in each matter of dispute one reading has what was taken and refused; note which."""
    matters: dict[str, list[Alternative]] = {}
    for other in entry.alternatives:
        matters.setdefault(other.ambiguity, []).append(other)
    for matter, others in matters.items():
        beside = [entry, *(it.entry for it in entry.alternatives if it.ambiguity != matter)]
        values = [it for it in taken if not _is_disputed(it, beside)]
        fitting = [it for it in others if _fits(it.entry, values, taken)]
        as_judged = _fits(entry, values, taken)
        verdict.holds(
            f"values of {entry.address} taken, of {', '.join(map(str, values))}",
            expected="those of one reading",
            actual=", ".join(str(it) for it in values if taken[it]) or "none",
            ok=as_judged or bool(fitting),
        )
        if fitting and not as_judged:
            verdict.follows(matter, fitting[0].reading)


def _is_disputed(value: int, readings: Iterable[Entry]) -> bool:
    return len({is_legal(value, it.legal) for it in readings}) > 1


def _fits(reading: Entry, values: Iterable[int], taken: Mapping[int, bool]) -> bool:
    return all(is_legal(it, reading.legal) == taken[it] for it in values)


@requirement("OD-22", level="manual", cases=("entry", _value_cases), effects=("reads", "writes"))
def test_disputed_value_is_taken_or_refused(node: Node, entry: Entry, verdict: Verdict) -> None:
    """Values in dispute are taken, as they are or rounded, or refused as out of range, as one reading has it."""
    require_writable(node, entry)
    taken: dict[int, bool] = {}

    for value in _disputed_values(entry):
        transfer = node.try_download(*entry.key, entry.type.encode(value))
        taken[value] = transfer.confirmed
        what = f"download of {value} to {entry.address}"
        _judge_answer(verdict, what, transfer, "confirmed", cases.OUT_OF_RANGE)
        if transfer.confirmed and all(it.readable for it in entry.readings):
            held = node.number(*entry.key)
            verdict.holds(
                f"value of {entry.address} after {value}",
                expected=f"{value}, or one that every reading allows",
                actual=str(held),
                ok=held == value or entry.always_legal(held),
            )

    _judge_as_one_reading(verdict, entry, taken)


@requirement(
    "OD-23", level="manual", cases=("entry", _parameter_cases), effects=("reads", "writes")
)
def test_disputed_values_of_a_parameter_are_one_readings(
    node: Node, bench: Bench, entry: Entry, verdict: Verdict
) -> None:
    """Of the values that only some readings allow, a parameter of a service takes those of one reading."""
    require_writable(node, entry)
    moves = cases.moves_the_node(entry, node.spec)
    taken: dict[int, bool] = {}

    for value in _disputed_values(entry):
        if moves:
            transfer = tried(bench, node, entry, value)
        else:
            transfer = node.try_download(*entry.key, entry.type.encode(value))
        if not transfer.answered:
            raise SetupRefused(f"{value} may have taken effect before it was confirmed")
        taken[value] = transfer.confirmed

    _judge_as_one_reading(verdict, entry, taken)
