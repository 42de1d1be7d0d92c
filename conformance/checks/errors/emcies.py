"""Emergency messages as several checks need them: which errors a spec lets a bench bring about."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

from conformance.bench.bus.link import Stamped
from conformance.bench.services.emcy import EmcyPort, cleared_by_reset, decoded, may_last
from conformance.bench.services.provocations import (
    AnyProvocation,
    BusProvocation,
    Provocation,
    provocations,
)
from conformance.effects import Effect, Need
from conformance.errors import SetupRefused
from conformance.requirements import Case
from conformance.spec.document import EmcyProducer, Services
from conformance.spec.model import DeviceSpec, address
from conformance.verdict import Verdict
from conformance.wire.emcy import Emergency

T = TypeVar("T")
NO_ERROR = 0x0000


def producers(spec: DeviceSpec) -> Iterable[Case]:
    """Return the EMCY producer by its COB-ID object."""
    producer = spec.services.emcy_producer
    if producer is not None:
        yield Case(address(producer.object), producer.object, producer.source)


def above(spec: DeviceSpec) -> list[Provocation]:
    """Return one error for each cause that tilting brings about."""
    found = provocations(spec, spec.services.emcy_producer)
    return [error for error in found if error.side == "above"]


def errors(spec: DeviceSpec) -> Iterable[Case]:
    """Return one error for each cause that tilting brings about."""
    for error in above(spec):
        label = f"{error.code:04X}h/{error.axis}"
        yield Case(label, error, error.source, kept(spec), ("sudden-tilt",))


def any_errors(spec: DeviceSpec) -> Iterable[Case]:
    """Return the errors that tilting brings about; where there are none, the one that the bus does.

    How long that one lasts no manual says, so that a reset may have to end it.
    """
    tilted = tuple(errors(spec))
    yield from tilted
    service = spec.services.bus_errors
    code = None if service is None else service.error_passive
    if service is not None and code is not None and not tilted and tuple(producers(spec)):
        label, effects = f"{code:04X}h/error-passive", dict.fromkeys((*kept(spec), "resets"))
        needs: tuple[Need, ...] = ("bus-errors",)
        yield Case(label, BusProvocation(code), service.source, tuple(effects), needs)


def both_sides(spec: DeviceSpec) -> Iterable[Case]:
    """Return each error that tilting brings about, above and below the limits."""
    for error in provocations(spec, spec.services.emcy_producer):
        label = f"{error.code:04X}h/{error.axis}/{error.side}"
        yield Case(label, error, error.source, kept(spec))


def provoked(spec: DeviceSpec) -> Iterable[Case]:
    """Return the first error that can be brought about, by the COB-ID object."""
    for case in tuple(any_errors(spec))[:1]:
        for of_producer in producers(spec):
            yield replace(case, label=of_producer.label)


def pairs(spec: DeviceSpec) -> Iterable[Case]:
    """Return the first two errors that tilting brings about, by the COB-ID object."""
    found = above(spec)[:2]
    if len(found) > 1:
        for of_producer in producers(spec):
            yield Case(of_producer.label, tuple(found), found[0].source, kept(spec))


def register_object(spec: DeviceSpec) -> Iterable[Case]:
    """Return the error register, where the manual has one."""
    producer = spec.services.emcy_producer
    index = producer.error_register if producer is not None else None
    entry = None if index is None else spec.entry(index)
    if entry is not None:
        yield Case(entry.address, entry.index, entry.source)


def with_register(spec: DeviceSpec) -> Iterable[Case]:
    """Return each error that can be brought about, of a node with an error register."""
    return any_errors(spec) if tuple(register_object(spec)) else ()


def tilted_with_register(spec: DeviceSpec) -> Iterable[Case]:
    """Return each error that tilting brings about, of a node with an error register."""
    return errors(spec) if tuple(register_object(spec)) else ()


def kept(spec: DeviceSpec) -> tuple[Effect, ...]:
    """Return what an error does to the node: it, or its history, may last until a reset, or longer."""
    producer = spec.services.emcy_producer
    resets = may_last(spec) or cleared_by_reset(spec)
    effects: tuple[Effect, ...] = ("resets",) if resets else ()
    if producer is None or producer.history is None:
        return effects
    entry = spec.entry(producer.history, 1)
    lost = entry is not None and entry.persistent is False
    return effects if lost else (*effects, "non-volatile")


def told(
    spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> list[Emergency] | None:
    """Let an error come about and return what the node says of it; for set-up.

    Returns:
        The messages, at least one; None where the manual also reads as if there were no error.
    """
    emcy.calm()
    seen = emcy.provoke(error)
    if not came_about(spec, emcy, error, seen, verdict):
        return None
    return [decoded(one) for one in require_told(seen)]


def documented_bits(spec: DeviceSpec) -> set[int]:
    """Return the bits of the error register that any reading documents."""
    found: set[int] = set()
    for services, _ in spec.services_readings:
        if services.emcy_producer is not None:
            found |= services.emcy_producer.register_bits.keys()
    return found


def came_about(
    spec: DeviceSpec,
    emcy: EmcyPort,
    error: AnyProvocation,
    seen: Sequence[Stamped],
    verdict: Verdict,
) -> bool:
    """Tell whether there was an error; if not, note the reading by which there need not be one."""
    if isinstance(error, BusProvocation):
        return bool(seen) or not _untold(spec, verdict)
    if seen or emcy.present():
        return True
    return not unlimited(spec, error, verdict, "none")


def _untold(spec: DeviceSpec, verdict: Verdict) -> bool:
    """Tell whether by a reading errors on the bus show in the register alone, and note it."""
    for services, other in spec.services_readings:
        told_by = services.bus_errors
        if other is not None and told_by is not None and told_by.error_passive is None:
            verdict.follows(other.ambiguity, other.reading)
            verdict.holds("EMCY", expected="one, or none", actual="none", ok=True)
            return True
    return False


def unlimited(spec: DeviceSpec, error: Provocation, verdict: Verdict, actual: str) -> bool:
    """Tell whether a reading has no limit for an error, and note it."""
    for services, other in spec.services_readings:
        if other is not None and error.axis not in _axes(spec, services):
            verdict.follows(other.ambiguity, other.reading)
            verdict.holds("error", expected="one, or none", actual=actual, ok=True)
            return True
    return False


def _axes(spec: DeviceSpec, services: Services) -> set[str]:
    return {error.axis for error in provocations(spec, services.emcy_producer)}


def require_told(seen: Sequence[Stamped]) -> Sequence[Stamped]:
    """Make sure that an error was told.

    Raises:
        SetupRefused: No EMCY came.
    """
    if not seen:
        raise SetupRefused("no EMCY told the error, see EMCY-03")
    return seen


def judge(
    spec: DeviceSpec,
    verdict: Verdict,
    quantity: str,
    actual: T,
    wanted: Callable[[EmcyProducer], Collection[T]],
    show: Callable[[T], str] = str,
) -> bool:
    """Judge that something is as any reading of the EMCY service has it, and note which one."""
    readings = [
        (wanted(services.emcy_producer), other)
        for services, other in spec.services_readings
        if services.emcy_producer is not None
    ]
    expected = list(dict.fromkeys(show(value) for values, _ in readings for value in values))
    followed = [other for values, other in readings if actual in values]
    if followed and followed[0] is not None:
        verdict.follows(followed[0].ambiguity, followed[0].reading)
    return verdict.holds(
        quantity, expected=" or ".join(expected), actual=show(actual), ok=bool(followed)
    )


def code_word(code: int) -> str:
    """Return an error code as the standards print it."""
    return f"{code:04X}h"


def register_word(register: int) -> str:
    """Return an error register as the standards print it."""
    return f"{register:02X}h"


def code_words(codes: Sequence[int]) -> str:
    """Return several error codes, in their order."""
    return ", ".join(map(code_word, codes)) or "none"
