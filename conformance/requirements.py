"""The registry of requirements: one rule each, with a stable id, a level and a source."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, TypeVar

from conformance.effects import Effect, Need
from conformance.spec.model import DeviceSpec

Level: TypeAlias = Literal["manual", "shall", "should"]
Check = TypeVar("Check", bound=Callable[..., None])

CIA301 = "CiA 301 v4.2.0"


@dataclass(frozen=True, slots=True)
class Case:
    """One thing of the spec that a check is applied to.

    Args:
        label: Last part of the item id, such as ``1018h:01``.
        subject: What the check receives.
        section: Section of the manual that documents it.
        effects: What the check does to the node beyond its requirement's effects.
        needs: What it needs beside a bus, beyond its requirement's needs.
        at_need: Effects beyond those that it has only if the node turns out to need them, and only on
            a bench that allows them; elsewhere it is then inconclusive.
    """

    label: str
    subject: Any
    section: str
    effects: tuple[Effect, ...] = ()
    needs: tuple[Need, ...] = ()
    at_need: tuple[Effect, ...] = ()


Cases: TypeAlias = Callable[[DeviceSpec], Iterable[Case]]


@dataclass(frozen=True, slots=True)
class Requirement:
    """One rule.

    Args:
        id: Stable, never reused.
        level: ``manual`` (the device's own manual says so), ``shall`` or ``should`` (the standard).
        sentence: The rule in one sentence, from the check's docstring.
        source: Clause of the standard; empty when the manual alone is the source.
        effects: What the check does to the node.
        needs: What the check needs beside a bus.
        argument: Name of the check's argument that takes the case; empty without cases.
        cases: What of a spec the rule applies to.
        service: The CANopen service, from the check's module name.
        check: Module and function.
    """

    id: str
    level: Level
    sentence: str
    source: str
    effects: tuple[Effect, ...]
    needs: tuple[Need, ...]
    argument: str
    cases: Cases
    service: str
    check: str


REGISTRY: dict[str, Requirement] = {}


def requirement(
    identifier: str,
    *,
    level: Level,
    cases: tuple[str, Cases] | Cases,
    source: str = "",
    effects: tuple[Effect, ...] = ("reads",),
    needs: tuple[Need, ...] = (),
) -> Callable[[Check], Check]:
    """Register the decorated check as the one that verifies a requirement.

    Args:
        identifier: Stable id such as ``HB-02``.
        level: Who demands it.
        cases: What of a spec the rule applies to, with the name of the argument that takes it; or
            only the cases, when the check needs no argument.
        source: Clause of the standard.
        effects: What the check does to the node.
        needs: What the check needs beside a bus.

    Raises:
        ValueError: The id is taken by another check.
    """
    argument, generate = cases if isinstance(cases, tuple) else ("", cases)

    def register(check: Check) -> Check:
        name = f"{check.__module__}:{check.__qualname__}"
        known = REGISTRY.get(identifier)
        if known is not None and known.check != name:
            raise ValueError(f"requirement {identifier} is both {known.check} and {name}")
        made = Requirement(
            id=identifier,
            level=level,
            sentence=(check.__doc__ or "").strip().splitlines()[0],
            source=source,
            effects=effects,
            needs=needs,
            argument=argument,
            cases=generate,
            service=check.__module__.rpartition(".test_")[2],
            check=name,
        )
        REGISTRY[identifier] = made
        check.requirement = made  # type: ignore[attr-defined]  # how pytest's hooks find it again
        return check

    return register
