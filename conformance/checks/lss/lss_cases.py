"""What the readings of a manual say of LSS: which service in which state, which figures are certain."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Literal, TypeAlias

from conformance.bench.node.reach import Place
from conformance.bench.services.lss import index_of
from conformance.bench.services.lss_master import LssAnswer
from conformance.requirements import Case, Cases
from conformance.spec.bit_rates import documented_rates
from conformance.spec.document import Lss, Services
from conformance.spec.model import DeviceSpec, Entry, OtherServices, is_legal
from conformance.spec.services import LssService
from conformance.verdict import Verdict
from conformance.wire import lss
from conformance.wire.lss import LssCommand

LssState: TypeAlias = Literal["waiting", "configuration"]
Acts: TypeAlias = Literal["configured", "stored"]
CIA305 = "CiA 305 v3.0"
SILENT = "no answer"
OUT_OF_RANGE = 1
NUMBERS = ("vendor-id", "product-code", "revision-number", "serial-number")
"""The four numbers of an LSS address, in the order of 1018h."""


def services_in(service: Lss | None, state: LssState) -> frozenset[LssService]:
    """Return the services of one reading in an LSS state; all four numbers include the last."""
    if service is None:
        return frozenset()
    listed = service.waiting if state == "waiting" else service.configuration
    more: tuple[LssService, ...] = ("inquire-serial-number",)
    return frozenset((*listed, *(more if "inquire-identity" in listed else ())))


def offers(spec: DeviceSpec, service: LssService, state: LssState) -> set[bool]:
    """Return whether a service is offered in a state, under each reading."""
    return {service in services_in(it.lss, state) for it, _ in spec.services_readings}


def ever(spec: DeviceSpec, service: LssService, state: LssState) -> Iterator[str]:
    """Return the section of the manual when some reading offers a service in a state."""
    if spec.services.lss is not None and True in offers(spec, service, state):
        yield spec.services.lss.source


def once(
    label: str,
    *needed: LssService,
    state: LssState = "configuration",
) -> Cases:
    """Return one case where some reading offers all services that a check needs."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        if spec.services.lss is not None and all(
            True in offers(spec, service, state) for service in needed
        ):
            yield Case(label, None, spec.services.lss.source)

    return generate


def judge_support(
    verdict: Verdict, spec: DeviceSpec, service: LssService, state: LssState, answer: LssAnswer
) -> bool:
    """Judge whether a service is there, as far as the manual says; return whether it is."""
    answered = answer.received is not None
    allowed = offers(spec, service, state)
    words = {True: "an answer", False: "no answer"}
    verdict.holds(
        service,
        expected=" or ".join(words[it] for it in sorted(allowed, reverse=True)),
        actual=str(answer),
        ok=answered in allowed,
    )
    follow(verdict, spec, lambda it: (service in services_in(it.lss, state)) == answered)
    return answered


def acts(spec: DeviceSpec) -> set[Acts]:
    """Return whether node-ID and bit rate act once configured or once stored, under each reading."""
    return {it.lss.acts for it, _ in spec.services_readings if it.lss is not None}


def judge_acts(
    verdict: Verdict,
    spec: DeviceSpec,
    acted: Acts,
    places: dict[Acts, Place],
    seen: Place | None,
) -> None:
    """Judge where a node is after a node-ID was configured and the communication reset."""
    verdict.holds(
        "place after the reset",
        expected=" or ".join(str(places[it]) for it in sorted(acts(spec))),
        actual=str(seen),
        ok=seen is not None and acted in acts(spec),
    )
    follow(verdict, spec, lambda it: it.lss is not None and it.lss.acts == acted)


def follow(
    verdict: Verdict, spec: DeviceSpec, agrees: Callable[[Services], bool]
) -> OtherServices | None:
    """Note the first reading that agrees with what was seen, unless it is the judged one."""
    for services, other in spec.services_readings:
        if agrees(services):
            if other is not None:
                verdict.follows(other.ambiguity, other.reading)
            return other
    return None


def node_ids(spec: DeviceSpec) -> tuple[int, ...]:
    """Return node-IDs that LSS takes under every reading: both edges and one in between."""
    ranges = [entry.legal for entry in _holders(spec, "node_id")]
    certain = [n for n in range(1, 128) if all(is_legal(n, legal) for legal in ranges)]
    if not certain:
        return ()
    return tuple(dict.fromkeys((certain[0], certain[len(certain) // 2], certain[-1])))


def _holders(spec: DeviceSpec, name: Literal["node_id", "bitrate"]) -> list[Entry]:
    moved = getattr(spec.services, name)
    entry = None if moved is None else spec.entry(moved.object)
    return [] if entry is None else list(entry.readings)


def bit_timings(spec: DeviceSpec) -> dict[int, int]:
    """Return the places of the standard's table whose bit rate the manual documents, in bit/s."""
    documented = _rates(spec)
    return {n: rate for n, rate in lss.BIT_RATES.items() if rate in documented}


def unknown_bit_timings(spec: DeviceSpec) -> tuple[tuple[int, int], ...]:
    """Return tables and places that the standard reserves and that no bit rate is documented for."""
    documented = set(_rates(spec).values())
    places = (index for index in (5, 10, 255) if index not in documented)
    return (*((0, index) for index in places), (1, 0), (127, 0))


def other_bit_timing(spec: DeviceSpec, bitrate: int) -> tuple[int, int] | None:
    """Return another place of the table and its bit rate, where both can be set over LSS."""
    certain = bit_timings(spec)
    if index_of(bitrate) not in certain:
        return None
    return next(((n, rate) for n, rate in certain.items() if rate != bitrate), None)


def with_other_rate(cases: Cases) -> Cases:
    """Return cases of a rule on a new bit rate: none where no other one is documented."""

    def generate(spec: DeviceSpec) -> Iterable[Case]:
        return () if other_bit_timing(spec, spec.bitrate) is None else cases(spec)

    return generate


def _rates(spec: DeviceSpec) -> dict[int, int]:
    """Return the bit rates in bit/s that every reading takes, and the values of their object."""
    entries = _holders(spec, "bitrate")[:1]
    rates = documented_rates(spec).items()
    return {rate: value for rate, value in rates if all(it.always_legal(value) for it in entries)}


def inquiry(number: int) -> lss.InquireIdentity:
    """Return the request for one of the four numbers, 0 to 3."""
    return lss.InquireIdentity(LssCommand(LssCommand.INQUIRE_VENDOR + number))


def show_outcome(error_code: int | None) -> str:
    """Return an error code in words."""
    return "no answer with an error code" if error_code is None else f"error code {error_code}"
