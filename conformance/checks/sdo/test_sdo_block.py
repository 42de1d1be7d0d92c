"""SDO block transfer: carried out, or refused by a server that has none (CiA 301 v4.2.0, 7.2.4.3.8 to .16)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.node.sdo_block import BlockPort
from conformance.checks import cases
from conformance.checks.sdo.transfers import (
    NO_BLOCKS,
    held_and_new,
    judge_abort,
    judge_holds,
    judge_recovery,
    longest,
    must_have_blocks,
    needs_segments,
)
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode, describe

SDO = f"{CIA301}, 7.2.4.3"
NO_SEGMENT = 128
"""One more than a block may have."""
FIXED = ("identity", "constant")


@dataclass(frozen=True, slots=True)
class BlockUpload:
    """What to upload in blocks, and whether to ask for a CRC."""

    entry: Entry
    crc: bool


def _uploads(spec: DeviceSpec) -> Iterable[Case]:
    """A number and what takes more than one frame, that with and without a CRC."""
    fixed = [
        entry
        for entry in spec.entries.values()
        if entry.kind in FIXED and cases.readable(entry, spec) and not entry.optional
    ]
    numbers = [entry for entry in fixed if entry.type.is_integer]
    texts = [entry for entry in fixed if needs_segments(entry, spec)]
    for entry in (*numbers[:1], *texts[:1]):
        yield Case(entry.address, BlockUpload(entry, crc=False), "")
    for entry in texts[:1]:
        yield Case(f"{entry.address}/crc", BlockUpload(entry, crc=True), "")


@requirement("SDO-30", level="shall", cases=("what", _uploads), source=f"{SDO}.12, 7.2.4.3.17")
def test_block_upload_is_carried_out_or_refused(
    node: Node, what: BlockUpload, verdict: Verdict
) -> None:
    """A block upload delivers what another upload does, or is refused by a server that has none."""
    held = node.upload(*what.entry.key)

    transfer = BlockPort(node.channel).upload(*what.entry.key, crc=what.crc)

    data = held.hex(" ").upper()
    _judge(node, transfer, f"confirmed ({data})", verdict, done=transfer.data == held)
    judge_recovery(node, verdict)


@requirement(
    "SDO-31",
    level="shall",
    cases=("entry", longest),
    source=f"{SDO}.8, 7.2.4.3.17",
    effects=("reads", "writes"),
)
def test_block_download_is_carried_out_or_refused(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A block download is carried out, or refused by a server that has none."""
    held, new = held_and_new(node, entry)

    transfer = BlockPort(node.channel).download(*entry.key, new)

    _judge(node, transfer, "confirmed", verdict, done=transfer.confirmed)
    judge_holds(node, entry, new if transfer.confirmed else held, verdict)


def _judge(node: Node, transfer: Transfer, expected: str, verdict: Verdict, *, done: bool) -> None:
    refusals = () if must_have_blocks(node.spec) else NO_BLOCKS
    verdict.holds(
        "block transfer",
        expected=" or ".join((expected, *(f"abort {describe(code)}" for code in refusals))),
        actual=str(transfer),
        ok=done or transfer.abort in refusals,
    )


def _block_sizes(spec: DeviceSpec) -> Iterable[Case]:
    for upload in list(_uploads(spec))[:1]:
        for size in (0, 128):
            yield Case(f"{upload.label}/{size}", (upload.subject.entry, size), "")


@requirement("SDO-32", level="shall", cases=("what", _block_sizes), source=f"{SDO}.13, 7.2.4.3.17")
def test_wrong_block_size_is_refused(node: Node, what: tuple[Entry, int], verdict: Verdict) -> None:
    """A block upload in blocks of other than 1 to 127 segments is refused."""
    entry, size = what

    transfer = BlockPort(node.channel).upload(*entry.key, block_size=size)

    codes = (AbortCode.INVALID_BLOCK_SIZE, *NO_BLOCKS)
    judge_abort(f"block upload in blocks of {size}", transfer, verdict, *codes)
    judge_recovery(node, verdict)


def _number(spec: DeviceSpec) -> Iterable[Case]:
    for upload in list(_uploads(spec))[:1]:
        yield Case(upload.label, upload.subject.entry, "")


@requirement("SDO-33", level="shall", cases=("entry", _number), source=f"{SDO}.14, 7.2.4.3.17")
def test_acknowledged_segment_that_never_came_is_refused(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A block upload whose client acknowledges a segment beyond the block is aborted."""
    transfer = BlockPort(node.channel).upload_acknowledging(*entry.key, NO_SEGMENT)

    codes = (AbortCode.INVALID_SEQUENCE_NUMBER, *NO_BLOCKS)
    judge_abort(f"acknowledgement of segment {NO_SEGMENT}", transfer, verdict, *codes)
    judge_recovery(node, verdict)
