"""Where a record comes from, as a reader needs it: device, bench, times, files, what it did."""

from __future__ import annotations

import shlex
from collections.abc import Iterator

from conformance.numbers import figure
from conformance.report.frames import TraceFile
from conformance.report.record import Origin, Record

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
    origin = record.origin
    if origin.recording:
        return {
            "Recording": _kept(_recording(origin)),
            "Judged": _kept(_judged(origin)),
            "Record": _kept(_files(record, trace)),
        }
    return {
        "Bench": _kept(_bench(origin)),
        "Times": _kept(_times(origin)),
        "What the run did to the device": _kept(_effects(origin)),
        "Record": _kept(_files(record, trace)),
    }


def _kept(pairs: Iterator[tuple[str, object]]) -> list[tuple[str, str]]:
    return [(name, str(value)) for name, value in pairs if value not in ("", None)]


def _bench(origin: Origin) -> Iterator[tuple[str, object]]:
    yield "bench", origin.bench
    yield "adapter (python-can interface)", origin.interface
    yield "bit rate", _rate(origin)
    if origin.timestamps is not None:
        yield "timestamps made by", f"the {origin.timestamps.by}"
        yield "timestamps late by at most", milliseconds(origin.timestamps.late_ms)
    yield "clock", origin.clock
    yield "CAN-ID of the markers", f"{origin.markers:03X}h" if origin.markers else ""
    yield "computer", origin.system


def _recording(origin: Origin) -> Iterator[tuple[str, object]]:
    yield "file", origin.recording
    yield "format", origin.recording_format
    yield "SHA-256 of the file", origin.recording_sha256
    yield "frames", origin.frames
    yield (
        "from first to last frame",
        ("" if origin.recording_s is None else f"{origin.recording_s:.1f} s"),
    )
    yield "marks of lost frames and errors", origin.recording_breaks
    yield "lines and objects left out", origin.recording_left_out
    yield "stretches of SDO disturbed", origin.disturbed_sdo_stretches
    yield "bit rate, as told", _rate(origin)
    if origin.timestamps is not None:
        yield "timestamps off by at most, as told", milliseconds(origin.timestamps.late_ms)


def _judged(origin: Origin) -> Iterator[tuple[str, object]]:
    yield "when", shown_time(origin.started)
    yield "took", "" if origin.wall_s is None else f"{origin.wall_s:.1f} s"
    yield "computer", origin.system


def _rate(origin: Origin) -> str:
    return f"{origin.bitrate / 1000:g} kbit/s" if origin.bitrate else ""


def milliseconds(value: float) -> str:
    """Return a time of so many ms as people write it: two digits that count, and no exponent."""
    return f"{figure(value, 2)} ms"


def _times(origin: Origin) -> Iterator[tuple[str, object]]:
    yield "started", shown_time(origin.started)
    yield "finished", shown_time(origin.finished)
    yield "took", "" if origin.wall_s is None else f"{origin.wall_s:.1f} s"
    if origin.bus_time is not None:
        taken_s, needed_s = origin.bus_time.taken_s, origin.bus_time.needed_s
        yield "bus time", f"{taken_s:.1f} s, needed {needed_s:.1f} s"
    yield "frames", origin.frames


def shown_time(stamp: str) -> str:
    """Return a time as people write it: ``2026-11-22 22:38:09 UTC``."""
    return stamp.replace("T", " ").replace("+00:00", " UTC")


def _effects(origin: Origin) -> Iterator[tuple[str, object]]:
    found = origin.as_found
    if found is not None and found.differences is not None:
        left = ", ".join(it.object for it in found.differences)
        words = f"not as found: {left}" if left else f"as found ({found.objects} settings)"
        yield "the device was left", words
        yield "NMT state before", found.nmt_state
    yield "writes of its non-volatile memory", origin.non_volatile_writes
    cycles = origin.wear_cycles
    yield "writes that its manual gives the memory", f"{cycles:,}" if cycles else ""
    for key, words in _COUNTED.items():
        yield words, getattr(origin, key)


def _files(record: Record, trace: TraceFile) -> Iterator[tuple[str, object]]:
    origin = record.origin
    yield "suite", f"canopen-conformance {origin.suite}" if origin.suite else ""
    yield "acceptance run", {True: "yes", False: "no", None: ""}[origin.acceptance]
    yield "spec", origin.spec
    yield "SHA-256 of the spec", origin.spec_sha256
    yield "EDS", origin.eds
    yield "SHA-256 of the EDS", origin.eds_sha256
    yield f"SHA-256 of {record.path.name}", record.sha256
    yield f"SHA-256 of {record.trace.name}", trace.sha256
    yield "seed", origin.seed
    libraries = {
        "Python": origin.python,
        "python-can": origin.python_can,
        "canopen": origin.canopen,
    }
    yield "libraries", ", ".join(f"{name} {number}" for name, number in libraries.items() if number)
    if origin.arguments:
        select = ["--select", origin.select] if origin.select else []
        again = ["canopen-conformance", "run", *origin.arguments, *select]
        yield "the same again", shlex.join(again)
