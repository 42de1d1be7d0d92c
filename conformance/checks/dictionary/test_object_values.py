"""Object dictionary: what the entries hold after a restore, and which values they accept.

CiA 301 v4.2.0, 7.2.4.3.17 (abort codes), 7.4 (object dictionary).
"""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.bench.settings.in_force import InForce
from conformance.checks import cases
from conformance.checks.cases import entries
from conformance.checks.memory import kept, storable
from conformance.checks.place.moved import tried
from conformance.checks.steps import agree, each_limit, own_value, require_writable
from conformance.checks.waiting import conditional, require_writable_now
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire.abort import describe
from conformance.wire.datatypes import Value
from conformance.wire.errors import WireError

ABORT_CODES = f"{CIA301}, 7.2.4.3.17"


@requirement("OD-09", level="manual", cases=entries(cases.fixed, "default"))
def test_fixed_entry_holds_its_documented_value(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An identity or constant entry holds the documented value."""
    data = own_value(node, entry)

    judge_value(entry, data, verdict)


def _factory_settings(spec: DeviceSpec) -> Iterable[Case]:
    """Return the settings with a default; where a reading leaves it open, those with documented bits."""
    for entry in spec.entries.values():
        settings = all(cases.readable(it, spec) and it.kind == "config" for it in entry.readings)
        known = {reading.default is not None for reading in entry.readings}
        if settings and (known == {True} or (True in known and entry.bits)):
            yield Case(entry.address, entry, entry.source_of("default"), cases.reach(entry, spec))


@requirement(
    "OD-10",
    level="manual",
    cases=("entry", _factory_settings),
    effects=storable.RESTORES,
)
def test_setting_has_its_default_after_restore(
    node: Node, bench: Bench, entry: Entry, verdict: Verdict
) -> None:
    """After the factory settings are restored, a setting holds its documented default."""
    data = kept.default_of(bench, node, verdict, entry)

    judge_value(entry, data, verdict)


def judge_value(entry: Entry, data: bytes, verdict: Verdict) -> None:
    """Judge that an entry holds what some reading documents, and tell which reading it follows."""
    agreeing = [
        number
        for number, reading in enumerate(entry.readings)
        if _agrees(reading, _decoded(reading, data))
    ]
    wanted = dict.fromkeys(
        "documented bits alone" if it.default is None else _show(it, it.default_value)
        for it in entry.readings
    )
    shown = _decoded(entry, data)
    verdict.holds(
        f"value of {entry.address}",
        expected=" or ".join(wanted),
        actual=data.hex(" ").upper() if shown is None else _show(entry, shown),
        ok=bool(agreeing),
    )
    if agreeing and agreeing[0] > 0:
        alternative = entry.alternatives[agreeing[0] - 1]
        verdict.follows(alternative.ambiguity, alternative.reading)


def _agrees(entry: Entry, value: Value | None) -> bool:
    """Tell whether a value is the default, or has documented bits alone where that is left open."""
    if entry.default is not None:
        return value == entry.default_value
    mask = sum(1 << bit for bit in entry.bits or ())
    return isinstance(value, int) and not value & ~mask


def _decoded(entry: Entry, data: bytes) -> Value | None:
    """Return the data as a value of the entry's type, None when they are none."""
    try:
        return entry.type.decode(data)
    except WireError:
        return None


def _show(entry: Entry, value: Value | None) -> str:
    if isinstance(value, int) and entry.type.size:
        digits = 2 * entry.type.size
        return f"{value} ({value % (1 << 4 * digits):0{digits}X}h)"
    return repr(value)


@requirement(
    "OD-11",
    level="manual",
    cases=conditional(entries(cases.limited, "ranges")),
    effects=("reads", "writes"),
)
def test_both_ends_of_each_range_are_accepted(
    node: Node, bench: Bench, entry: Entry, in_force: InForce, verdict: Verdict
) -> None:
    """Both ends of each documented range, and each value of an enumeration, are accepted."""
    require_writable_now(node, entry, in_force, verdict)
    moves = cases.moves_the_node(entry, node.spec)

    for when, limit in each_limit(node, entry):
        for value in cases.legal_values(limit):
            data = entry.type.encode(value)
            if moves:
                transfer = tried(bench, node, entry, value)
            else:
                transfer = node.try_download(entry.index, entry.sub, data)
            if moves and not transfer.answered:
                raise SetupRefused(f"{value} may have taken effect before it was confirmed")
            verdict.holds(
                f"download of {value} to {entry.address}{when}",
                expected="confirmed",
                actual=str(transfer),
                ok=transfer.confirmed,
            )


def _read_back(entry: Entry, spec: DeviceSpec) -> bool:
    moves = cases.moves_the_node(entry, spec)
    at_once = entry.reads == "written"
    return cases.limited(entry, spec) and entry.readable and at_once and not moves


@requirement(
    "OD-12",
    level="shall",
    cases=conditional(entries(_read_back, "ranges")),
    source=f"{CIA301}, 7.2.4.3.3",
    effects=("reads", "writes"),
)
def test_accepted_value_is_read_back(
    node: Node, entry: Entry, in_force: InForce, verdict: Verdict
) -> None:
    """A value whose download was confirmed is what the next upload returns."""
    require_writable_now(node, entry, in_force, verdict)

    for when, limit in each_limit(node, entry):
        for value in cases.legal_values(limit):
            data = entry.type.encode(value)
            if not node.try_download(entry.index, entry.sub, data).confirmed:
                raise SetupRefused(f"{entry.address} refuses {value}{when}, see OD-11")
            agree(node, entry, value)
            verdict.equal(
                f"upload of {entry.address} after download of {value}{when}",
                node.upload(entry.index, entry.sub),
                data,
                show=lambda octets: octets.hex(" ").upper(),
            )


@requirement(
    "OD-13",
    level="shall",
    cases=entries(cases.has_illegal_values, "ranges"),
    source=ABORT_CODES,
    effects=("reads", "writes"),
)
def test_values_outside_each_range_are_refused(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A value outside the documented ranges or enumeration is refused."""
    require_writable(node, entry)

    for when, limit in each_limit(node, entry):
        for value in cases.illegal_values(entry, limit):
            transfer = node.try_download(entry.index, entry.sub, entry.type.encode(value))
            verdict.holds(
                f"download of {value} to {entry.address}{when}",
                expected="an abort",
                actual=str(transfer),
                ok=transfer.refused,
            )


@requirement(
    "OD-14",
    level="shall",
    cases=entries(cases.has_illegal_values, "ranges"),
    source=ABORT_CODES,
    effects=("reads", "writes"),
)
def test_refused_value_names_the_range(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A value outside the documented ranges is aborted with a code for an invalid value."""
    require_writable(node, entry)

    for when, limit in each_limit(node, entry):
        for value in cases.illegal_values(entry, limit):
            transfer = node.try_download(entry.index, entry.sub, entry.type.encode(value))
            if transfer.abort is None:
                raise SetupRefused(f"{value} was not aborted ({transfer}), see OD-13")
            verdict.one_of(
                f"abort code for {value} to {entry.address}{when}",
                transfer.abort,
                cases.OUT_OF_RANGE,
                show=describe,
            )
