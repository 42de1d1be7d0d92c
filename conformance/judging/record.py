"""The record of a judged recording: every requirement, with what the recording shows of it."""

from __future__ import annotations

import platform
from collections import defaultdict
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from conformance.bench.bus.trace import Trace
from conformance.bench.services.illegal import Illegal, shows_state
from conformance.checks.loading import load_checks
from conformance.errors import BenchError
from conformance.judging.commands import commands
from conformance.judging.emcys import emcys
from conformance.judging.heartbeats import heartbeats
from conformance.judging.layer_settings import layer_settings
from conformance.judging.recording import Recording
from conformance.judging.sightings import Found, Sighting, conclude
from conformance.judging.states import states
from conformance.judging.timeline import Timeline
from conformance.judging.tpdos import tpdos
from conformance.judging.transfers import transfers
from conformance.provenance import device
from conformance.report.junit import write_junit
from conformance.report.results import Item, JsonValue, Results
from conformance.report.seal import digest
from conformance.requirements import Requirement
from conformance.spec.model import DeviceSpec

JUDGED = frozenset(
    {
        "BOOT-01",
        "BOOT-02",
        "EMCY-03",
        "EMCY-04",
        "EMCY-06",
        "EMCY-07",
        "HB-01",
        "HB-02",
        "HB-03",
        "HB-04",
        "HB-05",
        "HB-07",
        "LSS-06",
        "LSS-07",
        "LSS-12",
        "NMT-01",
        "NMT-02",
        "OD-01",
        "OD-02",
        "OD-03",
        "OD-05",
        "OD-06",
        "OD-07",
        "OD-09",
        "OD-13",
        "SDO-01",
        "SDO-29",
        "TPDO-01",
        "TPDO-02",
        "TPDO-05",
    }
)
"""The requirements that a recording can show something of."""

FINDERS = (states, heartbeats, commands, tpdos, emcys, transfers, layer_settings)

NOT_SHOWN = "the recording shows nothing of it"
NOT_SHOWABLE = "no recording alone shows it: it takes a bench"
UNDOCUMENTED = "the manual documents none"


@dataclass(frozen=True, slots=True)
class Judging:
    """What is judged, and how.

    Args:
        recording: The recording.
        spec: What the device is held against.
        bitrate: Of the bus, in bit/s.
        jitter_ms: How far a timestamp of the recording may be off.
        serial: For the record.
    """

    recording: Recording
    spec: DeviceSpec
    bitrate: int
    jitter_ms: float
    serial: str = ""

    def results(self) -> Results:
        """Return the record."""
        timeline = Timeline(self.recording, self.spec, self.bitrate, self.jitter_ms)
        by_item: dict[tuple[str, str], list[Sighting]] = defaultdict(list)
        for find in FINDERS:
            for sighting in find(timeline):
                by_item[sighting.requirement, sighting.label].append(sighting)
        results = Results(self._run(timeline), device(self.spec, self.serial) | {"identity": {}})
        for requirement in load_checks().values():
            cases = {it.label: it.section for it in requirement.cases(self.spec)}
            seen = [label for name, label in by_item if name == requirement.id]
            for label in dict.fromkeys((*cases, *seen)) or ("",):
                sightings = by_item.get((requirement.id, label))
                found = conclude(sightings, self.jitter_ms) if sightings else None
                results.items.append(self._item(requirement, label, cases.get(label, ""), found))
        illegal = Illegal(
            error_control=sum(not shows_state(it.frame) for it in timeline.error_control),
            improper=timeline.exchanges.improper,
        )
        results.illegal = str(illegal)
        results.complete = True
        return results

    def _item(
        self, requirement: Requirement, label: str, section: str, found: Found | None
    ) -> Item:
        reason = NOT_SHOWN if requirement.id in JUDGED else NOT_SHOWABLE
        if found is None:
            reason = reason if label else UNDOCUMENTED
        measurements = found.verdict.measurements if found else []
        failed = [it for it in measurements if not it.ok]
        section = found.section if found else section
        manual = self.spec.cite(section) if section else ""
        shown = None
        if found is not None and found.word in ("pass", "fail"):
            shown = (failed or measurements[-1:])[0]
        return Item(
            id="/".join(part for part in (self.spec.name, requirement.id, label) if part),
            requirement=requirement.id,
            sentence=requirement.sentence,
            level=requirement.level,
            source="; ".join(part for part in (manual, requirement.source) if part),
            service=requirement.service,
            object=label,
            verdict=found.word if found else "not_applicable",
            expected=shown.expected if shown else "",
            actual=shown.actual if shown else "",
            unit=shown.unit if shown else "",
            quantity=shown.quantity if shown else "",
            reason=found.reason if found else reason,
            trace=f"trace.log:{found.first}-{found.last}" if found else "",
            begins=found.first if found else 0,
            readings=dict(found.verdict.readings) if found else {},
            deviations=tuple(
                {"quantity": quantity, "expected": expected, "actual": actual}
                for quantity, expected, actual in dict.fromkeys(
                    (it.quantity, it.expected, it.actual)
                    for it in (failed if found and found.word == "fail" else ())
                )
            ),
        )

    def _run(self, timeline: Timeline) -> dict[str, JsonValue]:
        recording = self.recording
        return {
            "suite": version("canopen-conformance"),
            "spec": self.spec.name,
            "spec_sha256": self.spec.sha256,
            "bench": "recording",
            "recording": recording.path.name,
            "recording_sha256": recording.sha256,
            "recording_format": recording.format,
            "recording_s": round(recording.duration_s, 6),
            "recording_breaks": len(recording.breaks),
            "recording_left_out": recording.left_out,
            "disturbed_sdo_stretches": timeline.exchanges.disturbed,
            "bitrate": self.bitrate,
            "timestamps": {"by": "recording, origin unknown", "late_ms": self.jitter_ms},
            "strict": False,
            "select": "",
            "acceptance": False,
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "frames": len(recording.seen),
            "clock": "real",
            "python": platform.python_version(),
            "python_can": version("python-can"),
            "system": platform.system(),
        }


def write(results: Results, recording: Recording, folder: Path) -> None:
    """Write the record of a judged recording, its frames as ``trace.log`` among it.

    Raises:
        BenchError: The disk does not take it.
    """
    try:
        trace = Trace(folder / "trace.log")
        for seen in recording.seen:
            trace.add(seen.time_s, seen.frame, received=seen.received)
        trace.close()
        results.run["trace_sha256"] = digest(folder / "trace.log")
    except OSError as error:
        raise BenchError(f"cannot write {folder}: {error.strerror or error}") from error
    results.write(folder / "results.json")
    write_junit(results, folder / "junit.xml")
