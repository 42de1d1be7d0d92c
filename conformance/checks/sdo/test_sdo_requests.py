"""SDO requests out of place: what an SDO server must neither take nor answer (CiA 301 v4.2.0, 7.2.4)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import PROBE, Node
from conformance.bench.node.sdo import Answer
from conformance.checks import cases
from conformance.checks.sdo.transfers import (
    EXPEDITED,
    held_and_new,
    judge_holds,
    judge_recovery,
    longest_expedited,
)
from conformance.checks.steps import require_alive
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire import sdo
from conformance.wire.abort import AbortCode
from conformance.wire.frame import Frame

SDO = f"{CIA301}, 7.2.4.3"
QUIET_S = 0.05
FULL = 8
HEADER = 4
"""Octets before the data of an expedited download."""
CLIENT_ABORT = AbortCode.GENERAL_ERROR


def _server(_spec: DeviceSpec) -> Iterable[Case]:
    yield Case("server", None, "")


def _segments(_spec: DeviceSpec) -> Iterable[Case]:
    yield Case("upload", sdo.UploadSegment(toggle=False), "")
    yield Case("download", sdo.DownloadSegment(toggle=False, data=b"\0", last=True), "")


@requirement("SDO-23", level="shall", cases=("segment", _segments), source=f"{SDO}.4, 7.2.4.3.7")
def test_segment_without_a_transfer_is_not_served(
    node: Node, segment: sdo.Request, verdict: Verdict
) -> None:
    """A segment while no transfer is under way gets an abort or no answer; the next request is served."""
    node.upload(*PROBE)

    answer = node.sdo.ask(segment, wait_s=QUIET_S)

    verdict.holds(
        "response to a segment without a transfer",
        expected="an abort, or none",
        actual=str(answer),
        ok=answer.received is None or answer.code is not None,
    )
    judge_recovery(node, verdict)


@requirement("SDO-24", level="shall", cases=_server, source=f"{SDO}.1")
def test_short_request_does_not_stop_the_server(node: Node, verdict: Verdict) -> None:
    """After frames with fewer octets than a request the next request is served."""
    request = sdo.encode(sdo.InitiateUpload(*PROBE))

    for length in range(FULL):
        node.sdo.ask(request[:length], wait_s=QUIET_S)

    judge_recovery(node, verdict)


@requirement(
    "SDO-34",
    level="should",
    cases=("entry", longest_expedited),
    source=f"{SDO}.3",
    effects=("reads", "writes"),
)
def test_incomplete_download_changes_nothing(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A download whose frame ends before its data changes nothing."""
    held, new = held_and_new(node, entry)
    request = sdo.encode(sdo.InitiateDownload(*entry.key, new))

    for length in range(HEADER, HEADER + len(new)):
        node.sdo.ask(request[:length], wait_s=QUIET_S)

    judge_holds(node, entry, held, verdict)


def _other_frames(_spec: DeviceSpec) -> Iterable[Case]:
    yield Case("remote", "remote", "", needs=("remote-frames",))
    yield Case("29-bit", "29-bit", "")


@requirement("SDO-25", level="shall", cases=("kind", _other_frames), source=f"{CIA301}, 7.5.2.33")
def test_only_a_data_frame_with_11_bits_is_a_request(
    node: Node, kind: str, verdict: Verdict
) -> None:
    """A remote frame, or a frame with a 29-bit identifier, of the number of a request is not answered."""
    frame = Frame(node.channel.request_id, remote=True, dlc=FULL)
    if kind == "29-bit":
        request = sdo.encode(sdo.InitiateUpload(*PROBE))
        frame = Frame(node.channel.request_id, request, extended=True)
    mark = node.link.mark()

    node.send(frame)
    node.link.listen(QUIET_S, node.channel.is_response)

    verdict.equal("responses", len(node.link.since(mark, node.channel.is_response)), 0)
    node.channel.begin()
    require_alive(node)


def _two_objects(spec: DeviceSpec) -> Iterable[Case]:
    """Two objects of one frame that never change."""
    fixed = [
        entry
        for entry in spec.entries.values()
        if entry.kind in ("identity", "constant")
        and cases.readable(entry, spec)
        and not entry.optional
        and (entry.type.size or FULL) <= EXPEDITED
    ]
    if len(fixed) > 1:
        first, second = fixed[0], fixed[-1]
        yield Case(f"{first.address}/{second.address}", (first, second), "")


@requirement("SDO-26", level="shall", cases=("two", _two_objects), source=f"{SDO}.5")
def test_requests_back_to_back_do_not_mix(
    node: Node, two: tuple[Entry, Entry], verdict: Verdict
) -> None:
    """Of two requests without a pause each is answered with its own object or not at all, one at least."""
    held = {entry.key: node.upload(*entry.key) for entry in two}

    answers = node.sdo.ask_at_once(*(sdo.InitiateUpload(*key) for key in held))

    given = [answer for answer in answers if answer.received is not None]
    objects = [_object(answer) for answer in given]
    verdict.holds(
        "answers",
        expected=" and ".join(f"{address(*key)} = {held[key].hex(' ').upper()}" for key in held),
        actual=", ".join(map(str, given)) or "none",
        ok=bool(given)
        and len(set(objects)) == len(given)
        and all(_is_right(answer, held) for answer in given),
    )
    judge_recovery(node, verdict)


def _object(answer: Answer) -> tuple[int, int] | None:
    """Return the object that a response names."""
    match answer.response:
        case (
            sdo.InitiateUploadReply(index=index, sub=sub)
            | sdo.InitiateDownloadAck(index=index, sub=sub)
            | sdo.Abort(index=index, sub=sub)
        ):
            return index, sub
    return None


def _is_right(answer: Answer, held: dict[tuple[int, int], bytes]) -> bool:
    key = _object(answer)
    if key not in held:
        return False
    reply = answer.response
    if isinstance(reply, sdo.InitiateUploadReply) and reply.expedited:
        return reply.data[: len(held[key])] == held[key]
    return True


@requirement("SDO-27", level="shall", cases=_server, source=f"{SDO}.17")
def test_client_abort_is_not_answered(node: Node, verdict: Verdict) -> None:
    """An abort by the client is not answered, and the next request is served."""
    answer = node.sdo.ask(sdo.Abort(*PROBE, CLIENT_ABORT), wait_s=QUIET_S)

    verdict.holds(
        "response to an abort", expected="none", actual=str(answer), ok=answer.received is None
    )
    judge_recovery(node, verdict)


def _kinds_of_answers(spec: DeviceSpec) -> Iterable[Case]:
    """An upload, a download and a request that is refused, each of an object of its own."""
    named = [entry for entry in spec.entries.values() if entry.sub and cases.readable(entry, spec)]
    for entry in named[:1]:
        yield Case("upload", sdo.InitiateUpload(*entry.key), "")
    if spec.entry(0x1004) is None:
        yield Case("abort", sdo.InitiateUpload(0x1004, 3), "")


@requirement(
    "SDO-28", level="shall", cases=("asked", _kinds_of_answers), source=f"{SDO}.6, 7.2.4.3.17"
)
def test_answer_names_the_object_asked(
    node: Node, asked: sdo.InitiateUpload, verdict: Verdict
) -> None:
    """An answer, and an abort as well, names the index and sub-index of its request."""
    answer = node.sdo.ask(asked)

    verdict.holds(
        "object of the answer",
        expected=address(asked.index, asked.sub),
        actual=str(answer.received.frame) if answer.received else answer.fault,
        ok=_object(answer) == (asked.index, asked.sub),
    )


@requirement(
    "SDO-29",
    level="shall",
    cases=("entry", longest_expedited),
    source=f"{SDO}.3",
    effects=("reads", "writes"),
)
def test_confirmation_of_a_download_holds_nothing_else(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """The confirmation of a download is 60h with the object; its other octets are 0."""
    held, _ = held_and_new(node, entry)

    answer = node.sdo.ask(sdo.InitiateDownload(*entry.key, held))
    if answer.code is not None:
        raise SetupRefused(f"the download was not confirmed ({answer}), see OD-04")

    confirmation = Frame(node.channel.response_id, sdo.encode(sdo.InitiateDownloadAck(*entry.key)))
    verdict.holds(
        f"answer to a download to {entry.address}",
        expected=str(confirmation),
        actual=str(answer),
        ok=answer.received is not None and answer.received.frame.data == confirmation.data,
    )
