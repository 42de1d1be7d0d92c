"""An inspection read back for its certificate: `lot.json` of this suite, an older or a newer one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from conformance.errors import Problem, SpecError
from conformance.report.printable import printable

NAME = "lot.json"
MOST_OF_A_REASON = 600
"""Characters that are shown of it."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class _Try(_Part):
    folder: str
    verdict: str


class _Declared(_Part):
    by: str
    reason: str
    when: str


class _Unit(_Part):
    unit: int
    verdict: str | None
    tries: Sequence[_Try] = ()
    declared: Sequence[_Declared] = ()

    @property
    def telling(self) -> _Try | None:
        return next((it for it in reversed(self.tries) if it.verdict == self.verdict), None)


class _Lot(_Part):
    part: str
    order: str
    serials: Sequence[int] | None = None


class _Verdict(_Part):
    word: str
    reason: str
    waiting: int


class _Content(_Part):
    lot: _Lot
    units: Sequence[_Unit]
    verdict: _Verdict


@dataclass(frozen=True, slots=True)
class Inspected:
    """An inspection.

    Args:
        title: Of its lot.
        verdict: What became of the lot, in a sentence.
        records: Folder of the run that each unit's verdict comes from.
        declared: Units that a person declared nonconforming, a sentence each.
        waiting: Units that were drawn and not judged.
    """

    title: str
    verdict: str
    records: Sequence[Path]
    declared: Sequence[str]
    waiting: int


def read_inspected(folder: Path) -> Inspected:
    """Read an inspection.

    Raises:
        SpecError: The file is damaged, or nothing was judged.
    """
    path = folder / NAME
    try:
        content = _Content.model_validate(json.loads(path.read_bytes()))
    except OSError as error:
        raise SpecError(f"{path}: expected a readable file, got: {error.strerror}") from error
    except (ValidationError, ValueError, RecursionError) as error:
        text = "expected the state of an inspection with its verdict, got what is none"
        raise SpecError(Problem(path, 0, "", text)) from error
    told = [(unit, unit.telling) for unit in content.units]
    records = [folder / it.folder for _, it in told if it is not None]
    declared = [
        _sentence(unit, "Serial" if content.lot.serials else "Place")
        for unit, it in told
        if it is None and unit.verdict == "nonconforming" and unit.declared
    ]
    if not records:
        raise SpecError(f"{path}: units: expected one with a run, got none that tells its verdict")
    return Inspected(
        title=f"{content.lot.part}, {content.lot.order}",
        verdict=f"Lot {content.verdict.word}: {content.verdict.reason}.",
        records=records,
        declared=declared,
        waiting=content.verdict.waiting,
    )


def _sentence(unit: _Unit, what: str) -> str:
    last, tried = unit.declared[-1], len(unit.tries)
    runs = f"{tried} run{'' if tried == 1 else 's'} of it decided nothing" if tried else "no run"
    return (
        f"{what} {unit.unit}: declared nonconforming by {printable(last.by)}, {printable(last.when)}: "
        f"{printable(last.reason, MOST_OF_A_REASON)} (not measured; {runs})."
    )
