"""SDO transfers step by step: what to download, and what is left when one is broken off."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import PROBE, Node
from conformance.bench.node.sdo import Answer, Transfer
from conformance.bench.settings.second_values import can_be_set, is_cob_id, second_values
from conformance.checks import cases
from conformance.checks.steps import own_value
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case
from conformance.spec.document import SdoServer
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire import sdo
from conformance.wire.abort import AbortCode, describe

EXPEDITED = 4
"""Octets of an expedited transfer."""
SEGMENT = 7
"""Octets of a segment."""
NO_SEGMENTS = (
    AbortCode.UNKNOWN_COMMAND_SPECIFIER,
    AbortCode.UNSUPPORTED_ACCESS,
    AbortCode.GENERAL_ERROR,
)
"""How a server says that it has no download in segments."""

NO_BLOCKS = (AbortCode.UNKNOWN_COMMAND_SPECIFIER, AbortCode.GENERAL_ERROR)
"""How a server says that it has no block transfer."""


def one_per_size(spec: DeviceSpec) -> Iterable[Case]:
    """One setting of each length that has a second value and no effect of its own."""
    chosen: dict[int, Entry] = {}
    for entry in spec.entries.values():
        if entry.type.size is not None and _is_plain(entry, spec):
            chosen.setdefault(entry.type.size, entry)
    for _, entry in sorted(chosen.items()):
        yield Case(entry.address, entry, entry.source_of("type"))


def up_to_four_octets(spec: DeviceSpec) -> Iterable[Case]:
    """One setting of each length that fits an expedited transfer."""
    return (case for case in one_per_size(spec) if case.subject.type.size <= EXPEDITED)


def longest(spec: DeviceSpec) -> Iterable[Case]:
    """The longest of these settings."""
    return list(one_per_size(spec))[-1:]


def longest_expedited(spec: DeviceSpec) -> Iterable[Case]:
    """The longest of those that fit an expedited transfer."""
    return list(up_to_four_octets(spec))[-1:]


def _is_plain(entry: Entry, spec: DeviceSpec) -> bool:
    bound = entry.writable_while or spec.partner(entry.key) is not None or cases.reach(entry, spec)
    return (
        cases.writable(entry, spec)
        and can_be_set(entry, spec)
        and entry.effective == "at-once"
        and not bound
        and not cases.is_pdo_object(entry, spec)
        and not is_cob_id(entry, spec)
    )


def held_and_new(node: Node, entry: Entry) -> tuple[bytes, bytes]:
    """Return what a setting holds, and what else it takes; whatever it gets is undone.

    What fits an expedited transfer was taken in one before, and what is held is not 0.

    Raises:
        SetupRefused: There is no other value, or the node does not take it.
    """
    own = own_value(node, entry)
    other = second_values(node.spec, {entry.key: own}, default_will_do=True).get(entry.key)
    if other is None:
        raise SetupRefused(f"{entry.address} has no other value to try")
    node.will_change(*entry.key)
    if len(own) > EXPEDITED:
        return own, other
    held, new = (own, other) if any(own) else (other, own)
    for data in (new, held):
        transfer = node.write(*entry.key, data)
        if not transfer.confirmed:
            raise SetupRefused(f"{entry.address} does not take a value ({transfer}), see OD-11")
    return held, new


# Uploads in segments


def may_need_segments(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what needs, or may need, more than one frame."""
    sizes = {reading.type.size for reading in entry.readings}
    return cases.readable(entry, spec) and all(it is None or it > EXPEDITED for it in sizes)


def needs_segments(entry: Entry, spec: DeviceSpec) -> bool:
    """Pick what surely needs more than one frame."""
    size, value = entry.type.size, entry.default_value
    if size is None and value is not None:
        size = len(entry.type.encode(value))
    return may_need_segments(entry, spec) and (size or 0) > EXPEDITED


def begin_upload(node: Node, entry: Entry) -> None:
    """Begin an upload in segments.

    Raises:
        SetupRefused: It does not come in segments.
    """
    answer = node.sdo.ask(sdo.InitiateUpload(*entry.key))
    reply = answer.response
    if not isinstance(reply, sdo.InitiateUploadReply) or reply.expedited:
        raise SetupRefused(f"{entry.address} is not uploaded in segments ({answer})")


def expedited_commands(entry: Entry) -> tuple[int, int]:
    """Return the commands of an expedited answer that tells its length, and of one that does not."""
    size = entry.type.size or EXPEDITED
    reply = sdo.InitiateUploadReply(*entry.key, bytes(size))
    untold = sdo.InitiateUploadReply(*entry.key, bytes(size), size=None)
    return sdo.encode(reply)[0], sdo.encode(untold)[0]


# Downloads in segments, which a server may have or not


def may_refuse_segments(spec: DeviceSpec) -> bool:
    """Tell whether a server may be without download in segments: no object surely needs it."""
    if any(not _server(it.sdo_server).segmented_download for it, _ in spec.services_readings):
        return True
    return not any(
        all(_is_long(reading) for reading in entry.readings)
        for entry in spec.entries.values()
        if cases.present(entry, spec)
    )


def must_have_blocks(spec: DeviceSpec) -> bool:
    """Tell whether the server has block transfer by every reading."""
    return all(_server(services.sdo_server).block for services, _ in spec.services_readings)


def _is_long(entry: Entry) -> bool:
    least = entry.octets[0] if entry.octets else 0
    return entry.writable and (entry.type.size or least) > EXPEDITED


def _server(server: SdoServer | None) -> SdoServer:
    return SdoServer(source=CIA301) if server is None else server


def follow(node: Node, verdict: Verdict, attribute: str, value: object) -> None:
    """Note which reading has the SDO server so, where the judged one has it otherwise."""
    for services, other in node.spec.services_readings:
        if getattr(_server(services.sdo_server), attribute) == value:
            if other is not None:
                verdict.follows(other.ambiguity, other.reading)
            return


def announced(node: Node, entry: Entry, size: int, verdict: Verdict) -> bool:
    """Begin a download in segments; a server that has none may say so, which is judged.

    Raises:
        SetupRefused: The server neither begins nor properly refuses.
    """
    answer = node.sdo.ask(sdo.InitiateDownload(*entry.key, expedited=False, size=size))
    if isinstance(answer.response, sdo.InitiateDownloadAck):
        return True
    if not may_refuse_segments(node.spec) or answer.code not in NO_SEGMENTS:
        raise SetupRefused(f"no download in segments to {entry.address} ({answer}), see SDO-09")
    verdict.holds(
        f"download in segments to {entry.address}",
        expected="60h, or an abort",
        actual=str(answer),
        ok=True,
    )
    return False


# What is left


def judge_holds(node: Node, entry: Entry, data: bytes, verdict: Verdict) -> None:
    """Judge what an entry holds."""
    transfer = node.sdo.upload(*entry.key)
    held = transfer.data if transfer.sized else (transfer.data or b"")[: len(data)]
    verdict.holds(
        f"value of {entry.address} afterwards",
        expected=data.hex(" ").upper(),
        actual=str(transfer),
        ok=held == data,
    )


def judge_abort(what: str, answer: Answer | Transfer, verdict: Verdict, *codes: AbortCode) -> None:
    """Judge that something was answered with an abort, with one of some codes or the general one."""
    allowed = tuple(dict.fromkeys((*codes, AbortCode.GENERAL_ERROR)))
    code = answer.code if isinstance(answer, Answer) else answer.abort
    verdict.holds(
        what,
        expected=" or ".join(f"abort {describe(it)}" for it in allowed) if codes else "an abort",
        actual=str(answer),
        ok=code is not None and (not codes or code in allowed),
    )


def judge_recovery(node: Node, verdict: Verdict) -> None:
    """Judge that the next transfer is served."""
    transfer = node.sdo.upload(*PROBE)
    verdict.holds(
        "the next upload", expected="confirmed", actual=str(transfer), ok=transfer.confirmed
    )
