"""What became of one item and of the bus meanwhile, as the record has it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from conformance.bench.node.keeping import wear_cycles
from conformance.bench.session import Bench
from conformance.report.results import Item
from conformance.requirements import Case, Requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Measurement, Verdict, VerdictWord


@dataclass(frozen=True, slots=True)
class OnBus:
    """Where an item is in the trace.

    Args:
        first: Its first line, that of its set-up.
        last: Its last line.
        begins: Line at which the check itself begins.
        duration_s: How long it took.
        marker: Number of its marker frames, 0 without any.
    """

    first: int
    last: int
    begins: int
    duration_s: float
    marker: int


def item_of(
    spec: DeviceSpec,
    requirement: Requirement,
    case: Case,
    word: VerdictWord,
    verdict: Verdict,
    reason: str,
    bus: OnBus,
) -> Item:
    """Return the result of one item.

    Args:
        spec: What the device is held against.
        requirement: The requirement.
        case: What of the device it was about.
        word: The verdict.
        verdict: What was measured.
        reason: Why there is no other verdict, empty where it needs none.
        bus: Where it is in the trace.
    """
    first, last = (bus.first, bus.last) if verdict.trace is None else verdict.trace
    failed = [m for m in verdict.measurements if not m.ok and (m.resolved or word != "fail")]
    decisive = failed[:1] or verdict.measurements[-1:]
    shown = decisive[0] if decisive and word in ("pass", "fail") else None
    manual = spec.cite(case.section) if case.section else ""
    return Item(
        id=item_id(spec, requirement, case),
        requirement=requirement.id,
        sentence=requirement.sentence,
        level=requirement.level,
        source="; ".join(part for part in (manual, requirement.source) if part),
        service=requirement.service,
        object=case.label,
        verdict=word,
        expected=shown.expected if shown else "",
        actual=shown.actual if shown else "",
        unit=shown.unit if shown else "",
        quantity=shown.quantity if shown else "",
        reason=reason,
        duration_s=round(bus.duration_s, 6),
        trace=f"trace.log:{first}-{last}" if last >= first else "",
        begins=max(first, bus.begins) if verdict.trace is None else first,
        marker=bus.marker,
        readings=dict(verdict.readings),
        deviations=tuple(
            {"quantity": m.quantity, "expected": m.expected, "actual": m.actual} for m in failed
        ),
        measurements=tuple(_numbers(m) for m in verdict.measurements if m.figures),
    )


def item_id(spec: DeviceSpec, requirement: Requirement, case: Case) -> str:
    """Return the stable id of one item."""
    return "/".join(part for part in (spec.name, requirement.id, case.label) if part)


def _numbers(measurement: Measurement) -> dict[str, Any]:
    """Return a comparison of numbers as it is recorded, to seven digits."""
    assert measurement.figures is not None  # it compares numbers
    limits = {
        name: None if limit is None else float(f"{limit:.7g}")
        for name, limit in asdict(measurement.figures).items()
        if name != "values"
    }
    values = [float(f"{it:.7g}") for it in measurement.figures.values]
    return {
        "quantity": measurement.quantity,
        "unit": measurement.unit,
        "values": values,
        **limits,
    }


def facts_of(bench: Bench, since_s: float) -> dict[str, Any]:
    """Return what a bench tells of a run that is over.

    Args:
        bench: The bench, still open.
        since_s: When the run began, by its clock.
    """
    link, illegal = bench.link, bench.illegal
    taken_s = round(link.now() - since_s, 3)
    return {
        "simulated_s" if link.simulated else "bus_s": taken_s,
        "clock": "real" if link.real_time else "virtual",
        "bus_time": {
            "needed_s": round(link.bus_time.needed_s, 3),
            "frames_s": round(link.bus_time.frames_s, 3),
            "taken_s": taken_s,
        },
        "timestamps": link.stamps.summary(),
        "frames": link.line,
        "non_volatile_writes": bench.non_volatile_writes,
        "wear_cycles": wear_cycles(bench.spec),
        "unsolicited_sdo_responses": illegal.unsolicited,
        "improper_sdo_responses": illegal.improper,
        "improper_heartbeats": illegal.error_control,
        "improper_lss_responses": illegal.lss,
        "restarts": illegal.restarts,
        "unanswered_sdo_requests": illegal.unanswered,
        "sdo_response_times": dict(bench.channel.times.summary()),
    }
