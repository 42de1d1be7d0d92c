"""The journal of a run: what the node held before anything was written to it, safe on disk."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, TypeAlias

from conformance.bench.given_back.safe_file import write_safely
from conformance.errors import Problem, SpecError
from conformance.spec.model import Key

NAME: Final = "journal.json"
FORMAT: Final = 1

Held: TypeAlias = Mapping[Key, bytes | str]
"""What settings hold, or in words why they do not tell."""


@dataclass(frozen=True, slots=True)
class Found:
    """The node as it was found.

    Args:
        held: What its settings held.
        stored: What they held after a reset, which is what is stored; None while that is not known.
        nmt_state: As heartbeats show it; empty where none can.
        had_no_errors: Its error history was empty.
        offsets: What the offsets of slopes held that only a preset changes.
    """

    held: Held
    stored: Held | None = None
    nmt_state: str = ""
    had_no_errors: bool = False
    offsets: Mapping[Key, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Journal:
    """A run and what it found.

    Args:
        device: Path of the spec.
        variant: Of the device.
        bench: Path of the bench's file.
        channel: Of the bench; None where it has none.
        node_id: Where the node was.
        bitrate: In bit/s.
        serial: Serial number that the user gave.
        found: What was found.
        given_back: It has been given back, and was looked at.
    """

    device: str
    variant: str
    bench: str
    node_id: int
    bitrate: int
    serial: str = ""
    channel: str | int | None = None
    found: Found = field(default_factory=lambda: Found({}))
    given_back: bool = False

    def keep(self, path: Path, found: Found, *, given_back: bool = False) -> None:
        """Write the journal, so that it outlives this process and the computer.

        Raises:
            BenchError: It cannot be written.
        """
        data = _to_json(replace(self, found=found, given_back=given_back))
        write_safely(path, json.dumps(data, indent=1))


def load_journal(path: Path) -> Journal:
    """Return the journal in a file, or in the folder of a run.

    Raises:
        SpecError: There is none, or it is damaged.
    """
    file = path / NAME if path.is_dir() else path
    try:
        data = json.loads(file.read_text("ascii"))
    except OSError as error:
        raise SpecError(
            f"JOURNAL: expected the folder of a run or its {NAME}, got {str(path)!r} "
            f"({error.strerror})"
        ) from error
    except ValueError as error:
        raise SpecError(Problem(file, 0, "", f"expected a journal, got {error}")) from error
    try:
        return _from_json(data)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SpecError(
            Problem(file, 0, "", f"expected a journal of format {FORMAT}, got something else")
        ) from error


def _to_json(journal: Journal) -> dict[str, Any]:
    found = journal.found
    return {
        "format": FORMAT,
        "device": journal.device,
        "variant": journal.variant,
        "bench": journal.bench,
        "channel": journal.channel,
        "node_id": journal.node_id,
        "bitrate": journal.bitrate,
        "serial": journal.serial,
        "given_back": journal.given_back,
        "nmt_state": found.nmt_state,
        "had_no_errors": found.had_no_errors,
        "offsets": {_name(key): value for key, value in found.offsets.items()},
        "held": _shown(found.held),
        "stored": None if found.stored is None else _shown(found.stored),
    }


def _from_json(data: Mapping[str, Any]) -> Journal:
    if data["format"] != FORMAT:
        raise ValueError(data["format"])
    found = Found(
        held=_read(data["held"]),
        stored=None if data["stored"] is None else _read(data["stored"]),
        nmt_state=str(data["nmt_state"]),
        had_no_errors=bool(data["had_no_errors"]),
        offsets={_key(name): int(value) for name, value in data["offsets"].items()},
    )
    return Journal(
        device=str(data["device"]),
        variant=str(data["variant"]),
        bench=str(data["bench"]),
        channel=_channel(data.get("channel")),
        node_id=int(data["node_id"]),
        bitrate=int(data["bitrate"]),
        serial=str(data["serial"]),
        found=found,
        given_back=bool(data["given_back"]),
    )


def _channel(given: object) -> str | int | None:
    if given is None or isinstance(given, str | int):
        return given
    raise TypeError(given)


def _shown(held: Held) -> dict[str, Any]:
    return {
        _name(key): {"hex": data.hex()} if isinstance(data, bytes) else {"why": data}
        for key, data in held.items()
    }


def _read(held: Mapping[str, Mapping[str, str]]) -> Held:
    return {
        _key(name): bytes.fromhex(it["hex"]) if "hex" in it else str(it["why"])
        for name, it in held.items()
    }


def _name(key: Key) -> str:
    return f"0x{key[0]:04X}:{key[1]:02X}"


def _key(name: str) -> Key:
    index, _, sub = name.partition(":")
    return int(index, 16), int(sub, 16)
