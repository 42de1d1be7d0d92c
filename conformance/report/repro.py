"""How to see one item of a record again: the command that runs it alone, and the frames it took.

Both are made from the record of a run, so that it can be done later and elsewhere.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from conformance.errors import BenchError
from conformance.wire import cob_id

PAUSE_S = 0.02
"""A pause before a frame of the bench that is shorter than this is left out."""

_LINE = re.compile(r"\((\d+\.\d+)\) \S+ (\S+) ([RT])")
_SLICE = re.compile(r"trace\.log:(\d+)-(\d+)")
_NODE_ID = 0x7F
_OF_NOBODY = range(0x680, 0x700)
"""CAN-IDs that no service has by default; a check gives them to PDOs and EMCY."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """A line of the trace.

    Args:
        time_s: When, on the bench's clock.
        frame: As in candump's log: ``632#4000100000000000``.
        sent: The bench sent it.
    """

    time_s: float
    frame: str
    sent: bool

    @property
    def can_id(self) -> int:
        """Its identifier."""
        return int(self.frame.partition("#")[0], 16)

    @property
    def data(self) -> bytes:
        """Its data; none of a remote frame."""
        data = self.frame.partition("#")[2]
        return b"" if data.startswith("R") else bytes.fromhex(data)


def command(arguments: Sequence[str], identifier: str) -> str:
    """Return the line that runs one item again, quoted for a shell.

    Args:
        arguments: Of the run, as in its record.
        identifier: Of the item.
    """
    return shlex.join(["canopen-conformance", "run", *arguments, "--select", identifier])


def script(folder: Path, identifier: str) -> str:
    """Return the frames of one item as `cansend` lines, what came and what was expected as comments.

    Args:
        folder: Of the run's record.
        identifier: Of the item.

    Raises:
        BenchError: The record cannot be read, or has no such item.
    """
    try:
        record = json.loads((folder / "results.json").read_text("utf-8"))
        trace = (folder / "trace.log").read_text("ascii").splitlines()
    except (OSError, ValueError) as error:
        raise BenchError(f"cannot read the record in {folder}: {error}") from error
    item = next((it for it in record["items"] if it["id"] == identifier), None)
    if item is None:
        raise BenchError(f"the record in {folder} has no item {identifier}")
    lines = [f"# {item['id']}: {item['sentence']}"]
    lines.append(f"# {command(record['run']['arguments'], identifier)}")
    lines += _frames(item, [_recorded(line) for line in trace], record["device"]["node_id"])
    lines += _judged(item)
    return "\n".join(lines)


def _frames(item: Mapping[str, Any], trace: Sequence[Recorded], node_id: int) -> Iterator[str]:
    """Return the frames of an item, what only prepares and ends it told apart."""
    place = _SLICE.fullmatch(item["trace"])
    if place is None:
        yield "# no frame"
        return
    first, last = int(place[1]) - 1, int(place[2])
    begins = max(item["begins"] - 1, first)
    nodes = {node_id, *_addressed(trace[first:last])}
    for title, part in (("set-up", trace[first:begins]), ("the check", trace[begins:last])):
        if part:
            yield f"# {title}"
            yield from _sendable([it for it in part if it.sent or _is_of(it, nodes)])


def _addressed(frames: Iterable[Recorded]) -> Iterator[int]:
    """Return the node-IDs that the bench asks something."""
    for it in frames:
        if it.sent and it.can_id & ~_NODE_ID == cob_id.sdo_request(1) & ~_NODE_ID:
            yield it.can_id & _NODE_ID


def _is_of(received: Recorded, nodes: set[int]) -> bool:
    """Tell whether a frame may come from one of some nodes, and not from another one on the bus."""
    can_id = received.can_id
    return can_id & _NODE_ID in nodes or can_id in _OF_NOBODY or can_id == cob_id.LSS_SLAVE


def _sendable(frames: Iterable[Recorded]) -> Iterator[str]:
    """Return frames of the bench as commands, those of others as comments."""
    sent_s: float | None = None
    for (sent, can_id), group in groupby(
        frames, lambda it: (it.sent, None if it.sent else it.can_id)
    ):
        several = list(group)
        if not sent:
            yield f"#   got {several[0].frame}"
            if len(several) > 1:
                more = f"{len(several) - 1} more" if len(several) > 2 else "another"
                yield f"#   got {more} on {can_id:03X}, at last {several[-1].frame}"
            continue
        for it in several:
            pause_s = 0.0 if sent_s is None else it.time_s - sent_s
            if pause_s >= PAUSE_S:
                yield f"sleep {pause_s:.3f}"
            yield f"cansend can0 {it.frame}"
            sent_s = it.time_s


def _judged(item: Mapping[str, Any]) -> Iterator[str]:
    """Return what was expected and what came: all that failed, else what decided."""
    judged = item["deviations"] or ([item] if item["expected"] else [])
    for it in judged:
        yield f"# {it['quantity']}"
        yield f"#   expected: {it['expected']}"
        yield f"#   got:      {it['actual']}"
    reason = f" ({item['reason']})" if item["reason"] else ""
    yield f"# {item['verdict'].replace('_', ' ')}{reason}"


def _recorded(line: str) -> Recorded:
    parts = _LINE.fullmatch(line)
    if parts is None:
        raise BenchError(f"expected a line of a trace, got {line!r}")
    return Recorded(float(parts[1]), parts[2], parts[3] == "T")
