"""A resolved device spec for people (a table) and for programs (JSON)."""

from __future__ import annotations

from typing import Any

from conformance.report.console import Terminal
from conformance.spec.model import DeviceSpec, Entry


def to_json(spec: DeviceSpec) -> dict[str, Any]:
    """Return the spec as plain data; keys are fixed."""
    return {
        "device": spec.name,
        "variant": spec.variant,
        "node_id": spec.node_id,
        "objects": [_object(entry) for entry in spec.entries.values()],
        "services": spec.services.model_dump(mode="json", exclude_none=True),
        "ambiguities": [a.model_dump(mode="json") for a in spec.ambiguities],
    }


def _object(entry: Entry) -> dict[str, Any]:
    return {
        "index": entry.index,
        "sub": entry.sub,
        "name": entry.name,
        "type": entry.type.name,
        "access": entry.access,
        "default": entry.default,
        "ranges": [list(interval) for interval in entry.ranges] if entry.ranges else None,
        "values": {str(k): text for k, text in entry.values.items()} if entry.values else None,
        "mappable": entry.mappable,
        "persistent": entry.persistent,
        "source": entry.source,
        "kind": entry.kind,
        "unit": entry.unit,
        "scale": entry.scale,
        "reserved": entry.reserved,
        "optional": entry.optional,
        "sources": dict(entry.sources),
        "ambiguities": sorted({a.ambiguity for a in entry.alternatives}),
    }


def print_table(spec: DeviceSpec, terminal: Terminal) -> None:
    """Print the spec's objects."""
    terminal.say(
        f"{spec.device.vendor} {spec.device.name}, {spec.variant}, node {spec.node_id}: "
        f"{len(spec.entries)} entries, {len(spec.ambiguities)} ambiguities",
        style="bold",
    )
    heads = ("object", "name", "type", "access", "default", "allowed", "PDO", "stored", "section")
    terminal.table(heads, (_row(entry) for entry in spec.entries.values()))


def _row(entry: Entry) -> tuple[str, ...]:
    doubtful = " ?" if entry.alternatives else ""
    return (
        entry.address,
        entry.name,
        entry.type.name,
        "reserved" if entry.reserved else entry.access,
        f"{_value(entry)}{doubtful}",
        _allowed(entry),
        _yes(entry.mappable),
        _yes(entry.persistent),
        entry.source,
    )


def _value(entry: Entry) -> str:
    if entry.default is None:
        return "-"
    if isinstance(entry.default, int) and entry.default > 0xFF:
        return f"{entry.default:X}h"
    return str(entry.default)


def _allowed(entry: Entry) -> str:
    return ", ".join(f"{a}" if a == b else f"{a}..{b}" for a, b in entry.legal or ())


def _yes(flag: bool | None) -> str:
    return {True: "yes", False: "no", None: "-"}[flag]
