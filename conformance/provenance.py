"""Where a run's record comes from: versions, spec, bench and what the user asked for."""

from __future__ import annotations

import platform
from collections.abc import Iterable
from importlib.metadata import version
from typing import Any

from conformance.bench.definition import BenchDefinition
from conformance.checks import JUDGED_SERVICES
from conformance.errors import SpecError, first_line
from conformance.options import RunOptions
from conformance.report.eds_word import EdsWord
from conformance.spec.load import SpecFile
from conformance.spec.model import DeviceSpec, address
from conformance.spec.readings import parse_path
from conformance.spec.statements import load_statements


def provenance(
    options: RunOptions, definition: BenchDefinition, spec: DeviceSpec, eds: EdsWord | None
) -> dict[str, Any]:
    """Return what is known of a run before it begins."""
    return {
        "suite": version("canopen-conformance"),
        "spec": spec.name,
        "spec_sha256": spec.sha256,
        "eds": eds.name if eds else "",
        "eds_sha256": eds.sha256 if eds else "",
        "bench": options.bench,
        "interface": definition.interface,
        "bitrate": definition.bitrate or spec.bitrate,
        "seed": options.seed,
        "arguments": options.arguments(spec.variant),
        "simulate_spec": options.simulate_spec or "",
        "faults": list(options.faults),
        "simulated_readings": list(options.readings),
        "strict": options.strict,
        "select": options.select or options.repro,
        "acceptance": options.acceptance,
        "not_judged": sorted(set(_documented_services(spec)) - JUDGED_SERVICES),
        "python": platform.python_version(),
        "python_can": version("python-can"),
        "canopen": version("canopen"),
        "system": platform.system(),
    }


def device(spec: DeviceSpec, serial: str) -> dict[str, Any]:
    """Return what is known of the device before it is asked; the serial number is the label's."""
    return {
        "spec": spec.name,
        "vendor": spec.device.vendor,
        "name": spec.device.name,
        "variant": spec.variant,
        "node_id": spec.node_id,
        "serial": serial,
        "manual": spec.manual.name,
    }


def manual(file: SpecFile, variant: str) -> dict[str, Any]:
    """Return what the manual says of a variant and where it can be read in several ways.

    A mistake in the statements file ends no run: the record says that they could not be read.
    """
    missing = "nobody has listed what the manual says"
    try:
        listed = load_statements(file)
    except SpecError as error:
        listed, missing = None, first_line(error)
    statements = [
        {
            "id": it.id,
            "source": it.source,
            "says": it.says,
            "objects": _objects(it.encoded),
            "verified_by": it.verified_by or [],
            "needs": it.needs or "",
            "because": it.because or "",
            "open": it.open or "",
        }
        for it in (listed.statements if listed else ())
        if it.applies_to(variant)
    ]
    ambiguities = [
        {
            "id": it.id,
            "source": it.source,
            "what": it.what,
            "readings": [reading.says for reading in it.readings],
        }
        for it in file.document.ambiguities
        if it.judged_by == "either"
    ]
    return {
        "statements": statements,
        "statements_missing": "" if listed else missing,
        "ambiguities": ambiguities,
    }


def _objects(paths: Iterable[str]) -> list[str]:
    """Return the objects that some paths in a spec lead to."""
    named = (parse_path(path) for path in paths)
    indices = {it[1] for it in named if it[0] == "objects" and len(it) > 1}
    return sorted(address(index) for index in indices if isinstance(index, int))


def _documented_services(spec: DeviceSpec) -> list[str]:
    services = spec.services
    return [name for name in type(services).model_fields if getattr(services, name) is not None]
