"""The README of the checks, made from the registry; ``python -m conformance.checks.reference``."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from itertools import groupby
from pathlib import Path

from conformance.checks.industry_cases import Group, load_cases
from conformance.checks.loading import load_checks
from conformance.requirements import Requirement

PATH = Path(__file__).with_name("README.md")

INTRODUCTION = """\
# Checks

Made by `python -m conformance.checks.reference`; a test says when it is out of date.

One requirement is one rule and one check, with an id that is never used again. **Level** is who demands it: *manual*, the
device's own manual, or *shall* and *should*, the standard, whose clause is the source. Effects are what a check may do to the
node, needs what it takes beside a bus; single items can have more of both, and `catalogue DEVICE` lists the items of a device.
Where a manual leaves open whether a setting acts before it was stored, and it does not, a check stores it and restarts the node
if the bench allows that.\
"""
SERVICES = {
    "BIT": "Bit rate",
    "BOOT": "Boot-up and start",
    "DEV": "What the device does by its profile",
    "EMCY": "EMCY",
    "HB": "Heartbeat",
    "ID": "Identity",
    "LED": "Lights",
    "LSS": "LSS",
    "NID": "Node-ID",
    "NMT": "NMT",
    "OD": "Object dictionary",
    "RST": "Restore",
    "SDO": "SDO",
    "STO": "Store",
    "SYNC": "SYNC",
    "TPDO": "TPDO",
}
"""Titles by the letters of the ids."""

CASES = """\
## Cases of the industry's tool

What CiA's CANopen conformance test tool asks, by the numbers of its version 3.0.3.10, and what asks the same here.\
"""


def page(checks: Iterable[Requirement], groups: Iterable[Group]) -> str:
    """Return the README as Markdown."""
    return "\n".join([INTRODUCTION, "", *_requirements(checks), CASES, "", *_cases(groups)])


def _requirements(checks: Iterable[Requirement]) -> Iterator[str]:
    ordered = sorted(checks, key=lambda check: check.id)
    for letters, group in groupby(ordered, key=lambda check: check.id.partition("-")[0]):
        yield f"## {SERVICES[letters]}"
        yield ""
        yield from _head("id", "requirement", "level", "source", "effects", "needs")
        for check in group:
            yield _row(
                check.id,
                check.sentence,
                check.level,
                check.source or "manual",
                ", ".join(check.effects) or "by item",
                ", ".join(check.needs),
            )
        yield ""


def _cases(groups: Iterable[Group]) -> Iterator[str]:
    for group in groups:
        yield f"### {group.title}"
        yield ""
        yield from _head("case", "asks", "requirements", "remark")
        for it in group.cases:
            yield _row(it.case, it.asks, ", ".join(it.covered_by), it.because or "")
        yield ""


def _head(*titles: str) -> Iterator[str]:
    yield _row(*titles)
    yield "|" + "---|" * len(titles)


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') or '-' for cell in cells)} |"


def main(path: Path) -> None:
    """Write the README to a file."""
    text = page(load_checks().values(), load_cases())
    path.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else PATH)
