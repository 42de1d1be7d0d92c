"""TPDO: its inhibit time (CiA 301 v4.2.0, 7.5.2.37)."""

from __future__ import annotations

import math
from collections.abc import Iterable

from conformance.bench.bus.link import Stamped
from conformance.bench.node.node import Node
from conformance.bench.services.tpdo import TpdoPort
from conformance.bench.settings.in_force import InForce
from conformance.checks.limits import gap_tolerance_ms
from conformance.checks.pdo.tpdo_cases import (
    asynchronous_type,
    is_free,
    judge_reading,
    outcome_of,
    parameter,
    parameter_of,
    readings_of,
    timed,
    typed,
)
from conformance.checks.pdo.tpdos import (
    INHIBIT_SUB,
    event_time_ms,
    others_off,
    paced,
    port_of,
    require_acts,
    set_up,
    waiting,
)
from conformance.checks.steps import COB_ID_SUB, tpdo_service
from conformance.errors import SetupRefused
from conformance.numbers import figure
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.verdict import Verdict

COMMUNICATION = f"{CIA301}, 7.5.2.37"
EVENT_MS = 20
APART = 4.5
"""Event times from one TPDO to the next, at least."""
SEEN = 8


def _inhibitable(cases: Iterable[Case], spec: DeviceSpec) -> Iterable[Case]:
    for case in cases:
        if is_free(parameter(spec, case.subject, INHIBIT_SUB)):
            yield case


def _timed(spec: DeviceSpec) -> Iterable[Case]:
    for case in _inhibitable(timed(spec), spec):
        if is_free(parameter(spec, case.subject, COB_ID_SUB)):
            yield case


def _valid(spec: DeviceSpec) -> Iterable[Case]:
    return _inhibitable(typed(spec), spec)


@requirement(
    "TPDO-11",
    level="shall",
    cases=("number", waiting(_timed)),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_inhibit_time_keeps_tpdos_apart(
    node: Node, number: int, in_force: InForce, verdict: Verdict
) -> None:
    """TPDOs are not closer than the inhibit time, in multiples of its unit."""
    port = port_of(node, number)
    kind = asynchronous_type(node.spec, number)
    event_ms = event_time_ms(node.spec, number, EVENT_MS)
    if kind is None or event_ms is None:
        raise SetupRefused("the manual offers no event timer to make the TPDO come")
    others_off(node, number)
    before_ms, apart_ms = port.period_ms, APART * event_ms
    set_up(node, port, kind, event_ms)
    port.set_inhibit_time(round(apart_ms * 1000 / tpdo_service(node).inhibit_unit_us))
    port.start()
    require_acts(in_force, port, before_ms, verdict)

    seen = port.collect(SEEN + 1, SEEN * 3 * apart_ms / 1000)[1:]

    ends_ms = {"all": (apart_ms, apart_ms + event_ms), "changes": (event_ms, event_ms)}
    words = {inhibited: f"{low:g} to {high:g} ms" for inhibited, (low, high) in ends_ms.items()}
    margins = {words[it]: _margin_ms(port, seen, *ends) for it, ends in ends_ms.items()}
    fitting = [it for it, margin_ms in margins.items() if margin_ms >= 0]
    gaps = port.gaps_ms(seen, apart_ms)
    actual = fitting[0] if fitting else " ".join(figure(gap, 4) for gap in gaps) or "none seen"
    readings = readings_of(node.spec, lambda tpdo: words[tpdo.inhibited])
    late_ms = verdict.uncertainty_ms()
    margin_ms = max(margins[it] for it in readings)
    open_ms = late_ms if abs(margin_ms) <= late_ms else 0.0
    judge_reading(verdict, f"TPDOs apart, with {apart_ms:g} ms", readings, actual, open_ms)


def _margin_ms(port: TpdoPort, seen: list[Stamped], low_ms: float, high_ms: float) -> float:
    """Return how far inside two ends all intervals are, in ms; negative where one is not."""
    tolerance_ms = gap_tolerance_ms(high_ms)
    gaps = port.gaps_ms(seen, (low_ms + high_ms) / 2)
    inside_ms = (min(gap - low_ms, high_ms - gap) + tolerance_ms for gap in gaps)
    return min(inside_ms, default=-math.inf)


@requirement(
    "TPDO-12",
    level="shall",
    cases=("number", _valid),
    source=COMMUNICATION,
    effects=("reads", "writes"),
)
def test_inhibit_time_of_a_valid_tpdo(node: Node, number: int, verdict: Verdict) -> None:
    """While the TPDO is valid a new inhibit time is refused and the old one stays, or taken where documented."""
    port, entry = port_of(node, number), parameter_of(node, number, INHIBIT_SUB)
    pace = paced(node, number)
    set_up(node, port, pace.transmission_type, pace.event_ms)
    present = node.upload(*entry.key)
    other = entry.type.encode(int.from_bytes(present, "little") ^ 1)

    answer = node.try_download(*entry.key, other)

    readings = readings_of(node.spec, lambda tpdo: tpdo.change_while_valid)
    judge_reading(verdict, f"another {entry.address} while valid", readings, outcome_of(answer))
    verdict.equal(
        f"{entry.address} afterwards",
        node.upload(*entry.key),
        present if answer.refused else other,
        show=lambda data: data.hex(" ").upper(),
    )
