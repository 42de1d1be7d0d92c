"""What a run would do, before anything is opened or sent: `run --dry-run`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from conformance.effects import WEARING, Effect, Need
from conformance.report.console import Terminal


@dataclass(frozen=True, slots=True)
class Planned:
    """One item before it is run.

    Args:
        requirement: Its id.
        effects: What it may do to the node.
        needs: What it needs beside a bus.
        at_need: What it may do beyond that, if the node turns out to need it.
        reason: Why it would be skipped, empty if it would not.
    """

    requirement: str
    effects: tuple[Effect, ...]
    needs: tuple[Need, ...]
    at_need: tuple[Effect, ...]
    reason: str


def print_plan(plan: Sequence[Planned], most_writes: int | None, terminal: Terminal) -> None:
    """Print what would be run, by what it may do, and what would be skipped, and why.

    Args:
        plan: Every item that applies to the device.
        most_writes: The bench's bound on writes of the non-volatile memory.
        terminal: Where to.
    """
    left = [it for it in plan if not it.reason]
    groups: dict[tuple[str, str, str], list[str]] = {}
    for it in left:
        may = (", ".join(it.effects), ", ".join(it.at_need), ", ".join(it.needs))
        groups.setdefault(may, []).append(it.requirement)
    heads = ("items", "may do", "at need", "need", "requirements")
    rows = [
        (str(len(ids)), *may, ", ".join(dict.fromkeys(ids)))
        for may, ids in sorted(groups.items(), key=lambda group: -len(group[1]))
    ]
    terminal.table(heads, rows)
    terminal.say()
    for reason, count in Counter(it.reason for it in plan if it.reason).items():
        ids = ", ".join(dict.fromkeys(it.requirement for it in plan if it.reason == reason))
        terminal.say(f"would be skipped, {count}: {reason} ({ids})")
    wearing = sum(not WEARING.isdisjoint((*it.effects, *it.at_need)) for it in left)
    bound = f"; none of them begins after {most_writes} writes" if most_writes is not None else ""
    terminal.say(f"items that may write the node's non-volatile memory: {wearing}{bound}")
    terminal.say(f"{len(left)} of {len(plan)} items would be run; nothing was sent")
