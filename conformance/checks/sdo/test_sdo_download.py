"""SDO download: in segments, without size, broken off, to what does not exist (CiA 301 v4.2.0, 7.2.4)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.checks import cases
from conformance.checks.sdo.transfers import (
    NO_SEGMENTS,
    SEGMENT,
    announced,
    follow,
    held_and_new,
    judge_abort,
    judge_holds,
    judge_recovery,
    longest,
    may_refuse_segments,
    one_per_size,
    up_to_four_octets,
)
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, Key, address
from conformance.verdict import Verdict
from conformance.wire import sdo
from conformance.wire.abort import AbortCode, describe

SDO = f"{CIA301}, 7.2.4.3"
CLIENT_ABORT = AbortCode.GENERAL_ERROR
RESERVED_INDICES = (0x1004, 0xC000, 0xFFFF)
"""No device may have these (CiA 301 v4.2.0, 7.4.1 and 7.5.2)."""
SOMETHING = bytes(4)


@requirement(
    "SDO-09",
    level="shall",
    cases=("entry", one_per_size),
    source=f"{SDO}.3, 7.2.4.3.4",
    effects=("reads", "writes"),
)
def test_download_in_segments_is_carried_out(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download in segments is carried out, or refused by a server of which no object needs one."""
    held, new = held_and_new(node, entry)

    transfer = node.sdo.download_segments(*entry.key, new, len(new))

    _judge_done_or_refused(node, transfer, verdict)
    judge_holds(node, entry, new if transfer.confirmed else held, verdict)


@requirement(
    "SDO-10",
    level="shall",
    cases=("entry", one_per_size),
    source=f"{SDO}.3, 7.2.4.3.4",
    effects=("reads", "writes"),
)
def test_download_in_segments_needs_no_size(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download in segments whose size is not announced ends like one whose size is."""
    held, new = held_and_new(node, entry)

    transfer = node.sdo.download_segments(*entry.key, new, None)

    _judge_done_or_refused(node, transfer, verdict)
    judge_holds(node, entry, new if transfer.confirmed else held, verdict)


def _judge_done_or_refused(node: Node, transfer: Transfer, verdict: Verdict) -> None:
    refusals = NO_SEGMENTS if may_refuse_segments(node.spec) else ()
    verdict.holds(
        "download in segments",
        expected=" or ".join(("confirmed", *(f"abort {describe(code)}" for code in refusals))),
        actual=str(transfer),
        ok=transfer.confirmed or transfer.abort in refusals,
    )
    follow(node, verdict, "segmented_download", transfer.confirmed)


@requirement(
    "SDO-11",
    level="shall",
    cases=("entry", longest),
    source=f"{SDO}.4, 7.2.4.3.17",
    effects=("reads", "writes"),
)
def test_wrong_toggle_bit_ends_a_download(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A downloaded segment with the wrong toggle bit is aborted for it and changes nothing."""
    held, new = held_and_new(node, entry)
    if not announced(node, entry, len(new), verdict):
        return
    toggle = _send_all_but_last(node, new)

    answer = node.sdo.ask(sdo.DownloadSegment(not toggle, new[-_rest(new) :], last=True))

    judge_abort("last segment", answer, verdict, AbortCode.TOGGLE_BIT_NOT_ALTERNATED)
    judge_holds(node, entry, held, verdict)


@requirement(
    "SDO-12",
    level="shall",
    cases=("entry", longest),
    source=f"{SDO}.17",
    effects=("reads", "writes"),
)
def test_client_abort_ends_a_download(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download that the client aborts changes nothing, and a new transfer is served."""
    held, new = held_and_new(node, entry)
    if not announced(node, entry, len(new), verdict):
        return
    toggle = _send_all_but_last(node, new)

    node.sdo.abort(*entry.key, CLIENT_ABORT)
    answer = node.sdo.ask(sdo.DownloadSegment(toggle, new[-_rest(new) :], last=True))

    verdict.holds(
        "response to a segment after the abort",
        expected="an abort, or none",
        actual=str(answer),
        ok=answer.received is None or answer.code is not None,
    )
    judge_holds(node, entry, held, verdict)
    judge_recovery(node, verdict)


def _rest(data: bytes) -> int:
    """Return how many octets the last segment has."""
    return (len(data) - 1) % SEGMENT + 1


def _send_all_but_last(node: Node, data: bytes) -> bool:
    """Send the segments before the last one; return the toggle bit of that."""
    toggle = False
    for start in range(0, len(data) - _rest(data), SEGMENT):
        segment = sdo.DownloadSegment(toggle, data[start : start + SEGMENT], last=False)
        answer = node.sdo.ask(segment)
        if not isinstance(answer.response, sdo.DownloadSegmentAck):
            raise SetupRefused(f"a segment on the way was not confirmed ({answer}), see SDO-09")
        toggle = not toggle
    return toggle


@requirement(
    "SDO-13",
    level="shall",
    cases=("entry", one_per_size),
    source=f"{SDO}.4, 7.2.4.3.17",
    effects=("reads", "writes"),
)
def test_wrong_number_of_octets_in_segments_is_refused(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """Segments with more or fewer octets than announced and than the data type has change nothing."""
    held, new = held_and_new(node, entry)
    refusals = NO_SEGMENTS if may_refuse_segments(node.spec) else ()
    for data, size in _wrong_totals(new):
        transfer = node.sdo.download_segments(*entry.key, data, size)

        told = "none" if size is None else str(size)
        what = f"segments with {len(data)} octets, {told} announced"
        judge_abort(what, transfer, verdict, *cases.WRONG_LENGTH, *refusals)
        judge_holds(node, entry, held, verdict)


def _wrong_totals(data: bytes) -> Iterable[tuple[bytes, int | None]]:
    yield data + bytes(1), len(data)
    yield data + bytes(1), None
    if len(data) > 1:
        yield data[:-1], len(data)


@requirement(
    "SDO-14",
    level="shall",
    cases=("entry", up_to_four_octets),
    source=f"{SDO}.3",
    effects=("reads", "writes"),
)
def test_download_without_size_takes_what_the_type_needs(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """An expedited download that does not say its size is taken as the type needs it, or refused."""
    held, new = held_and_new(node, entry)

    transfer = node.sdo.download_unsized(*entry.key, new)

    verdict.holds(
        f"download of 4 octets without size to {entry.address} ({entry.type.name})",
        expected="confirmed, or an abort",
        actual=str(transfer),
        ok=transfer.confirmed or transfer.refused,
    )
    follow(node, verdict, "unsized_download", "accepted" if transfer.confirmed else "refused")
    judge_holds(node, entry, new if transfer.confirmed else held, verdict)


@requirement(
    "SDO-15",
    level="shall",
    cases=("entry", longest),
    source=f"{SDO}.3",
    effects=("reads", "writes"),
)
def test_interrupted_download_changes_nothing(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download that a new request interrupts changes nothing, and the transfer after it is served."""
    held, new = held_and_new(node, entry)
    if not announced(node, entry, len(new), verdict):
        return
    _send_all_but_last(node, new)

    transfer = node.sdo.upload(*entry.key)

    verdict.holds(
        "request that interrupts",
        expected="confirmed, or an abort",
        actual=str(transfer),
        ok=transfer.confirmed or transfer.refused,
    )
    judge_holds(node, entry, held, verdict)


def _reserved_indices(spec: DeviceSpec) -> Iterable[Case]:
    return (Case(address(i), (i, 0), "") for i in RESERVED_INDICES if spec.entry(i) is None)


@requirement(
    "SDO-16",
    level="shall",
    cases=("absent", _reserved_indices),
    source=f"{SDO}.17",
    effects=("reads", "writes"),
)
def test_download_to_unknown_index_is_refused(node: Node, absent: Key, verdict: Verdict) -> None:
    """A download to an index that no device has is aborted, as not existing."""
    _require_absent(node, absent)

    transfer = node.sdo.download(*absent, SOMETHING)

    judge_abort(f"download to {address(*absent)}", transfer, verdict, *cases.NO_OBJECT)


def _absent_subs(spec: DeviceSpec) -> Iterable[Case]:
    """The sub-index behind that of the device type and of a setting without sub-indices."""
    settings = (entry for entry in spec.entries.values() if cases.writable(entry, spec))
    plain = [entry.index for entry in settings if not entry.in_record][:1]
    for index in (0x1000, *plain):
        if spec.entry(index) is not None and spec.entry(index, 1) is None:
            yield Case(address(index, 1), (index, 1), spec.entries[index, 0].source)


@requirement(
    "SDO-17",
    level="shall",
    cases=("absent", _absent_subs),
    source=f"{SDO}.17",
    effects=("reads", "writes"),
)
def test_download_to_unknown_sub_index_is_refused(
    node: Node, absent: Key, verdict: Verdict
) -> None:
    """A download to a sub-index that an object does not have is aborted, as not existing."""
    _require_absent(node, absent)
    read_only = not node.spec.entries[absent[0], 0].writable

    transfer = node.sdo.download(*absent, SOMETHING)

    codes = (*cases.NO_SUB_INDEX, *(cases.REFUSED_WRITE if read_only else ()))
    judge_abort(f"download to {address(*absent)}", transfer, verdict, *codes)


def _require_absent(node: Node, key: Key) -> None:
    """Make sure that nothing is written that is there."""
    transfer = node.sdo.upload(*key)
    if not transfer.refused:
        raise SetupRefused(f"{address(*key)} is not refused to be read ({transfer}), see OD-16")
