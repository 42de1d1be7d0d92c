"""The matrix of a device's defects as one HTML file that opens offline."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from conformance.report.pages import render


def to_html(matrix: Mapping[str, Any]) -> str:
    """Return the page of a matrix, as it stands in ``mutants.json``."""
    services = sorted({_service(name) for name in matrix["requirements"]})
    areas: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
    for defect in matrix["defects"]:
        areas[defect["area"]].append(defect)
    return render("mutants.html.j2", matrix=matrix, services=services, areas=areas, seen=_seen)


def _seen(defect: Mapping[str, Any]) -> dict[str, int]:
    """Return how many items of each service failed on a defect."""
    counts: dict[str, int] = defaultdict(int)
    for item in defect["failed"]:
        counts[_service(item.split("/", 2)[1])] += 1
    return counts


def _service(requirement: str) -> str:
    return requirement.partition("-")[0]
