"""Where a record comes from, as a reader needs it: device, bench, times, files, what it did."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

from conformance.report.frames import TraceFile
from conformance.report.record import Record

_COUNTED = {
    "unsolicited_sdo_responses": "SDO responses that nobody asked for",
    "improper_sdo_responses": "SDO responses against the protocol",
    "improper_heartbeats": "heartbeats that show no NMT state",
    "improper_lss_responses": "LSS responses that no slave gives",
    "restarts": "restarts by itself",
    "unanswered_sdo_requests": "requests of the set-up unanswered",
}


def facts(record: Record, trace: TraceFile) -> dict[str, list[tuple[str, str]]]:
    """Return titled lists of names and values; what a record does not tell is left out."""
    return {
        "Bench": _kept(_bench(record.run)),
        "Times": _kept(_times(record.run)),
        "What the run did to the device": _kept(_effects(record.run)),
        "Record": _kept(_files(record, trace)),
    }


def _kept(pairs: Iterator[tuple[str, object]]) -> list[tuple[str, str]]:
    return [(name, str(value)) for name, value in pairs if value not in ("", None)]


def _bench(run: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    yield "bench", run.get("bench")
    yield "adapter (python-can interface)", run.get("interface")
    bitrate = run.get("bitrate")
    yield "bit rate", f"{bitrate / 1000:g} kbit/s" if isinstance(bitrate, int | float) else ""
    stamps = run.get("timestamps")
    if isinstance(stamps, dict):
        yield "timestamps made by", f"the {stamps.get('by')}"
        yield "timestamps late by at most", f"{stamps.get('late_ms', 0):.3g} ms"
    yield "clock", run.get("clock")
    yield "CAN-ID of the markers", f"{run['markers']:03X}h" if run.get("markers") else ""
    yield "computer", run.get("system")


def _times(run: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    for name in ("started", "finished"):
        yield name, str(run.get(name, "")).replace("T", " ").replace("+00:00", " UTC")
    wall_s = run.get("wall_s")
    yield "took", f"{wall_s:.1f} s" if isinstance(wall_s, int | float) else ""
    bus = run.get("bus_time")
    if isinstance(bus, dict):
        yield "bus time", f"{bus.get('taken_s', 0):.1f} s, needed {bus.get('needed_s', 0):.1f} s"
    yield "frames", run.get("frames")


def _effects(run: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    found = run.get("as_found")
    if isinstance(found, dict) and "differences" in found:
        differences = found["differences"]
        left = ", ".join(str(it.get("object")) for it in differences)
        words = (
            f"not as found: {left}" if differences else f"as found ({found['objects']} settings)"
        )
        yield "the device was left", words
        yield "NMT state before", found.get("nmt_state")
    yield "writes of its non-volatile memory", run.get("non_volatile_writes")
    cycles = run.get("wear_cycles")
    yield "writes that its manual gives the memory", f"{cycles:,}" if cycles else ""
    for key, words in _COUNTED.items():
        yield words, run.get(key)


def _files(record: Record, trace: TraceFile) -> Iterator[tuple[str, object]]:
    run = record.run
    yield "suite", f"canopen-conformance {run.get('suite')}" if run.get("suite") else ""
    if "acceptance" in run:
        yield "acceptance run", "yes" if run["acceptance"] else "no"
    yield "spec", run.get("spec")
    yield "SHA-256 of the spec", run.get("spec_sha256")
    yield "EDS", run.get("eds")
    yield "SHA-256 of the EDS", run.get("eds_sha256")
    yield f"SHA-256 of {record.path.name}", record.sha256
    yield f"SHA-256 of {record.trace.name}", "" if trace.missing else _sha256(record)
    yield "seed", run.get("seed")
    libraries = {"python": "Python", "python_can": "python-can", "canopen": "canopen"}
    yield (
        "libraries",
        ", ".join(f"{name} {run[key]}" for key, name in libraries.items() if key in run),
    )
    if run.get("arguments"):
        select = ["--select", str(run["select"])] if run.get("select") else []
        again = ["canopen-conformance", "run", *map(str, run["arguments"]), *select]
        yield "the same again", shlex.join(again)


def _sha256(record: Record) -> str:
    return hashlib.sha256(record.trace.read_bytes()).hexdigest()
