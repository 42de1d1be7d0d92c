"""The matrix of a device's defects as one HTML file that opens offline."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from conformance.resources import data


def to_html(matrix: Mapping[str, Any]) -> str:
    """Return the page of a matrix, as it stands in ``mutants.json``."""
    from jinja2 import (  # noqa: PLC0415 - it takes long to load, and no other command needs it
        Environment,
        FileSystemLoader,
        StrictUndefined,
    )

    environment = Environment(
        loader=FileSystemLoader(data("reports/templates")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    services = sorted({_service(name) for name in matrix["requirements"]})
    areas: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for defect in matrix["defects"]:
        areas[defect["area"]].append(defect)
    return environment.get_template("mutants.html").render(
        matrix=matrix,
        services=services,
        areas=areas,
        seen=_seen,
    )


def _seen(defect: Mapping[str, Any]) -> dict[str, int]:
    """Return how many items of each service failed on a defect."""
    counts: dict[str, int] = defaultdict(int)
    for item in defect["failed"]:
        counts[_service(item.split("/", 2)[1])] += 1
    return counts


def _service(requirement: str) -> str:
    return requirement.partition("-")[0]
