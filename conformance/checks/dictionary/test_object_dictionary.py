"""Object dictionary: what exists, how it may be accessed, what it holds and accepts.

CiA 301 v4.2.0, 7.2.4.3.17 (abort codes), 7.4 (object dictionary).
"""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.checks import cases
from conformance.checks.cases import entries
from conformance.checks.steps import make_writable, own_value, require_writable
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, Key, address
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode, describe
from conformance.wire.datatypes import DataType
from conformance.wire.errors import WireError
from conformance.wire.nmt import NmtCommand

ABORT_CODES = f"{CIA301}, 7.2.4.3.17"
MOST_SHOWN = 64
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
    judge_length(entry, node.upload(entry.index, entry.sub), verdict)


def judge_length(entry: Entry, data: bytes, verdict: Verdict) -> None:
    """Judge that an upload has as many octets as some reading documents."""
    verdict.holds(
        f"length of {entry.address}",
        expected=" or ".join(dict.fromkeys(_lengths(reading) for reading in entry.readings)),
        actual=f"{_octets(len(data))} ({_shown(data)})",
        ok=any(_has_length(reading, data) for reading in entry.readings),
    )


def _octets(count: int) -> str:
    return "1 octet" if count == 1 else f"{count} octets"


def _shown(data: bytes) -> str:
    rest = " …" if len(data) > MOST_SHOWN else ""
    return data[:MOST_SHOWN].hex(" ").upper() + rest


def _lengths(entry: Entry) -> str:
    if entry.type.size is not None:
        return f"{_octets(entry.type.size)} ({entry.type.name})"
    if entry.octets is None:
        return f"{_octets(_least(entry))} or more of {entry.type.name}"
    low, high = entry.octets
    length = f"{low} to {high} octets" if low != high else _octets(low)
    return f"{length} of {entry.type.name}"


def _least(entry: Entry) -> int:
    """A text of undocumented length is not empty; a DOMAIN may hold nothing."""
    return 0 if entry.type is DataType.DOMAIN else 1


def _has_length(entry: Entry, data: bytes) -> bool:
    if entry.type.size is not None:
        return len(data) == entry.type.size
    low, high = entry.octets or (_least(entry), len(data))
    return low <= len(data) <= high and _is_text(entry, data)


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


LAST_SUB = 0xFE
"""FFh is the structure of an object (CiA 301 v4.2.0, 7.4.4)."""


def _unknown_subs(spec: DeviceSpec) -> Iterable[Case]:
    """The sub-indices that an object's own table and its sub-index 0 both leave out."""
    for index in spec.indices():
        documented = {entry.sub for entry in spec.subs(index)}
        counts = [reading.default for reading in spec.subs(index)[0].readings]
        claimed = max([*documented, *(c for c in counts if isinstance(c, int) and c < 0xFF)])
        if not spec.subs(index)[0].in_record:
            claimed = 0
        unknown = [
            sub
            for sub in sorted({claimed + 1, claimed + 2, LAST_SUB})
            if sub not in documented and sub <= LAST_SUB
        ]
        if unknown:
            yield Case(
                address(index), tuple((index, sub) for sub in unknown), spec.subs(index)[0].source
            )


def _absence(first: Entry) -> tuple[AbortCode, ...]:
    """Return the codes for a missing sub-index; a server may look at the access right first."""
    return (*cases.NO_SUB_INDEX, *(cases.REFUSED_READ if first.access == "wo" else ()))


@requirement(
    "OD-16", level="shall", cases=("unknown", _unknown_subs), source=f"{CIA301}, 7.2.4.3.17"
)
def test_unknown_sub_index_is_refused(
    node: Node, unknown: tuple[Key, ...], verdict: Verdict
) -> None:
    """A sub-index that the manual does not document is answered as not existing."""
    for index, sub in unknown:
        transfer = node.sdo.upload(index, sub)
        absent = transfer.abort == AbortCode.OBJECT_DOES_NOT_EXIST
        if absent and node.sdo.upload(index, 0).abort == AbortCode.OBJECT_DOES_NOT_EXIST:
            if not node.spec.entries[index, 0].optional:
                raise SetupRefused(f"{address(index)} does not exist, see OD-01")
        else:
            absent = transfer.abort in _absence(node.spec.entries[index, 0])
        verdict.holds(
            f"upload of {address(index, sub)}",
            expected=" or ".join(f"abort {describe(code)}" for code in cases.NO_SUB_INDEX),
            actual=str(transfer),
            ok=absent,
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
