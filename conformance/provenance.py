"""Where a run's record comes from: versions, spec, bench and what the user asked for."""

from __future__ import annotations

import platform
from importlib.metadata import version
from typing import Any

from conformance.bench.definition import BenchDefinition
from conformance.checks import JUDGED_SERVICES
from conformance.options import RunOptions
from conformance.report.eds_word import EdsWord
from conformance.spec.model import DeviceSpec


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
        "not_judged": sorted(set(_documented_services(spec)) - JUDGED_SERVICES),
        "python": platform.python_version(),
        "python_can": version("python-can"),
        "canopen": version("canopen"),
        "system": platform.system(),
    }


def device(options: RunOptions, spec: DeviceSpec) -> dict[str, Any]:
    """Return what is known of the device before it is asked."""
    return {
        "spec": spec.name,
        "vendor": spec.device.vendor,
        "name": spec.device.name,
        "variant": spec.variant,
        "node_id": spec.node_id,
        "serial": options.serial,
        "manual": spec.manual.name,
    }


def _documented_services(spec: DeviceSpec) -> list[str]:
    services = spec.services
    return [name for name in type(services).model_fields if getattr(services, name) is not None]
