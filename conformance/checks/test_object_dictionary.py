"""Object dictionary: what exists, how it may be accessed, what it holds and accepts.

CiA 301 v4.2.0, 7.2.4.3.17 (abort codes), 7.4 (object dictionary).
"""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node import Node
from conformance.bench.session import Bench
from conformance.checks import cases
from conformance.checks.cases import entries
from conformance.checks.steps import each_limit, make_writable, own_value, require_writable
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, Key, address
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode, describe
from conformance.wire.datatypes import Value
from conformance.wire.errors import WireError
from conformance.wire.nmt import NmtCommand

ABORT_CODES = f"{CIA301}, 7.2.4.3.17"
MISSING = (AbortCode.OBJECT_DOES_NOT_EXIST, AbortCode.SUB_INDEX_DOES_NOT_EXIST)


@requirement("OD-01", level="manual", cases=entries(cases.present))
def test_documented_entry_exists(node: Node, entry: Entry, verdict: Verdict) -> None:
    """Every documented object and sub-index exists."""
    transfer = node.sdo.upload(entry.index, entry.sub)
    if transfer.answered and transfer.fault:
        raise SetupRefused(f"the answer is no proper one ({transfer}), see OD-02")

    verdict.holds(
        f"existence of {entry.address}",
        expected="an answer other than that it does not exist",
        actual=str(transfer),
        ok=transfer.answered and transfer.abort not in MISSING,
    )


@requirement("OD-02", level="manual", cases=entries(cases.readable))
def test_readable_entry_is_uploaded(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An entry documented as readable can be uploaded."""
    transfer = node.sdo.upload(entry.index, entry.sub)
    if transfer.abort in MISSING:
        raise SetupRefused(f"{entry.address} does not exist, see OD-01")

    verdict.holds(
        f"upload of {entry.address}",
        expected="confirmed",
        actual=str(transfer),
        ok=transfer.confirmed,
    )


@requirement("OD-03", level="manual", cases=entries(cases.readable, "type"))
def test_upload_has_the_length_of_the_type(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An upload has as many octets as the documented data type."""
    data = node.upload(entry.index, entry.sub)

    sizes = {reading.type.size for reading in entry.readings}
    if None in sizes:
        lengths = [reading.octets or (1, 255) for reading in entry.readings]
        low, high = min(a for a, _ in lengths), max(b for _, b in lengths)
        verdict.holds(
            f"length of {entry.address}",
            expected=f"{low} to {high} octets" if low != high else f"{low} octets",
            actual=f"{len(data)} octets ({data.hex(' ').upper()})",
            ok=low <= len(data) <= high and _is_text(entry, data),
        )
    else:
        verdict.one_of(
            f"length of {entry.address}", len(data), sorted(s for s in sizes if s), unit="octets"
        )


def _is_text(entry: Entry, data: bytes) -> bool:
    try:
        entry.type.decode(data)
    except WireError:
        return False
    return True


@requirement("OD-04", level="manual", cases=entries(cases.writable), effects=("reads", "writes"))
def test_writable_entry_takes_its_own_value(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An entry documented as writable takes the value it holds."""
    data = node.upload(entry.index, entry.sub)
    make_writable(node, entry)

    transfer = node.try_download(entry.index, entry.sub, data)

    verdict.holds(
        f"download of its own value to {entry.address}",
        expected="confirmed",
        actual=str(transfer),
        ok=transfer.confirmed,
    )


@requirement("OD-05", level="manual", cases=entries(cases.read_only), effects=("reads", "writes"))
def test_read_only_entry_refuses_downloads(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An entry documented as read-only or constant refuses a download of the value it holds."""
    data = node.upload(entry.index, entry.sub)

    transfer = node.sdo.download(entry.index, entry.sub, data)

    verdict.holds(
        f"download to {entry.address} ({entry.access})",
        expected="an abort",
        actual=str(transfer),
        ok=transfer.refused,
    )


@requirement(
    "OD-06",
    level="shall",
    cases=entries(cases.read_only),
    source=ABORT_CODES,
    effects=("reads", "writes"),
)
def test_refused_write_names_the_access(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download to a read-only entry is aborted with a code for unsupported access."""
    data = node.upload(entry.index, entry.sub)

    transfer = node.sdo.download(entry.index, entry.sub, data)
    if transfer.abort is None:
        raise SetupRefused(f"the download was not aborted ({transfer}), see OD-05")

    verdict.one_of("abort code", transfer.abort, cases.REFUSED_WRITE, show=describe)


@requirement("OD-07", level="manual", cases=entries(cases.write_only))
def test_write_only_entry_refuses_uploads(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An entry documented as write-only refuses an upload."""
    transfer = node.sdo.upload(entry.index, entry.sub)
    if transfer.abort in MISSING:
        raise SetupRefused(f"{entry.address} does not exist, see OD-01")

    verdict.holds(
        f"upload of {entry.address} (wo)",
        expected="an abort",
        actual=str(transfer),
        ok=transfer.refused,
    )


@requirement("OD-08", level="shall", cases=entries(cases.write_only), source=ABORT_CODES)
def test_refused_read_names_the_access(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An upload of a write-only entry is aborted with a code for unsupported access."""
    transfer = node.sdo.upload(entry.index, entry.sub)
    if transfer.abort is None:
        raise SetupRefused(f"the upload was not aborted ({transfer}), see OD-07")
    if transfer.abort in MISSING:
        raise SetupRefused(f"{entry.address} does not exist, see OD-01")

    verdict.one_of("abort code", transfer.abort, cases.REFUSED_READ, show=describe)


@requirement("OD-09", level="manual", cases=entries(cases.fixed, "default"))
def test_fixed_entry_holds_its_documented_value(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An identity or constant entry holds the documented value."""
    data = own_value(node, entry)

    _judge_value(entry, data, verdict)


@requirement(
    "OD-10",
    level="manual",
    cases=entries(cases.configured, "default"),
    effects=("reads", "restores", "resets"),
)
def test_setting_has_its_default_after_restore(
    node: Node, bench: Bench, entry: Entry, verdict: Verdict
) -> None:
    """After the factory settings are restored, a setting holds its documented default."""
    bench.restore_defaults(node)
    data = own_value(node, entry)

    _judge_value(entry, data, verdict)


def _judge_value(entry: Entry, data: bytes, verdict: Verdict) -> None:
    try:
        actual = entry.type.decode(data)
    except WireError as error:
        verdict.holds(
            f"value of {entry.address}",
            expected=_show(entry, entry.default),
            actual=str(error),
            ok=False,
        )
        return
    wanted = list(dict.fromkeys(reading.default for reading in entry.readings))
    verdict.one_of(
        f"value of {entry.address}",
        actual,
        wanted,
        unit=entry.unit or "",
        show=lambda value: _show(entry, value),
    )
    for alternative in entry.alternatives:
        if actual == alternative.entry.default != entry.default:
            verdict.follows(alternative.ambiguity, alternative.reading)


def _show(entry: Entry, value: Value | None) -> str:
    if isinstance(value, int) and entry.type.size:
        digits = 2 * entry.type.size
        return f"{value} ({value % (1 << 4 * digits):0{digits}X}h)"
    return repr(value)


@requirement(
    "OD-11",
    level="manual",
    cases=entries(cases.limited, "ranges"),
    effects=("reads", "writes"),
)
def test_both_ends_of_each_range_are_accepted(node: Node, entry: Entry, verdict: Verdict) -> None:
    """Both ends of each documented range, and each value of an enumeration, are accepted."""
    require_writable(node, entry)

    for when, ranges in each_limit(node, entry):
        for value in cases.legal_values(entry, ranges):
            transfer = node.try_download(entry.index, entry.sub, entry.type.encode(value))
            verdict.holds(
                f"download of {value} to {entry.address}{when}",
                expected="confirmed",
                actual=str(transfer),
                ok=transfer.confirmed,
            )


def _read_back(entry: Entry, spec: DeviceSpec) -> bool:
    changes_reach = bool(cases.reach(entry, spec))
    return cases.limited(entry, spec) and entry.readable and not changes_reach


@requirement(
    "OD-12",
    level="shall",
    cases=entries(_read_back, "ranges"),
    source=f"{CIA301}, 7.2.4.3.3",
    effects=("reads", "writes"),
)
def test_accepted_value_is_read_back(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A value whose download was confirmed is what the next upload returns."""
    require_writable(node, entry)

    for when, ranges in each_limit(node, entry):
        for value in cases.legal_values(entry, ranges):
            data = entry.type.encode(value)
            if not node.try_download(entry.index, entry.sub, data).confirmed:
                raise SetupRefused(f"{entry.address} refuses {value}{when}, see OD-11")
            transfer = node.sdo.upload(entry.index, entry.sub)
            verdict.holds(
                f"upload of {entry.address} after download of {value}{when}",
                expected=f"confirmed ({data.hex(' ').upper()})",
                actual=str(transfer),
                ok=transfer.data == data,
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

    for when, ranges in each_limit(node, entry):
        for value in cases.illegal_values(entry, ranges):
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

    for when, ranges in each_limit(node, entry):
        for value in cases.illegal_values(entry, ranges):
            transfer = node.try_download(entry.index, entry.sub, entry.type.encode(value))
            if transfer.abort is None:
                raise SetupRefused(f"{value} was not aborted ({transfer}), see OD-13")
            verdict.one_of(
                f"abort code for {value} to {entry.address}{when}",
                transfer.abort,
                cases.OUT_OF_RANGE,
                show=describe,
            )


def _reserved(entry: Entry, spec: DeviceSpec) -> bool:
    del spec
    return entry.reserved


@requirement("OD-15", level="manual", cases=entries(_reserved))
def test_reserved_entry_refuses_access(node: Node, entry: Entry, verdict: Verdict) -> None:
    """An entry documented as reserved answers an access with an abort."""
    transfer = node.sdo.upload(entry.index, entry.sub)

    verdict.holds(
        f"upload of {entry.address} (reserved)",
        expected="an abort",
        actual=str(transfer),
        ok=transfer.refused,
    )


def _unknown_subs(spec: DeviceSpec) -> Iterable[Case]:
    """The sub-indices that an object's own table and its sub-index 0 both leave out."""
    for index in spec.indices():
        documented = {entry.sub for entry in spec.subs(index)}
        counts = [reading.default for reading in spec.subs(index)[0].readings]
        claimed = max([*documented, *(c for c in counts if isinstance(c, int) and c < 0xFF)])
        if not spec.subs(index)[0].in_record:
            claimed = 0
        unknown = [sub for sub in (claimed + 1, claimed + 2, 0xFE) if sub not in documented]
        yield Case(
            address(index), tuple((index, sub) for sub in unknown), spec.subs(index)[0].source
        )


@requirement(
    "OD-16", level="shall", cases=("unknown", _unknown_subs), source=f"{CIA301}, 7.2.4.3.17"
)
def test_unknown_sub_index_is_refused(
    node: Node, unknown: tuple[Key, ...], verdict: Verdict
) -> None:
    """A sub-index that the manual does not document is answered as not existing."""
    for index, sub in unknown:
        transfer = node.sdo.upload(index, sub)
        if transfer.abort == AbortCode.OBJECT_DOES_NOT_EXIST and sub != 0:
            first = node.sdo.upload(index, 0)
            if first.abort == AbortCode.OBJECT_DOES_NOT_EXIST:
                raise SetupRefused(f"{address(index)} does not exist, see OD-01")
        verdict.holds(
            f"upload of {address(index, sub)}",
            expected=" or ".join(f"abort {describe(code)}" for code in cases.NO_SUB_INDEX),
            actual=str(transfer),
            ok=transfer.abort in cases.NO_SUB_INDEX,
        )


RESERVED_INDICES = (0x1004, 0xC000, 0xFFFF)
"""No device may have these (CiA 301 v4.2.0, 7.4.1 and 7.5.2)."""


def _reserved_indices(spec: DeviceSpec) -> Iterable[Case]:
    return (Case(address(i), i, "") for i in RESERVED_INDICES if spec.entry(i) is None)


@requirement(
    "OD-17", level="shall", cases=("index", _reserved_indices), source=f"{CIA301}, 7.2.4.3.17"
)
def test_unknown_index_is_refused(node: Node, index: int, verdict: Verdict) -> None:
    """An index that no device has is answered as not existing."""
    transfer = node.sdo.upload(index, 0)

    verdict.holds(
        f"upload of {address(index, 0)}",
        expected=" or ".join(f"abort {describe(code)}" for code in cases.NO_OBJECT),
        actual=str(transfer),
        ok=transfer.abort in cases.NO_OBJECT,
    )


def _state_bound(entry: Entry, spec: DeviceSpec) -> bool:
    states = entry.writable_in
    return cases.writable(entry, spec) and states is not None and "operational" not in states


@requirement(
    "OD-18",
    level="manual",
    cases=entries(_state_bound, "writable_in"),
    effects=("reads", "writes"),
)
def test_state_bound_entry_refuses_downloads_elsewhere(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """An entry writable in Pre-operational only refuses a download in Operational."""
    require_writable(node, entry)
    data = own_value(node, entry)
    node.nmt(NmtCommand.START)

    transfer = node.sdo.download(entry.index, entry.sub, data)

    verdict.holds(
        f"download to {entry.address} in Operational",
        expected="an abort",
        actual=str(transfer),
        ok=transfer.refused,
    )
