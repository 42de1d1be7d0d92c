"""The catalogue as a Markdown page: requirements, statements, and what neither covers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

_SHOWN_SECTIONS = 6
_WORDS = {
    "verified": "verified on a bus",
    "power": "would need switched power",
    "stimulus": "would need a stimulus",
    "operator": "would need an operator",
    "not_visible": "not visible on a bus",
    "open": "visible, not asked for yet",
}


def to_markdown(catalogue: dict[str, Any]) -> str:
    """Return the catalogue as a Markdown page."""
    return "\n".join([*_requirements(catalogue), *_statements(catalogue), *_gaps(catalogue)])


def _requirements(catalogue: dict[str, Any]) -> Iterable[str]:
    totals = catalogue["totals"]
    yield f"# Catalogue: {catalogue['device']}, {', '.join(catalogue['variants'])}"
    yield ""
    yield (
        f"Judged against {catalogue['manual']}: {totals['requirements']} requirements, "
        f"{totals['items']} items on {totals['entries']} entries, "
        f"{totals['ambiguities']} ambiguities recorded."
    )
    yield ""
    yield "## Requirements"
    yield ""
    yield from _head(
        "id", "requirement", "level", "standard", "sections of the manual", "items", "check",
        "statements",
    )  # fmt: skip
    for r in catalogue["requirements"]:
        sections = [*r["sections"][:_SHOWN_SECTIONS]]
        sections += ["…"] if len(r["sections"]) > _SHOWN_SECTIONS else []
        yield _row(
            r["id"],
            r["sentence"],
            r["level"],
            r["source"] or "-",
            ", ".join(sections) or "-",
            len(r["items"]) or "not applicable",
            f"`{r['check']}`",
            ", ".join(r["statements"]) or "-",
        )
    yield ""


def _statements(catalogue: dict[str, Any]) -> Iterable[str]:
    yield "## Statements of the manual"
    yield ""
    if catalogue["statements_file"] is None:
        yield "There are none: no statements file stands beside the spec."
        yield ""
        return
    totals = catalogue["totals"]
    yield from _head("statements", "number")
    yield _row("all", totals["statements"])
    for status, count in totals["statements_by_status"].items():
        yield _row(_WORDS[status], count)
    yield ""
    if totals["showable"]:
        verified = totals["statements_by_status"]["verified"]
        yield (
            f"A bus, with what is switched, moved or looked at beside it, can show "
            f"{totals['showable']} statements; {verified} of them are verified "
            f"({totals['verified_percent']:g} %)."
        )
        yield ""
    yield "### Verified"
    yield ""
    yield from _head("id", "section", "statement", "requirement: check", "shown on")
    for s in catalogue["statements"]:
        if s["status"] == "verified":
            checks = (
                f"{name}: `{check.rpartition('.')[2]}`"
                for name, check in zip(s["requirements"], s["checks"], strict=True)
            )
            where = _variants(s, catalogue["variants"])
            yield _row(s["id"], s["source"], s["says"], "<br>".join(checks), where)
    yield ""
    yield "### Without a requirement"
    yield ""
    yield from _head("id", "section", "statement", "status", "reason")
    for s in catalogue["statements"]:
        if s["status"] != "verified":
            yield _row(s["id"], s["source"], s["says"], _WORDS[s["status"]], s["reason"] or "-")
    yield ""


def _variants(statement: dict[str, Any], every: list[str]) -> str:
    """Return the variants on which a statement is shown, in a word where that is all it is about."""
    about = [
        name for name in every if statement["variants"] is None or name in statement["variants"]
    ]
    return "all" if statement["shown_in"] == about else ", ".join(statement["shown_in"])


def _gaps(catalogue: dict[str, Any]) -> Iterable[str]:
    yield "## What nothing names"
    yield ""
    if catalogue["statements_file"] is not None:
        alone = catalogue["requirements_without_statement"]
        yield f"Requirements without a statement: {', '.join(alone) or 'none'}."
        yield ""
        unstated = catalogue["unstated"]
        yield f"Objects and figures that no statement points to: {', '.join(unstated) or 'none'}."
        yield ""
    uncovered = catalogue["uncovered_objects"]
    yield f"Objects that no item names: {', '.join(uncovered) or 'none'}."


def _head(*titles: str) -> Iterable[str]:
    yield _row(*titles)
    yield "|" + "---|" * len(titles)


def _row(*cells: object) -> str:
    return f"| {' | '.join(_cell(str(cell)) for cell in cells)} |"


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())
