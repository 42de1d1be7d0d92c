"""The tables of ISO 2859-1 for single sampling, from the data beside this module."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, get_args

from conformance.spec.yaml_reader import read_yaml

PATH: Final = Path(__file__).with_name("iso2859_1.yaml")

Severity: TypeAlias = Literal["normal", "tightened", "reduced"]
Level: TypeAlias = Literal["S-1", "S-2", "S-3", "S-4", "I", "II", "III"]

DOWN: Final = "↓"
UP: Final = "↑"


@dataclass(frozen=True, slots=True)
class MasterTable:
    """One of the tables 2-A, 2-B and 2-C.

    Args:
        name: As the standard numbers it.
        sizes: Sample size of each code letter, in the order of the letters.
        rows: What each code letter has for each AQL: an acceptance number, an arrow, or nothing (``-``).
    """

    name: str
    sizes: Mapping[str, int]
    rows: Mapping[str, tuple[str, ...]]

    def plan(self, letter: str, column: int) -> tuple[str, int]:
        """Return the code letter and acceptance number of the plan that a cell leads to.

        Args:
            letter: Of the row.
            column: Of the AQL, from 0.
        """
        letters = list(self.rows)
        place = letters.index(letter)
        while not (cell := self.rows[letters[place]][column]).isdecimal():
            place += {DOWN: 1, UP: -1}[cell]
        return letters[place], int(cell)

    def accepted_at(self, letter: str, column: int) -> int | None:
        """Return the acceptance number of a cell, None where it holds none."""
        cell = self.rows[letter][column]
        return int(cell) if cell.isdecimal() else None


@dataclass(frozen=True, slots=True)
class Tables:
    """All tables.

    Args:
        aqls: The acceptance quality limits of the columns, in percent.
        letters: Largest lot size to the code letter of each level; the last one has no largest size.
        masters: The table of each severity.
    """

    aqls: tuple[float, ...]
    letters: tuple[tuple[float, Mapping[str, str]], ...]
    masters: Mapping[Severity, MasterTable]

    def letter(self, size: int, level: Level) -> str:
        """Return the code letter of a lot of some units, at least two.

        Source: ISO 2859-1:1999, table 1.
        """
        return next(row[level] for most, row in self.letters if size <= most)


@cache
def tables() -> Tables:
    """Return the tables."""
    data: dict[str, Any] = read_yaml(PATH).data
    letters = tuple(
        (
            float("inf") if most == "more" else float(most),
            dict(zip(data["levels"], row.split(), strict=True)),
        )
        for most, row in data["letters"].items()
    )
    masters: dict[Severity, MasterTable] = {}
    for severity in get_args(Severity):
        part = data[severity]
        rows = {letter: tuple(str(row).split()) for letter, row in part["rows"].items()}
        masters[severity] = MasterTable(part["table"], part["sizes"], rows)
    return Tables(tuple(float(it) for it in data["aqls"]), letters, masters)
