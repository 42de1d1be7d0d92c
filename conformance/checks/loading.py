"""Every check there is."""

from __future__ import annotations

import importlib
import pkgutil

from conformance import checks
from conformance.requirements import REGISTRY, Requirement


def load_checks() -> dict[str, Requirement]:
    """Import every module of checks and return the registry, by id."""
    for module in pkgutil.walk_packages(checks.__path__, f"{checks.__name__}."):
        if module.name.rpartition(".")[2].startswith("test_"):
            importlib.import_module(module.name)
    return dict(sorted(REGISTRY.items()))
