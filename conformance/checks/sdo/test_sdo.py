"""SDO server: segmented transfer, wrong requests, recovery (CiA 301 v4.2.0, 7.2.4)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import PROBE, Node
from conformance.checks import cases
from conformance.checks.cases import entries
from conformance.checks.sdo.transfers import (
    EXPEDITED,
    begin_upload,
    follow,
    judge_abort,
    judge_recovery,
    may_need_segments,
    needs_segments,
)
from conformance.checks.steps import require_alive, require_writable
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire import cob_id, sdo
from conformance.wire.abort import AbortCode, describe
from conformance.wire.frame import Frame

SDO = f"{CIA301}, 7.2.4.3"
REQUESTS = 10
QUIET_S = 0.05
PAUSE_S = 0.002
"""What keeps the buffers of an adapter from running full."""
UNKNOWN = (0xE0, 0xE1, 0xE2, 0xE4, 0xE8, 0xF0, 0xFF)
"""Commands with specifier 7, the only one that CiA 301 leaves undefined, and each other bit."""
CLIENT_ABORT = AbortCode.GENERAL_ERROR


def _server(_spec: DeviceSpec) -> Iterable[Case]:
    yield Case("server", None, "")


@requirement("SDO-01", level="shall", cases=entries(may_need_segments), source=f"{SDO}.6")
def test_long_value_is_uploaded_by_the_protocol(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A text or other long value is uploaded expedited or in segments that agree with each other."""
    transfer = node.sdo.upload(entry.index, entry.sub)
    if transfer.refused:
        raise SetupRefused(f"{entry.address} cannot be uploaded ({transfer}), see OD-02")

    verdict.holds(
        f"upload of {entry.address}",
        expected="a complete transfer",
        actual=str(transfer),
        ok=transfer.confirmed,
    )
    if transfer.confirmed:
        is_long = len(transfer.data or b"") > EXPEDITED
        verdict.holds(
            "protocol",
            expected="segmented" if is_long else "expedited or segmented",
            actual="expedited" if transfer.expedited else "segmented",
            ok=not (is_long and transfer.expedited),
        )
        if transfer.data and not is_long:
            form = "expedited" if transfer.expedited else "segmented"
            follow(node, verdict, "short_texts", form)


def _one_per_size(spec: DeviceSpec) -> Iterable[Case]:
    """One plain setting of each length."""
    seen: set[int | None] = {None}
    for entry in spec.entries.values():
        size = entry.type.size
        plain = cases.writable(entry, spec) and not cases.is_pdo_object(entry, spec)
        if plain and cases.same_type(entry) and size not in seen and not cases.reach(entry, spec):
            seen.add(size)
            yield Case(entry.address, entry, entry.source_of("type"))


@requirement(
    "SDO-02",
    level="shall",
    cases=("entry", _one_per_size),
    source=f"{CIA301}, 7.2.4.3.17",
    effects=("reads", "writes"),
)
def test_wrong_length_is_refused(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download with more or fewer octets than the data type has is refused."""
    require_writable(node, entry)
    for data in _wrong_lengths(node, entry):
        transfer = node.try_download(entry.index, entry.sub, data)
        verdict.holds(
            f"download of {len(data)} octets to {entry.address} ({entry.type.name})",
            expected="an abort",
            actual=str(transfer),
            ok=transfer.refused,
        )


@requirement(
    "SDO-03",
    level="shall",
    cases=("entry", _one_per_size),
    source=f"{CIA301}, 7.2.4.3.17",
    effects=("reads", "writes"),
)
def test_refused_length_names_the_length(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download of the wrong length is aborted with a code for the length."""
    require_writable(node, entry)
    for data in _wrong_lengths(node, entry):
        transfer = node.try_download(entry.index, entry.sub, data)
        if transfer.abort is None:
            raise SetupRefused(f"{len(data)} octets were not aborted ({transfer}), see SDO-02")
        verdict.one_of(
            f"abort code for {len(data)} octets",
            transfer.abort,
            _length_codes(node.spec, len(data)),
            show=describe,
        )


def _length_codes(spec: DeviceSpec, octets: int) -> tuple[AbortCode, ...]:
    """Return the codes for a wrong length; a server without segmented download may say that first."""
    server = spec.services.sdo_server
    if octets <= 4 or server is None or server.segmented_download:
        return cases.WRONG_LENGTH
    unsupported = (AbortCode.UNSUPPORTED_ACCESS, AbortCode.UNKNOWN_COMMAND_SPECIFIER)
    return (*cases.WRONG_LENGTH, *unsupported)


def _wrong_lengths(node: Node, entry: Entry) -> list[bytes]:
    own = node.upload(entry.index, entry.sub)
    lengths = (length for length in (1, 2, 4, 5) if length != len(own))
    return [own[:length].ljust(length, b"\0") for length in lengths]


def _commands(_spec: DeviceSpec) -> Iterable[Case]:
    return (Case(f"{command:02X}h", command, "") for command in UNKNOWN)


@requirement("SDO-04", level="shall", cases=("command", _commands), source=f"{SDO}.17")
def test_unknown_command_is_aborted(node: Node, command: int, verdict: Verdict) -> None:
    """A request with an unknown command specifier is aborted; the next request is served."""
    index, sub = PROBE
    request = bytes((command, index & 0xFF, index >> 8, sub, 0, 0, 0, 0))

    answer = node.sdo.ask(request)

    what = f"response to command {command:02X}h"
    judge_abort(what, answer, verdict, AbortCode.UNKNOWN_COMMAND_SPECIFIER)
    judge_recovery(node, verdict)


@requirement("SDO-05", level="shall", cases=entries(needs_segments), source=f"{SDO}.17")
def test_client_abort_ends_the_transfer(node: Node, entry: Entry, verdict: Verdict) -> None:
    """After the client aborts a segmented upload the server accepts a new transfer."""
    begin_upload(node, entry)

    node.sdo.abort(entry.index, entry.sub, CLIENT_ABORT)
    answer = node.sdo.ask(sdo.UploadSegment(toggle=False))

    verdict.holds(
        "response to a segment request after the abort",
        expected="an abort, or none",
        actual=str(answer),
        ok=answer.received is None or isinstance(answer.response, sdo.Abort),
    )
    judge_recovery(node, verdict)
    transfer = node.sdo.upload(entry.index, entry.sub)
    verdict.holds(
        f"upload of {entry.address} after the abort",
        expected="a complete transfer",
        actual=str(transfer),
        ok=transfer.confirmed,
    )


@requirement("SDO-06", level="shall", cases=entries(needs_segments), source=f"{SDO}.7")
def test_wrong_toggle_bit_is_aborted(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A segment request with the wrong toggle bit is aborted; the next transfer is served."""
    begin_upload(node, entry)

    answer = node.sdo.ask(sdo.UploadSegment(toggle=True))

    verdict.holds(
        "response to a first segment request with toggle bit 1",
        expected="an abort",
        actual=str(answer),
        ok=isinstance(answer.response, sdo.Abort),
    )
    judge_recovery(node, verdict)


@requirement("SDO-07", level="shall", cases=_server, source=f"{CIA301}, 7.2.4.2")
def test_request_to_another_node_is_not_answered(node: Node, verdict: Verdict) -> None:
    """A request to another node's SDO server is not answered by this node."""
    others = [other for other in range(1, 128) if other != node.node_id]
    request = sdo.encode(sdo.InitiateUpload(*PROBE))
    mark = node.link.mark()

    for other in others:
        node.send(Frame(cob_id.sdo_request(other), request))
        node.link.listen(PAUSE_S, node.channel.is_response)
    node.link.listen(QUIET_S, node.channel.is_response)

    strays = node.link.since(mark, node.channel.is_response)
    verdict.equal("responses of this node", len(strays), 0)
    require_alive(node)


@requirement("SDO-08", level="shall", cases=_server, source=SDO)
def test_each_request_is_answered_once(node: Node, verdict: Verdict) -> None:
    """Each request is answered exactly once."""
    seen: list[int] = []
    for _ in range(REQUESTS):
        mark = node.link.mark()
        node.sdo.ask(sdo.InitiateUpload(*PROBE))
        node.link.listen(QUIET_S, node.channel.is_response)
        seen.append(len(node.link.since(mark, node.channel.is_response)))

    verdict.equal(f"responses to each of {REQUESTS} requests", sorted(set(seen)), [1])
