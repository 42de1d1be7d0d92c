"""Errors on the bus: what the node tells of them, and how it comes back from bus-off (ISO 11898-1)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from conformance.bench.node.node import Node
from conformance.bench.sensor.recovery import observe_without_recovery
from conformance.bench.sensor.stimulus import Stimulus
from conformance.bench.services.emcy import WINDOW_S, EmcyPort, decoded, errors_to_come
from conformance.checks.errors.emcies import (
    code_word,
    code_words,
    kept,
    register_object,
    register_word,
)
from conformance.checks.memory.storable import STORES
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases, requirement
from conformance.spec.document import BusErrors
from conformance.spec.fields import key_of
from conformance.spec.model import DeviceSpec, OtherServices
from conformance.verdict import Verdict

T = TypeVar("T")
BACK_S = 2.0
"""How long a node has to come back from bus-off; the controller alone takes less than 0.2 s."""


def _told(label: str, code: Callable[[BusErrors], int | None]) -> Cases:
    def generate(spec: DeviceSpec) -> Iterable[Case]:
        service = spec.services.bus_errors
        word = None if service is None else code(service)
        if service is not None and word is not None and spec.services.emcy_producer is not None:
            yield Case(f"{code_word(word)}/{label}", None, service.source, kept(spec))

    return generate


def _readings(spec: DeviceSpec, value: Callable[[BusErrors], T]) -> dict[T, OtherServices | None]:
    """Return what any reading has of something, and the reading."""
    found: dict[T, OtherServices | None] = {}
    for services, other in spec.services_readings:
        if services.bus_errors is not None:
            found.setdefault(value(services.bus_errors), other)
    return found


def _judge_code(
    verdict: Verdict, wanted: dict[int | None, OtherServices | None], told: list[int]
) -> None:
    """Judge that one of some codes was told; None for none."""
    seen = [code for code in wanted if code in told or (code is None and not told)]
    verdict.holds(
        "error codes told",
        expected=" or ".join("none" if code is None else code_word(code) for code in wanted),
        actual=code_words(told),
        ok=bool(seen),
    )
    other = wanted[seen[0]] if seen else None
    if other is not None:
        verdict.follows(other.ambiguity, other.reading)


@requirement(
    "EMCY-27",
    level="manual",
    cases=_told("error-passive", lambda it: it.error_passive),
    needs=("bus-errors",),
)
def test_error_passive_is_told(
    node: Node, emcy: EmcyPort, stimulus: Stimulus, verdict: Verdict
) -> None:
    """A CAN controller that has become error passive is told by an EMCY with the documented code."""
    emcy.begin()
    mark = node.link.mark()

    with stimulus.bus_error("error-passive"):
        emcy.listen(WINDOW_S)
        told = [decoded(it).error_code for it in node.link.since(mark, emcy.matches)]

    _judge_code(verdict, _readings(node.spec, lambda it: it.error_passive), told)


def _register(spec: DeviceSpec) -> Iterable[Case]:
    service = spec.services.bus_errors
    for case in register_object(spec) if service is not None and service.register_bits else ():
        yield Case(case.label, case.subject, case.section, kept(spec))


@requirement("EMCY-28", level="manual", cases=("index", _register), needs=("bus-errors",))
def test_error_passive_is_in_the_register(
    node: Node, emcy: EmcyPort, stimulus: Stimulus, index: int, verdict: Verdict
) -> None:
    """While the CAN controller is error passive, the error register has the documented bits set."""
    emcy.begin()

    with stimulus.bus_error("error-passive"):
        register = node.number(index)

    masks = _readings(node.spec, lambda it: sum(1 << bit for bit in it.register_bits))
    fitting = [mask for mask in masks if register & mask == mask]
    verdict.holds(
        "error register",
        expected=" or ".join(f"{register_word(mask)} set" for mask in masks),
        actual=register_word(register),
        ok=bool(fitting),
    )
    other = masks[fitting[0]] if fitting else None
    if other is not None:
        verdict.follows(other.ambiguity, other.reading)


@requirement(
    "EMCY-29",
    level="manual",
    cases=_told("after-bus-off", lambda it: it.after_bus_off),
    effects=("reads", "power"),
    needs=("bus-errors",),
)
def test_return_from_bus_off_is_told(
    node: Node, emcy: EmcyPort, stimulus: Stimulus, verdict: Verdict
) -> None:
    """A node that leaves bus-off by itself answers again and tells so with the documented code."""
    _require_recovery(node)
    emcy.begin()
    mark = node.link.mark()

    with stimulus.bus_error("bus-off"):
        pass
    emcy.listen(BACK_S)

    told = [decoded(it).error_code for it in node.link.since(mark, emcy.matches)]
    back = node.answers()
    verdict.holds(
        "after bus-off", expected="an answer", actual="an answer" if back else "none", ok=back
    )
    _judge_code(verdict, _readings(node.spec, lambda it: it.after_bus_off), told)
    if not back:
        node.power_cycle()


def _require_recovery(node: Node) -> None:
    """Make sure that the node is set to leave bus-off by itself.

    Raises:
        SetupRefused: It is not.
    """
    service = node.spec.services.bus_errors
    rule = service.recovery if service is not None else None
    if rule is not None and node.number(*key_of(rule.object)) != rule.value:
        raise SetupRefused("the node is not set to leave bus-off by itself")


def _recoveries(spec: DeviceSpec) -> Iterable[Case]:
    service = spec.services.bus_errors
    if service is not None and service.recovery is not None:
        entry = spec.entries[key_of(service.recovery.object)]
        others = [it for it in entry.values or () if it != service.recovery.value]
        if others and not entry.optional:
            yield Case(entry.address, (entry.key, others[0]), service.source)


@requirement(
    "EMCY-30",
    level="manual",
    cases=("setting", _recoveries),
    effects=(*STORES, "power"),
    needs=("bus-errors",),
)
def test_node_stays_in_bus_off(
    node: Node, stimulus: Stimulus, setting: tuple[tuple[int, int], int], verdict: Verdict
) -> None:
    """With the recovery switched off, a node stays in bus-off until its supply is switched."""
    with errors_to_come(node, stimulus):
        seen = observe_without_recovery(node, stimulus, *setting, wait_s=BACK_S)

    words = {True: "an answer", False: "no answer"}
    verdict.equal("after bus-off", words[seen.before], words[False])
    verdict.equal("after a power cycle", words[seen.after], words[True])
