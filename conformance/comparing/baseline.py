"""The baseline: deviations that are known, whose they are, why they may be, and until when."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import date, timedelta
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, StringConstraints

from conformance.errors import BenchError, Problem, SpecError
from conformance.spec.validation import validate
from conformance.spec.yaml_reader import read_yaml

FIRST_TERM: Final = timedelta(days=90)
"""For how long a deviation is known in a baseline that the suite writes."""


def _a_date(text: str) -> str:
    try:
        date.fromisoformat(text)
    except ValueError as error:
        raise ValueError(f"expected a date such as 2027-01-31, got {text!r}") from error
    return text


Words = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]


class KnownDeviation(BaseModel):
    """A deviation that is known.

    Args:
        item: Id of the item that deviates.
        owner: Who looks after it.
        reason: Why it may be.
        expires: The last day on which it may be.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    item: Words
    owner: Words
    reason: Words
    expires: Annotated[str, AfterValidator(_a_date)]

    def holds(self, today: date) -> bool:
        """Tell whether it has not expired."""
        return today <= date.fromisoformat(self.expires)


class _Content(BaseModel):
    """A baseline file."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    format: Literal[1]
    deviations: list[KnownDeviation]


@dataclass(frozen=True, slots=True)
class Baseline:
    """What is known, by item id, on a day."""

    entries: dict[str, KnownDeviation]
    today: date

    def known(self, item: str) -> str:
        """Return who knows an item's deviation, why and until when; empty if it does not count as known."""
        entry = self.entries.get(item)
        if entry is None or not entry.holds(self.today):
            return ""
        return f"{entry.owner}: {entry.reason} (until {entry.expires})"

    def expired(self, items: Iterable[str]) -> list[KnownDeviation]:
        """Return the entries of some items that have expired."""
        found = (self.entries.get(item) for item in items)
        return [it for it in found if it is not None and not it.holds(self.today)]


def load_baseline(path: Path, today: date) -> Baseline:
    """Return the baseline in a file.

    Raises:
        SpecError: With every problem of the file.
    """
    yaml = read_yaml(path)
    if yaml.data is None:
        raise SpecError(Problem(path, 0, "", "expected a baseline, got an empty file"))
    content, problems = validate(_Content, yaml)
    if content is None or yaml.problems:
        raise SpecError(*yaml.problems, *problems)
    entries: dict[str, KnownDeviation] = {}
    for number, entry in enumerate(content.deviations):
        if entry.item in entries:
            text = f"expected each item once, got {entry.item!r} again"
            raise SpecError(yaml.problem(("deviations", number, "item"), text))
        entries[entry.item] = entry
    return Baseline(entries, today)


def write_baseline(path: Path, items: Iterable[str], today: date) -> None:
    """Write a baseline of some items, owner and reason of each left to be filled in.

    Raises:
        SpecError: The file is there already: what people wrote there is not written over.
        BenchError: The disk does not take it.
    """
    lines = ["# Fill in owner and reason of each; `expires` is the last day on which it may be.\n"]
    lines += ["format: 1\n", "deviations:\n"]
    expires = (today + FIRST_TERM).isoformat()
    lines += [
        f'  - item: {json.dumps(item)}\n    owner: ""\n    reason: ""\n    expires: "{expires}"\n'
        for item in items
    ]
    if len(lines) == 3:
        lines[-1] = "deviations: []\n"
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.writelines(lines)
    except FileExistsError as error:
        raise SpecError(f"{path}: expected a new file, got one that is there") from error
    except OSError as error:
        raise BenchError(f"cannot write {path}: {error.strerror}") from error
