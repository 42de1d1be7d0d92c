"""Settings that by some reading act only after a store and a restart, as several checks need them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from conformance.bench.node.node import Node
from conformance.bench.settings.in_force import InForce, may_wait
from conformance.bench.settings.settings import unmet_conditions
from conformance.checks.steps import require_writable
from conformance.effects import IN_FORCE, Effect
from conformance.errors import SetupRefused
from conformance.requirements import Case, Cases
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict


def at_need(*entries: Entry | None) -> tuple[Effect, ...]:
    """Return what a check has to do to the node if it follows a reading by which some settings wait."""
    return IN_FORCE if any(entry is not None and may_wait(entry) for entry in entries) else ()


def put_in_force(
    in_force: InForce,
    verdict: Verdict,
    entries: Sequence[Entry],
    goes_on: Callable[[], bool | None],
    resume: Callable[[], None] = lambda: None,
) -> bool:
    """Store settings and restart the node where they show no effect and a reading lets them wait.

    Args:
        in_force: What stores them.
        verdict: To judge that the node keeps them, and to note the reading that it follows.
        entries: The settings that were written.
        goes_on: Tells whether the node goes on as if they had not been; None where that cannot be seen.
        resume: Brings the node back to where it can be seen.

    Returns:
        Whether the node acts on them, as far as that can be seen.

    Raises:
        SetupRefused: The bench does not allow it, or cannot restart the node by its supply either.
    """
    waiting = [entry for entry in entries if may_wait(entry)]
    if not waiting or goes_on() is False:
        return True
    names = " and ".join(entry.address for entry in waiting)
    lost = in_force.put(names)
    for entry in waiting:
        verdict.equal(
            f"{entry.address} after a store and a restart",
            "lost" if entry.key in lost else "as written",
            "as written",
        )
    resume()
    still = goes_on()
    if still is False:
        follow(verdict, waiting[0])
    elif still and not in_force.by_supply:
        raise SetupRefused(
            f"{names} shows no effect after a store and a reset; the bench cannot switch the supply"
        )
    return not still


def conditional(entries: tuple[str, Cases]) -> tuple[str, Cases]:
    """Return the same cases; those of entries whose conditions may have to be stored first say so."""
    argument, generate = entries

    def generated(spec: DeviceSpec) -> Iterable[Case]:
        for case in generate(spec):
            conditions = (spec.entries.get(it.key) for it in case.subject.writable_while)
            yield replace(case, at_need=at_need(*conditions))

    return argument, generated


def require_writable_now(node: Node, entry: Entry, in_force: InForce, verdict: Verdict) -> None:
    """Make sure that an entry takes a value, its conditions stored first where they may have to be."""
    unmet = [other for other, _ in unmet_conditions(node, entry)]
    require_writable(node, entry)
    put_in_force(in_force, verdict, unmet, lambda: None)


def follow(verdict: Verdict, entry: Entry) -> None:
    """Note that the node follows the reading by which a setting waits, if that is not the judged one."""
    for other in entry.alternatives if entry.effective == "at-once" else ():
        if other.entry.effective != "at-once":
            verdict.follows(other.ambiguity, other.reading)
            return
