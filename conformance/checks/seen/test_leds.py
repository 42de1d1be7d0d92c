"""Lights of the device, looked at by the bench's operator (CiA 303-3 names the usual patterns)."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import NamedTuple

from conformance.bench.node.node import Node
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.emcy import EmcyPort, errors_to_come
from conformance.bench.services.lights import LightsPort, Pattern, pattern_of
from conformance.bench.services.lss import LssPort
from conformance.bench.services.lss_master import usable_state
from conformance.bench.services.provocations import Provocation
from conformance.checks.errors.emcies import above, came_about, kept
from conformance.checks.steps import ENTER
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases, requirement
from conformance.spec.document import Services
from conformance.spec.error_services import BusError
from conformance.spec.model import DeviceSpec
from conformance.spec.services import LightCondition
from conformance.verdict import Verdict
from conformance.wire.nmt import NmtCommand, NmtState


class Shown(NamedTuple):
    """A light under a condition of which the manual says what it shows."""

    light: str
    condition: LightCondition


def _shown(*conditions: LightCondition) -> tuple[str, Cases]:
    def generate(spec: DeviceSpec) -> Iterable[Case]:
        leds = spec.services.leds
        if leds is None:
            return
        for condition in conditions:
            source = leds.sources.get(condition, leds.source)
            for light in leds.shows.get(condition, {}):
                yield Case(f"{condition}/{light}", Shown(light, condition), source)

    return "shown", generate


@requirement(
    "LED-01",
    level="manual",
    cases=_shown("pre-operational", "operational", "stopped"),
    needs=("operator",),
)
def test_light_shows_the_nmt_state(
    node: Node, lights: LightsPort, shown: Shown, verdict: Verdict
) -> None:
    """In each NMT state a light shows the documented pattern."""
    node.nmt(ENTER[NmtState[shown.condition.upper().replace("-", "_")]])

    seen = lights.seen(shown.light)

    _judge(verdict, node.spec, shown, seen)


@requirement("LED-02", level="manual", cases=_shown("no-error"), needs=("operator",))
def test_light_shows_that_there_is_no_error(
    node: Node, stimulus: Stimulus, lights: LightsPort, shown: Shown, verdict: Verdict
) -> None:
    """Without an error a light shows the documented pattern."""
    producer = node.spec.services.emcy_producer
    if producer is not None and EmcyPort(node, producer, stimulus).present():
        raise SetupRefused("the node shows an error")
    node.nmt(NmtCommand.START)

    seen = lights.seen(shown.light)

    _judge(verdict, node.spec, shown, seen)


def _beyond(spec: DeviceSpec) -> Iterable[Case]:
    for error in above(spec)[:1]:
        for case in _shown("angle-limit")[1](spec):
            yield Case(case.label, (case.subject, error), case.section, kept(spec))


@requirement("LED-03", level="manual", cases=("beyond", _beyond), needs=("operator", "tilt"))
def test_light_shows_an_angle_beyond_its_limit(
    emcy: EmcyPort,
    spec: DeviceSpec,
    lights: LightsPort,
    beyond: tuple[Shown, Provocation],
    verdict: Verdict,
) -> None:
    """Tilted beyond the limit of an error, a light shows the documented pattern."""
    shown, error = beyond
    emcy.calm()
    told = emcy.provoke(error)

    if came_about(spec, emcy, error, told, verdict):
        _judge(verdict, spec, shown, lights.seen(shown.light))


@requirement("LED-04", level="manual", cases=_shown("lss-configuration"), needs=("operator",))
def test_light_shows_lss_configuration(
    lss: LssPort, spec: DeviceSpec, lights: LightsPort, shown: Shown, verdict: Verdict
) -> None:
    """In LSS configuration a light shows the documented pattern, if any, and none that tells otherwise."""
    state = usable_state(spec)
    lss.enter(state)
    lss.configure()

    seen = lights.seen(shown.light)

    _judge(verdict, spec, shown, seen, ("no-error", state))


@requirement(
    "LED-05",
    level="manual",
    cases=_shown("supply-off"),
    effects=("reads", "power"),
    needs=("operator",),
)
def test_light_shows_that_there_is_no_supply(
    node: Node, lights: LightsPort, shown: Shown, verdict: Verdict
) -> None:
    """Without supply a light shows the documented pattern."""
    with node.without_supply():
        seen = lights.seen(shown.light)

    _judge(verdict, node.spec, shown, seen)


def _with_bus_errors(spec: DeviceSpec) -> Iterable[Case]:
    for case in _shown("warning-limit", "bus-off")[1](spec):
        yield Case(case.label, case.subject, case.section, kept(spec))


@requirement(
    "LED-06",
    level="manual",
    cases=("shown", _with_bus_errors),
    effects=("reads", "power"),
    needs=("operator", "bus-errors"),
)
def test_light_shows_an_error_on_the_bus(
    node: Node, stimulus: Stimulus, lights: LightsPort, shown: Shown, verdict: Verdict
) -> None:
    """With its error counters at the warning limit, and in bus-off, a light shows the documented pattern."""
    error: BusError = "bus-off" if shown.condition == "bus-off" else "warning-limit"
    with errors_to_come(node, stimulus):
        with stimulus.bus_error(error):
            seen = lights.seen(shown.light)
        if not node.answers():
            node.power_cycle()

    _judge(verdict, node.spec, shown, seen)


def _judge(
    verdict: Verdict,
    spec: DeviceSpec,
    shown: Shown,
    seen: Pattern,
    holding: Collection[LightCondition] = (),
) -> None:
    """Judge a pattern by every reading; where one documents none, what has another meaning is wrong.

    Args:
        verdict: What the judgement goes to.
        spec: What the node is held against.
        shown: The light and what it is to show.
        seen: What it shows.
        holding: Other conditions that hold meanwhile.
    """
    words, followed = [], []
    for services, other in spec.services_readings:
        wanted = services.leds and pattern_of(services.leds, shown.condition, shown.light)
        others = _patterns(services, shown.light, holding)
        fits = seen not in others if wanted is None else seen == wanted
        words.append(str(wanted or "what tells nothing else"))
        followed += [other] if fits else []
    verdict.holds(
        f"{shown.light} light",
        expected=" or ".join(dict.fromkeys(words)),
        actual=str(seen),
        ok=bool(followed),
    )
    if followed and followed[0] is not None:
        verdict.follows(followed[0].ambiguity, followed[0].reading)


def _patterns(
    services: Services, light: str, holding: Collection[LightCondition]
) -> set[Pattern | None]:
    """Return the patterns by which a light tells what does not hold."""
    leds = services.leds
    if leds is None:
        return set()
    found = {condition: pattern_of(leds, condition, light) for condition in leds.shows}
    told = {pattern for condition, pattern in found.items() if condition in holding}
    return set(found.values()) - told
