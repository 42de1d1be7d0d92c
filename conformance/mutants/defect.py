"""A defect: a device that differs from its manual in one thing, as `--fault` takes it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.compat import StringIO

from conformance.spec.model import Key


@dataclass(frozen=True, slots=True)
class Defect:
    """One defect of a simulated device.

    Args:
        id: Stable: the place of the figure and what became of it, or the name of a fault file.
        what: What the device does instead.
        faults: What `--fault` takes, one or more.
        attribute: What kind of figure differs: ``default``, ``access``, ….
        key: The entry that differs; None for a service, a behaviour or a fault file.
        related: Indices of objects that a behaviour ties to the entry.
        area: The service or behaviour it belongs to, or ``objects``.
        seen_by: Requirements, or beginnings of their ids, one of which must fail on it; any, where empty.
    """

    id: str
    what: str
    faults: tuple[str, ...]
    attribute: str
    area: str
    key: Key | None = None
    related: tuple[int, ...] = ()
    seen_by: tuple[str, ...] = ()


def path(*keys: Hashable) -> str:
    """Return a path in a device spec as `--fault` takes it."""
    first, *rest = keys
    words = [
        f"0x{key:04X}" if first == "objects" and n == 0 else str(key) for n, key in enumerate(rest)
    ]
    return "/".join((str(first), *words))


def change(place: str, value: Any) -> str:
    """Return a change of a figure as `--fault` takes it."""
    return f"{place}={_flow(value)}"


def _flow(value: Any) -> str:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = True
    yaml.width = 1 << 20
    text = StringIO()
    yaml.dump(value, text)
    return text.getvalue().strip().removesuffix("...").strip()


def without(mapping: Mapping[Any, Any], key: Hashable) -> dict[Any, Any]:
    """Return a mapping without one of its keys."""
    return {k: v for k, v in mapping.items() if k != key}
