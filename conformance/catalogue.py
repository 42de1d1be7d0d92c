"""The catalogue: requirements, the manual's statements and checks as one matrix, and what it misses."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from conformance import checks
from conformance.errors import Problem, SpecError
from conformance.requirements import REGISTRY, Requirement
from conformance.spec.load import SpecFile
from conformance.spec.model import DeviceSpec, address
from conformance.spec.readings import parse_path
from conformance.spec.statements import Statement, StatementsFile
from conformance.spec.yaml_reader import Path_, shown

STATUSES = ("verified", "power", "stimulus", "operator", "not_visible", "open")


def load_checks() -> dict[str, Requirement]:
    """Import every module of checks and return the registry, by id."""
    for module in pkgutil.iter_modules(checks.__path__, f"{checks.__name__}."):
        if module.name.rpartition(".")[2].startswith("test_"):
            importlib.import_module(module.name)
    return dict(sorted(REGISTRY.items()))


def find_requirement_problems(file: SpecFile, statements: StatementsFile) -> list[Problem]:
    """Return where statements name a requirement that is unknown or has no item on their variants."""
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
        variants = [v for v in file.variants if statement.applies_to(v) and not applies(name, v)]
        if variants:
            yield f"expected a requirement with items on {', '.join(variants)}, got {name}"

    return [
        statements.yaml.problem(("statements", number, "verified_by", nth), text)
        for number, statement in enumerate(statements.statements)
        for nth, name in enumerate(statement.verified_by or ())
        for text in mistakes(statement, name)
    ]


def build(
    file: SpecFile, variant: str | None = None, statements: StatementsFile | None = None
) -> dict[str, Any]:
    """Return the catalogue of one variant of a device as plain data.

    Args:
        file: The spec.
        variant: Name of a variant; the first one of the file when None.
        statements: The statements of the manual; None where nobody has listed them.

    Raises:
        SpecError: A statement names a requirement that is unknown or has no item.
    """
    spec = file.resolve(variant)
    listed = _statements_of(file, spec, statements)
    requirements = [_requirement(r, spec, listed) for r in load_checks().values()]
    labels = (item.split("/", 2)[2] for r in requirements for item in r["items"])
    touched = {label.partition("/")[0] for label in labels}
    rows = [_statement(statement) for statement in listed]
    encoded = {parse_path(path) for statement in listed for path in statement.encoded}
    return {
        "device": spec.name,
        "variant": spec.variant,
        "manual": spec.manual.name,
        "statements_file": None if statements is None else statements.yaml.path.name,
        "requirements": requirements,
        "statements": rows,
        "requirements_without_statement": [
            r["id"] for r in requirements if r["items"] and not r["statements"]
        ],
        "statements_without_requirement": [s["id"] for s in rows if not s["requirements"]],
        "uncovered_objects": [
            entry.address for entry in spec.entries.values() if entry.address not in touched
        ],
        "unstated": [] if statements is None else list(_unstated(file, spec, encoded)),
        "totals": {
            "requirements": len(requirements),
            "items": sum(len(r["items"]) for r in requirements),
            "entries": len(spec.entries),
            "ambiguities": len(spec.ambiguities),
            "statements": len(rows),
            "statements_by_status": {
                status: sum(s["status"] == status for s in rows) for status in STATUSES
            },
        },
    }


def _statements_of(
    file: SpecFile, spec: DeviceSpec, statements: StatementsFile | None
) -> Sequence[Statement]:
    if statements is None:
        return ()
    problems = find_requirement_problems(file, statements)
    if problems:
        raise SpecError(*problems)
    return [s for s in statements.statements if s.applies_to(spec.variant)]


def _requirement(
    requirement: Requirement, spec: DeviceSpec, statements: Sequence[Statement]
) -> dict[str, Any]:
    cases = list(requirement.cases(spec))
    return {
        "id": requirement.id,
        "sentence": requirement.sentence,
        "level": requirement.level,
        "source": requirement.source,
        "sections": sorted({case.section for case in cases if case.section}),
        "check": requirement.check,
        "effects": list(requirement.effects),
        "items": [f"{spec.name}/{requirement.id}/{case.label}" for case in cases],
        "statements": [s.id for s in statements if requirement.id in (s.verified_by or ())],
    }


def _statement(statement: Statement) -> dict[str, Any]:
    known: Mapping[str, Requirement] = REGISTRY
    requirements = list(dict.fromkeys(statement.verified_by or ()))
    return {
        "id": statement.id,
        "source": statement.source,
        "says": statement.says,
        "encoded": statement.encoded,
        "ambiguity": statement.ambiguity,
        "variants": statement.variants,
        "status": _status(statement),
        "requirements": requirements,
        "checks": [known[name].check for name in requirements],
        "reason": statement.because or statement.open,
    }


def _status(statement: Statement) -> str:
    if statement.needs is not None:
        return statement.needs
    if statement.verified_by is not None:
        return "verified"
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
