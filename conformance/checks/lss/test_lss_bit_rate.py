"""LSS configures the bit rate: what it takes, how it is activated and kept (CiA 305 v3.0, 6.4 and 6.5)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.reach import Place
from conformance.bench.services.lss import LssPort
from conformance.bench.services.lss_master import DONE
from conformance.checks.lss.lss_cases import (
    CIA305,
    OUT_OF_RANGE,
    bit_timings,
    ever,
    follow,
    offers,
    once,
    other_bit_timing,
    services_in,
    show_outcome,
    unknown_bit_timings,
    with_other_rate,
)
from conformance.errors import SetupRefused
from conformance.requirements import Case, requirement
from conformance.spec.model import DeviceSpec
from conformance.spec.services import Services
from conformance.verdict import Verdict

BIT_TIMING = f"{CIA305}, 6.4"
STORE = f"{CIA305}, 6.5"


def _known(spec: DeviceSpec) -> Iterable[Case]:
    for source in ever(spec, "configure-bit-timing", "configuration"):
        for index in bit_timings(spec):
            yield Case(f"13h/0/{index}", index, source)


@requirement(
    "LSS-19",
    level="manual",
    cases=("index", _known),
    source=BIT_TIMING,
    effects=("reads", "bitrate", "resets"),
)
def test_bit_timing_is_configured(lss: LssPort, index: int, verdict: Verdict) -> None:
    """A bit rate that the manual documents is configured by its place in the table, error code 0."""
    lss.enter()
    lss.configure()

    answer = lss.bit_timing(0, index)

    verdict.equal(f"answer to bit timing {index}", answer.error_code, DONE, show=show_outcome)


def _unknown(spec: DeviceSpec) -> Iterable[Case]:
    for source in ever(spec, "configure-bit-timing", "configuration"):
        for table, index in unknown_bit_timings(spec):
            yield Case(f"13h/{table}/{index}", (table, index), source)


@requirement(
    "LSS-20",
    level="shall",
    cases=("timing", _unknown),
    source=BIT_TIMING,
    effects=("reads", "bitrate", "resets"),
)
def test_reserved_bit_timing_is_refused(
    lss: LssPort, timing: tuple[int, int], verdict: Verdict
) -> None:
    """A table or place that the standard reserves is answered with error code 1."""
    lss.enter()
    lss.configure()

    answer = lss.bit_timing(*timing)

    verdict.equal("answer", answer.error_code, OUT_OF_RANGE, show=show_outcome)


@requirement(
    "LSS-21",
    level="manual",
    cases=with_other_rate(once("15h", "configure-bit-timing", "activate-bit-timing")),
    source=BIT_TIMING,
    effects=("reads", "bitrate", "resets"),
)
def test_bit_rate_is_activated(lss: LssPort, spec: DeviceSpec, verdict: Verdict) -> None:
    """After twice the switch delay the node is on the bus at the bit rate activated."""
    home, away = _configure_rate(lss, spec)

    lss.activate(away.bitrate)
    seen = lss.locate(away, home)

    activated = seen == away
    places = {True: away, False: home}
    allowed = {_activates(services) for services, _ in spec.services_readings}
    verdict.holds(
        "place after twice the switch delay",
        expected=" or ".join(str(places[it]) for it in sorted(allowed, reverse=True)),
        actual=str(seen),
        ok=seen is not None and activated in allowed,
    )
    follow(verdict, spec, lambda it: _activates(it) == activated)


def _activated_elsewhere(spec: DeviceSpec) -> Iterable[Case]:
    """Return one case where by no reading LSS waiting has the activation that configuration has."""
    needed = with_other_rate(once("waiting/15h", "configure-bit-timing", "activate-bit-timing"))
    return () if True in offers(spec, "activate-bit-timing", "waiting") else needed(spec)


@requirement(
    "LSS-24",
    level="shall",
    cases=_activated_elsewhere,
    source=BIT_TIMING,
    effects=("reads", "bitrate", "resets"),
)
def test_bit_rate_is_not_activated_in_waiting(
    lss: LssPort, spec: DeviceSpec, verdict: Verdict
) -> None:
    """A bit rate that was configured is not activated in LSS waiting."""
    home, away = _configure_rate(lss, spec)
    lss.require_waiting()

    lss.activate(away.bitrate)
    seen = lss.locate(home, away)

    verdict.equal("place after twice the switch delay", str(seen), str(home))


def _activates(services: Services) -> bool:
    listed = "activate-bit-timing" in services_in(services.lss, "configuration")
    return listed and services.lss is not None and services.lss.acts == "configured"


def _configure_rate(lss: LssPort, spec: DeviceSpec) -> tuple[Place, Place]:
    """Configure another bit rate; return where the node is, and where it is to be."""
    home = lss.reach.home
    other = other_bit_timing(spec, home.bitrate)
    if other is None:
        raise SetupRefused("there is no other bit rate that LSS is documented to set and undo")
    index, bitrate = other
    lss.enter()
    lss.configure()
    lss.prepared("a bit rate", lss.bit_timing(0, index), "LSS-19")
    return home, Place(home.node_id, bitrate)


@requirement(
    "LSS-22",
    level="manual",
    cases=with_other_rate(once("17h/bitrate", "configure-bit-timing", "store-configuration")),
    source=STORE,
    effects=("reads", "bitrate", "resets", "non-volatile", "power"),
)
def test_stored_bit_rate_is_kept(lss: LssPort, spec: DeviceSpec, verdict: Verdict) -> None:
    """A bit rate that was stored is the node's after the supply was switched off and on."""
    lss.begin()
    home, away = _configure_rate(lss, spec)
    lss.prepared("the store", lss.store(), "LSS-18")
    lss.wait()

    after = lss.reach.power_cycle(lss.node, away, home)

    verdict.equal("place after power-on", str(after), str(away))
