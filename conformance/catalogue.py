"""The catalogue: each requirement with its source and check, and what it applies to in a device."""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

from conformance import checks
from conformance.requirements import REGISTRY, Requirement
from conformance.spec.model import DeviceSpec


def load_checks() -> dict[str, Requirement]:
    """Import every module of checks and return the registry, by id."""
    for module in pkgutil.iter_modules(checks.__path__, f"{checks.__name__}."):
        if module.name.rpartition(".")[2].startswith("test_"):
            importlib.import_module(module.name)
    return dict(sorted(REGISTRY.items()))


def build(spec: DeviceSpec) -> dict[str, Any]:
    """Return the catalogue of one device as plain data."""
    requirements = []
    touched: set[str] = set()
    for requirement in load_checks().values():
        cases = list(requirement.cases(spec))
        touched.update(case.label.partition("/")[0] for case in cases)
        sections = sorted({case.section for case in cases if case.section})
        requirements.append(
            {
                "id": requirement.id,
                "sentence": requirement.sentence,
                "level": requirement.level,
                "source": requirement.source,
                "sections": sections,
                "check": requirement.check,
                "effects": list(requirement.effects),
                "items": [f"{spec.name}/{requirement.id}/{case.label}" for case in cases],
            }
        )
    return {
        "device": spec.name,
        "variant": spec.variant,
        "manual": spec.manual.name,
        "requirements": requirements,
        "uncovered_objects": [
            entry.address for entry in spec.entries.values() if entry.address not in touched
        ],
        "totals": {
            "requirements": len(requirements),
            "items": sum(len(r["items"]) for r in requirements),
            "entries": len(spec.entries),
            "ambiguities": len(spec.ambiguities),
        },
    }


def to_markdown(catalogue: dict[str, Any]) -> str:
    """Return the catalogue as a Markdown page."""
    totals = catalogue["totals"]
    lines = [
        f"# Catalogue: {catalogue['device']}, {catalogue['variant']}",
        "",
        (
            f"Judged against {catalogue['manual']}: {totals['requirements']} requirements, "
            f"{totals['items']} items on {totals['entries']} entries, "
            f"{totals['ambiguities']} ambiguities recorded."
        ),
        "",
        "| id | requirement | level | standard | sections of the manual | items | check |",
        "|---|---|---|---|---|---|---|",
    ]
    for r in catalogue["requirements"]:
        sections = ", ".join(r["sections"][:6]) + (", …" if len(r["sections"]) > 6 else "")
        lines.append(
            f"| {r['id']} | {r['sentence']} | {r['level']} | {r['source'] or '-'} | "
            f"{sections or '-'} | {len(r['items']) or 'not applicable'} | `{r['check']}` |"
        )
    uncovered = catalogue["uncovered_objects"]
    lines += ["", f"Objects that no item names: {', '.join(uncovered) or 'none'}."]
    return "\n".join(lines)
