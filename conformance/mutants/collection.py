"""Every defect that a device is tried with."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from conformance import resources
from conformance.errors import SpecError
from conformance.mutants.defect import Defect
from conformance.mutants.entries import entry_defects
from conformance.mutants.figures import behaviour_defects, service_defects
from conformance.simulator.fault_files import FOLDER, load_faults, read_fault
from conformance.spec.load import SpecFile
from conformance.spec.model import DeviceSpec
from conformance.spec.readings import ChangeError
from conformance.spec.resolve import chosen_readings
from conformance.spec.services import Store

EXPLORED = "explore"
"""Stands among what sees a defect that no single check can: `explore` does."""


def all_defects(file: SpecFile, spec: DeviceSpec) -> list[Defect]:
    """Return the defects of one variant: of each of its figures, and of the fault files.

    Args:
        file: The device spec.
        spec: It, resolved for the variant.
    """
    figures = [*entry_defects(file, spec), *service_defects(spec), *behaviour_defects(spec)]
    return [*{it.id: it for it in figures}.values(), *_files()]


def real_defects(file: SpecFile, spec: DeviceSpec, defects: Iterable[Defect]) -> Iterator[Defect]:
    """Return those defects that are some.

    None is what no spec file may say, what changes nothing in this variant, and what another
    reading of the manual has, or a part of it.
    """
    conforming = {_fingerprint(file, spec, {}), *_readings(file, spec)}
    parts = list(_parts_of_readings(file))
    for defect in defects:
        try:
            changes = load_faults(defect.faults).changes
            if changes and all(change in parts for change in changes.items()):
                continue
            if not changes or _fingerprint(file.changed(changes), spec, {}) not in conforming:
                yield defect
        except SpecError:
            continue


def _readings(file: SpecFile, spec: DeviceSpec) -> Iterator[bytes]:
    for ambiguity in file.document.ambiguities:
        for number, reading in enumerate(ambiguity.readings, start=1):
            if reading.changes and ambiguity.judged_by == "either":
                try:
                    yield _fingerprint(file, spec, {ambiguity.id: number})
                except (SpecError, ChangeError):
                    continue


def _parts_of_readings(file: SpecFile) -> Iterator[tuple[str, Any]]:
    for ambiguity in file.document.ambiguities:
        if ambiguity.judged_by == "either":
            for reading in ambiguity.readings:
                yield from reading.changes.items()


def _fingerprint(file: SpecFile, spec: DeviceSpec, readings: dict[str, int]) -> bytes:
    """Return what tells apart what two devices do."""
    chosen = chosen_readings(file.document.ambiguities, {**spec.readings, **readings})
    other = file.resolve(spec.variant, spec.node_id, chosen)
    entries = [
        replace(it, name="", unit=None, bits=None, source="", sources={})
        for it in other.entries.values()
    ]
    covered = [
        _covered(service, other) for service in (other.services.store, other.services.restore)
    ]
    services = other.services.model_copy(update={"store": None, "restore": None})
    facts = (entries, services, other.behaviours, covered)
    return hashlib.sha256(repr(facts).encode()).digest()


def _covered(service: Store | None, spec: DeviceSpec) -> object:
    """Return what stores or restores, with the settings that it acts on instead of ranges."""
    if service is None:
        return None
    settings = {it.index: None for it in spec.entries.values() if it.persistent and it.writable}
    objects = {
        sub: [index for index in settings if service.covers(sub, index)] for sub in service.groups
    }
    return service.model_copy(update={"groups": objects})


def _files() -> Iterator[Defect]:
    for name in resources.names(FOLDER):
        fault = read_fault(name)
        if EXPLORED not in fault.seen_by:
            yield Defect(
                name, fault.what, (name,), "fault file", "faults", seen_by=tuple(fault.seen_by)
            )
