"""The seal of a record, `seal.json`: tells later whether record, trace and reports are still the same.

It shows what was changed by mistake, or by somebody who left the seal as it was. Whoever may write to the
folder can seal it anew: a seal that must hold against that is noted down elsewhere, by its own hash.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from conformance.errors import BenchError, SpecError

NAME: Final = "seal.json"
RECORD: Final = "results.json"
TRACE: Final = "trace.log"
CERTIFICATE: Final = "certificate.pdf"
SEALED: Final = (RECORD, TRACE, "junit.xml", "report.html", CERTIFICATE)
"""What a seal is about, as far as it is there."""

_DIGEST: Final = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True, slots=True)
class Verified:
    """What came of looking at a sealed record.

    Args:
        seal: Hash of the seal itself.
        same: Files that are as they were.
        problems: What is not, in a sentence each.
    """

    seal: str
    same: tuple[str, ...]
    problems: tuple[str, ...]


def digest(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal digits.

    Raises:
        BenchError: The disk does not give it.
    """
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise BenchError(f"cannot read {path}: {error.strerror or error}") from error


def write_seal(folder: Path, *names: str) -> None:
    """Seal a record.

    Args:
        folder: Of the run.
        names: The files whose hashes are taken anew; all that are there by default.

    Raises:
        BenchError: The disk does not take it.
        SpecError: There is a seal, and it is none.
    """
    files = dict(_read(folder)) if names else {}
    files |= {name: digest(folder / name) for name in names or SEALED if (folder / name).is_file()}
    path = folder / NAME
    try:
        path.write_text(json.dumps({"format": 1, "files": files}, indent=1) + "\n", "ascii")
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror or error}") from error


def seal_again(folder: Path, name: str) -> None:
    """Take a report that was made anew into the seal of its record, if that has one and is unchanged."""
    if (folder / NAME).is_file() and not verify(folder, RECORD, TRACE).problems:
        write_seal(folder, name)


def verify(folder: Path, *names: str) -> Verified:
    """Compare a record with its seal.

    Args:
        folder: Of the run.
        names: The files to look at; all that are sealed by default.

    Raises:
        SpecError: There is no seal.
        BenchError: The disk does not give a file.
    """
    same, problems = [], []
    for name, sealed in _read(folder).items():
        if names and name not in names:
            continue
        if not (folder / name).is_file():
            problems.append(f"{name} is missing")
        elif digest(folder / name) != sealed:
            problems.append(f"{name} was changed since the record was sealed")
        else:
            same.append(name)
    if RECORD in same and TRACE in same:
        recorded = _trace_of(folder / RECORD)
        if recorded != digest(folder / TRACE):
            problems.append(f"{TRACE} is not the one that {RECORD} was made with")
    return Verified(digest(folder / NAME), tuple(same), tuple(problems))


def _read(folder: Path) -> Mapping[str, str]:
    path = folder / NAME
    try:
        content = json.loads(path.read_bytes())
    except OSError as error:
        got = error.strerror or error
        raise SpecError(f"{path}: expected the seal of a record, got {got}") from error
    except (ValueError, RecursionError) as error:
        raise SpecError(f"{path}: expected JSON, got what is none: {error}") from error
    files = content.get("files") if isinstance(content, dict) else None
    if not isinstance(files, dict) or RECORD not in files:
        raise SpecError(f"{path}: files: expected {RECORD} and others with their hashes, got none")
    for name, sealed in files.items():
        if name not in SEALED:
            raise SpecError(f"{path}: files: expected {', '.join(SEALED)}, got {name!r}")
        if not isinstance(sealed, str) or not _DIGEST.fullmatch(sealed):
            raise SpecError(f"{path}: files.{name}: expected 64 hexadecimal digits, got {sealed!r}")
    return files


def _trace_of(path: Path) -> Any:
    """Return the hash of the trace that a record holds, None where it holds none."""
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return None
    run = content.get("run") if isinstance(content, dict) else None
    return run.get("trace_sha256") if isinstance(run, dict) else None
