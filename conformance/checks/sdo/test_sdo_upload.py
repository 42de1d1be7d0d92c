"""SDO upload: toggle bit, interruption, form of the answers, what a node may have (CiA 301 v4.2.0, 7.2.4)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.checks import cases
from conformance.checks.cases import entries
from conformance.checks.sdo.transfers import (
    EXPEDITED,
    SEGMENT,
    begin_upload,
    expedited_commands,
    follow,
    judge_abort,
    judge_recovery,
    needs_segments,
)
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict
from conformance.wire import sdo
from conformance.wire.abort import AbortCode

SDO = f"{CIA301}, 7.2.4.3"
STRUCTURE = 0xFF
"""Sub-index that tells an object's code and data type."""
VARIABLE, ARRAY, RECORD = 7, 8, 9
FURTHER_SERVERS = range(0x1201, 0x1280)


@requirement("SDO-18", level="shall", cases=entries(needs_segments), source=f"{SDO}.7, 7.2.4.3.17")
def test_abort_of_an_upload_names_the_toggle_bit(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A request for a segment with the wrong toggle bit is aborted with the code for it."""
    octets = len(node.upload(*entry.key))
    begin_upload(node, entry)
    under_way = octets > SEGMENT
    if under_way:
        node.sdo.ask(sdo.UploadSegment(toggle=False))

    answer = node.sdo.ask(sdo.UploadSegment(toggle=not under_way))

    what = f"request for segment {1 + under_way} with toggle bit {int(not under_way)}"
    judge_abort(what, answer, verdict, AbortCode.TOGGLE_BIT_NOT_ALTERNATED)
    judge_recovery(node, verdict)


@requirement("SDO-19", level="shall", cases=entries(needs_segments), source=f"{SDO}.5")
def test_interrupted_upload_can_be_begun_again(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A request that interrupts an upload is served or aborted, and the transfer after it is served."""
    data = node.upload(*entry.key)
    begin_upload(node, entry)

    transfer = node.sdo.upload(*entry.key)

    verdict.holds(
        "upload begun again on the way",
        expected=f"confirmed ({data.hex(' ').upper()}), or an abort",
        actual=str(transfer),
        ok=transfer.data == data or transfer.refused,
    )
    judge_recovery(node, verdict)


def _one_per_size(spec: DeviceSpec) -> Iterable[Case]:
    """One number of each length up to four octets."""
    seen: set[int] = set()
    for entry in spec.entries.values():
        size = entry.type.size
        if size is None or size > EXPEDITED or size in seen or not cases.readable(entry, spec):
            continue
        if cases.same_type(entry) and not entry.optional:
            seen.add(size)
            yield Case(entry.address, entry, _answers_source(spec))


def _answers_source(spec: DeviceSpec) -> str:
    server = spec.services.sdo_server
    return server.source if server is not None else ""


@requirement("SDO-20", level="shall", cases=("entry", _one_per_size), source=f"{SDO}.6")
def test_answer_to_an_upload_has_a_documented_form(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """The command of the answer to an upload says its form and, if it says one, the right length."""
    answer = node.sdo.ask(sdo.InitiateUpload(*entry.key))
    if answer.code is not None:
        raise SetupRefused(f"{entry.address} cannot be uploaded ({answer}), see OD-02")

    told, untold = expedited_commands(entry)
    allowed = (told, untold, *_segmented_commands(node.spec))
    verdict.one_of(
        f"command of the answer for {entry.address} ({entry.type.name})",
        -1 if answer.command is None else answer.command,
        allowed,
        show=lambda command: f"{command:02X}h" if command >= 0 else "no response",
    )
    if answer.command in (told, untold):
        follow(node, verdict, "upload_size", "untold" if answer.command == untold else "told")
    elif answer.command in allowed:
        node.sdo.abort(*entry.key, AbortCode.GENERAL_ERROR)


def _segmented_commands(spec: DeviceSpec) -> tuple[int, ...]:
    """Return the commands that announce segments, which a server may prefer by some reading."""
    servers = [services.sdo_server for services, _ in spec.services_readings]
    always = all(it is not None and it.short_numbers == "expedited" for it in servers)
    return () if always else (0x41, 0x40)


def _structured(spec: DeviceSpec) -> Iterable[Case]:
    """The device type and the identity: a variable and a record that every device has."""
    for index in (0x1000, 0x1018):
        if spec.entry(index) is not None and spec.entry(index, STRUCTURE) is None:
            yield Case(address(index, STRUCTURE), spec.entries[index, 0], "")


@requirement("SDO-21", level="shall", cases=("entry", _structured), source=f"{CIA301}, 7.4.4")
def test_structure_of_an_object_is_told_or_absent(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """Sub-index FFh does not exist, or tells the object code and the data type of its object."""
    transfer = node.sdo.upload(entry.index, STRUCTURE)

    verdict.holds(
        f"upload of {address(entry.index, STRUCTURE)}",
        expected="an abort as not existing, or object code and data type",
        actual=str(transfer),
        ok=transfer.abort in cases.NO_SUB_INDEX or _tells(entry, transfer.data or b""),
    )


def _tells(entry: Entry, data: bytes) -> bool:
    """Tell whether sub-index FFh is right: object code, data type, two octets 0."""
    if len(data) != EXPEDITED or data[2:] != bytes(2):
        return False
    if entry.in_record:
        return data[0] in (ARRAY, RECORD)
    return data[0] == VARIABLE and data[1] == entry.type


def _server(spec: DeviceSpec) -> Iterable[Case]:
    yield Case("server", None, _answers_source(spec))


@requirement("SDO-22", level="should", cases=_server, source=f"{CIA301}, 7.5.2.33")
def test_there_is_no_undocumented_sdo_server(node: Node, verdict: Verdict) -> None:
    """There are no SDO servers beside the documented ones."""
    indices = [index for index in FURTHER_SERVERS if node.spec.entry(index) is None]

    answers = {index: node.sdo.upload(index, 1) for index in indices}

    found = [
        f"{address(i, 1)}: {it}" for i, it in answers.items() if it.abort not in cases.NO_OBJECT
    ]
    verdict.holds(
        f"undocumented objects {address(indices[0])} to {address(indices[-1])}",
        expected="none",
        actual="; ".join(found) or "none",
        ok=not found,
    )
