"""The catalogue: requirements, the manual's statements and checks as one matrix, and what it misses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from conformance.checks.loading import load_checks
from conformance.errors import Problem, SpecError
from conformance.requirements import REGISTRY, Requirement
from conformance.spec.load import SpecFile
from conformance.spec.model import DeviceSpec, address
from conformance.spec.readings import parse_path
from conformance.spec.statements import Statement, StatementsFile
from conformance.spec.yaml_reader import Path_, shown

__all__ = ["STATUSES", "build", "find_requirement_problems", "load_checks"]

STATUSES = ("verified", "power", "stimulus", "operator", "not_visible", "open")


def find_requirement_problems(file: SpecFile, statements: StatementsFile) -> list[Problem]:
    """Return where statements name a requirement that is unknown or has no item on any variant."""
    known = load_checks()
    specs = {variant: file.resolve(variant) for variant in file.variants}
    applied: dict[tuple[str, str], bool] = {}

    def applies(name: str, variant: str) -> bool:
        if (name, variant) not in applied:
            applied[name, variant] = any(True for _ in known[name].cases(specs[variant]))
        return applied[name, variant]

    def mistakes(statement: Statement, name: str) -> Iterator[str]:
        if name not in known:
            yield f"expected the id of a requirement, got {shown(name)}"
            return
        variants = [variant for variant in file.variants if statement.applies_to(variant)]
        if not any(applies(name, variant) for variant in variants):
            yield f"expected a requirement with items on {' or '.join(variants)}, got {name}"

    return [
        statements.yaml.problem(("statements", number, "verified_by", nth), text)
        for number, statement in enumerate(statements.statements)
        for nth, name in enumerate(statement.verified_by or ())
        for text in mistakes(statement, name)
    ]


def build(
    file: SpecFile, variant: str | None = None, statements: StatementsFile | None = None
) -> dict[str, Any]:
    """Return the catalogue of a device as plain data.

    Args:
        file: The spec.
        variant: Name of the one variant to look at; None for all.
        statements: The statements of the manual; None where nobody has listed them.

    Raises:
        SpecError: A statement names a requirement that is unknown or has no item.
    """
    names = file.variants if variant is None else [variant]
    specs = {name: file.resolve(name) for name in names}
    spec = next(iter(specs.values()))
    listed = _statements_of(file, specs, statements)
    requirements = [_requirement(r, specs, listed) for r in load_checks().values()]
    shown_in = {r["id"]: r["variants"] for r in requirements}
    labels = (item.split("/", 2)[2] for r in requirements for item in r["items"])
    touched = {label.partition("/")[0] for label in labels}
    entries = dict.fromkeys(e.address for it in specs.values() for e in it.entries.values())
    rows = [_statement(statement, file, shown_in) for statement in listed]
    by_status = {status: sum(s["status"] == status for s in rows) for status in STATUSES}
    showable = len(rows) - by_status["not_visible"]
    encoded = {parse_path(path) for statement in listed for path in statement.encoded}
    unstated = (path for it in specs.values() for path in _unstated(file, it, encoded))
    return {
        "device": spec.name,
        "variant": variant,
        "variants": list(specs),
        "manual": spec.manual.name,
        "statements_file": None if statements is None else statements.yaml.path.name,
        "requirements": requirements,
        "statements": rows,
        "requirements_without_statement": [
            r["id"] for r in requirements if r["items"] and not r["statements"]
        ],
        "statements_without_requirement": [s["id"] for s in rows if s["status"] != "verified"],
        "uncovered_objects": [entry for entry in entries if entry not in touched],
        "unstated": [] if statements is None else list(dict.fromkeys(unstated)),
        "totals": {
            "requirements": len(requirements),
            "items": sum(len(r["items"]) for r in requirements),
            "entries": len(entries),
            "ambiguities": len(spec.ambiguities),
            "statements": len(rows),
            "statements_by_status": by_status,
            "showable": showable,
            "verified_percent": round(100 * by_status["verified"] / showable, 1)
            if showable
            else None,
        },
    }


def _statements_of(
    file: SpecFile, variants: Iterable[str], statements: StatementsFile | None
) -> Sequence[Statement]:
    if statements is None:
        return ()
    problems = find_requirement_problems(file, statements)
    if problems:
        raise SpecError(*problems)
    return [s for s in statements.statements if any(s.applies_to(variant) for variant in variants)]


def _requirement(
    requirement: Requirement, specs: Mapping[str, DeviceSpec], statements: Sequence[Statement]
) -> dict[str, Any]:
    cases = {name: list(requirement.cases(spec)) for name, spec in specs.items()}
    every = [case for found in cases.values() for case in found]
    prefix = f"{next(iter(specs.values())).name}/{requirement.id}"
    return {
        "id": requirement.id,
        "sentence": requirement.sentence,
        "level": requirement.level,
        "source": requirement.source,
        "sections": sorted({case.section for case in every if case.section}),
        "check": requirement.check,
        "effects": list(requirement.effects),
        "items": list(dict.fromkeys(f"{prefix}/{case.label}" for case in every)),
        "variants": [name for name, found in cases.items() if found],
        "statements": [s.id for s in statements if requirement.id in (s.verified_by or ())],
    }


def _statement(
    statement: Statement, file: SpecFile, shown_in: Mapping[str, Sequence[str]]
) -> dict[str, Any]:
    known: Mapping[str, Requirement] = REGISTRY
    requirements = list(dict.fromkeys(statement.verified_by or ()))
    variants = {variant for name in requirements for variant in shown_in[name]}
    seen = [name for name in file.variants if name in variants and statement.applies_to(name)]
    status = "verified" if seen else _status(statement)
    elsewhere = "no item on this variant" if requirements and not seen else None
    return {
        "id": statement.id,
        "source": statement.source,
        "says": statement.says,
        "encoded": statement.encoded,
        "ambiguity": statement.ambiguity,
        "variants": statement.variants,
        "status": status,
        "needs": statement.needs,
        "shown_in": seen,
        "requirements": requirements,
        "checks": [known[name].check for name in requirements],
        "reason": statement.because or statement.open or elsewhere,
    }


def _status(statement: Statement) -> str:
    """Return the status of a statement that nothing shows."""
    if statement.needs is not None:
        return statement.needs
    return "not_visible" if statement.because is not None else "open"


def _unstated(file: SpecFile, spec: DeviceSpec, encoded: set[Path_]) -> Iterator[str]:
    """Return the objects, figures of services and behaviours that no statement points to or into."""
    for index in spec.indices():
        if not _is_named(("objects", index), encoded):
            yield address(index)
    for service, figures in file.yaml.data["services"].items():
        if getattr(spec.services, service) is None:
            continue
        for figure in figures:
            path: Path_ = ("services", service, figure)
            if figure != "source" and not _is_named(path, encoded):
                yield "/".join(map(str, path))
    for name in spec.behaviours:
        if not _is_named(("behaviours", name), encoded):
            yield f"behaviours/{name}"


def _is_named(path: Path_, encoded: set[Path_]) -> bool:
    """Tell whether one of some paths is this one, lies above it or below it."""
    return any(all(a == b for a, b in zip(path, named, strict=False)) for named in encoded)
