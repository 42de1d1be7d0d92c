"""What the trials of a device show: defects killed, checks that see any, and who is accused wrongly."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from conformance.mutants.defect import Defect
from conformance.mutants.trial import Outcome

Fate: TypeAlias = Literal["killed", "survived", "open", "equivalent"]


@dataclass(frozen=True, slots=True)
class Row:
    """One defect's row of the matrix.

    Args:
        outcome: What the suite said.
        fate: ``killed``: an item failed; ``open``: none did, but not all passed either;
            ``equivalent``: no bus shows it.
        why: Why no bus shows it.
        right: The first item that failed names the defect's own object and requirement.
        unrelated: How many of the items that failed do not.
    """

    outcome: Outcome
    fate: Fate
    why: str
    right: bool
    unrelated: int

    @property
    def wrongly_equivalent(self) -> bool:
        """It is said that no bus shows it, and a check saw it."""
        return self.fate == "equivalent" and bool(self.outcome.failed)


def row(outcome: Outcome, why: str) -> Row:
    """Return the row of an outcome.

    Args:
        outcome: What the suite said.
        why: Why no bus shows the defect; empty where one does.
    """
    failed = outcome.failed
    related = [item for item in failed if names(outcome.defect, item)]
    fate: Fate = "killed" if failed else "open" if outcome.open or outcome.aborted else "survived"
    return Row(
        outcome=outcome,
        fate="equivalent" if why else fate,
        why=why,
        right=bool(failed) and failed[0] in related,
        unrelated=len(failed) - len(related),
    )


def names(defect: Defect, item: str) -> bool:
    """Tell whether an item's id names a defect's own object and requirement."""
    _, requirement, label = f"{item}/".split("/", 2)
    if defect.seen_by and not requirement.startswith(defect.seen_by):
        return False
    if defect.key is None:
        return True
    return any(f"{index:04X}h" in label for index in (defect.key[0], *defect.related))


@dataclass(frozen=True, slots=True)
class Matrix:
    """The rows of one device, and how many items each requirement has there."""

    rows: tuple[Row, ...]
    requirements: Mapping[str, int]

    def count(self, fate: Fate) -> int:
        """Return how many defects have a fate."""
        return sum(row.fate == fate for row in self.rows)

    @property
    def kills(self) -> Counter[str]:
        """How many defects each requirement saw."""
        return Counter(name for row in self.rows for name in _requirements(row.outcome.failed))

    @property
    def first(self) -> Counter[str]:
        """How many defects each requirement was the first to see."""
        return Counter(name for row in self.rows for name in _requirements(row.outcome.failed[:1]))

    @property
    def accused(self) -> Counter[str]:
        """How often each requirement failed beside a defect that is not its own."""
        return Counter(
            name
            for row in self.rows
            for name in _requirements(
                item for item in row.outcome.failed if not names(row.outcome.defect, item)
            )
        )

    @property
    def summary(self) -> dict[str, Any]:
        """The totals."""
        killed = [row for row in self.rows if row.fate == "killed"]
        return {
            "defects": len(self.rows),
            "killed": len(killed),
            "survived": self.count("survived"),
            "open": self.count("open"),
            "equivalent": self.count("equivalent"),
            "wrongly_equivalent": sum(row.wrongly_equivalent for row in self.rows),
            "first_right": sum(row.right for row in killed),
            "accused_wrongly": sum(not row.right for row in killed),
            "unrelated_items": sum(row.unrelated for row in killed),
            "requirements": len(self.requirements),
            "requirements_without_kill": sorted(self.requirements.keys() - self.kills.keys()),
        }

    def to_json(self) -> dict[str, Any]:
        """Return the matrix as data."""
        kills, first, accused = self.kills, self.first, self.accused
        return {
            "summary": self.summary,
            "requirements": {
                name: {
                    "items": items,
                    "kills": kills[name],
                    "first": first[name],
                    "beside_others": accused[name],
                }
                for name, items in sorted(self.requirements.items())
            },
            "defects": [_to_json(row) for row in self.rows],
        }


def _requirements(items: Iterable[str]) -> set[str]:
    return {item.split("/", 2)[1] for item in items}


def _to_json(row: Row) -> dict[str, Any]:
    outcome, defect = row.outcome, row.outcome.defect
    return {
        "id": defect.id,
        "what": defect.what,
        "area": defect.area,
        "attribute": defect.attribute,
        "faults": list(defect.faults),
        "seen_by": list(defect.seen_by),
        "fate": row.fate,
        "why": row.why,
        "first_right": row.right,
        "unrelated": row.unrelated,
        "failed": list(outcome.failed),
        "open": dict(outcome.open),
        "aborted": outcome.aborted,
        "items": outcome.items,
        "seconds": round(outcome.seconds, 3),
    }
