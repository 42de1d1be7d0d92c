"""EMCY history as memory: what it is without supply, and that nobody writes its places (CiA 301 v4.2.0, 7.5.2.4)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from conformance.bench.node.node import Node
from conformance.bench.services.emcy import EmcyPort
from conformance.bench.services.provocations import AnyProvocation
from conformance.checks.errors.emcies import any_errors, told
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry, address
from conformance.verdict import Verdict

HISTORY = f"{CIA301}, 7.5.2.4"
MOST = 3


def _latest(spec: DeviceSpec) -> Entry | None:
    """Return the place of the latest error."""
    producer = spec.services.emcy_producer
    if producer is None or producer.history is None:
        return None
    return spec.entry(producer.history, 1)


def _documented(spec: DeviceSpec) -> Iterable[Case]:
    """Return the first error that can be brought about, where it is documented what is kept."""
    entry = _latest(spec)
    if entry is not None and all(it.persistent is not None for it in entry.readings):
        for case in tuple(any_errors(spec))[:1]:
            yield replace(case, label=entry.address, section=entry.source_of("persistent"))


@requirement(
    "EMCY-31",
    level="manual",
    cases=("error", _documented),
    effects=("reads", "writes", "resets", "power"),
)
def test_history_without_supply(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """After the supply was off the history holds the errors that it held, or none, as documented."""
    entry = _latest(spec)
    if entry is None or told(spec, emcy, error, verdict) is None:
        return
    emcy.end()
    before = _held(emcy)

    node.power_cycle()
    after = _held(emcy)

    readings = {it.persistent: it for it in entry.readings[::-1]}
    wanted = {persistent: before if persistent else "none" for persistent in readings}
    verdict.one_of("errors in the history", after, list(dict.fromkeys(wanted.values())))
    for other in entry.alternatives:
        if after != wanted[entry.persistent] and after == wanted[other.entry.persistent]:
            verdict.follows(other.ambiguity, other.reading)


def _held(emcy: EmcyPort) -> str:
    """Return the number of errors in the history and the latest of them, in words."""
    count = emcy.count()
    codes = ", ".join(f"{code:04X}h" for code in emcy.past(MOST))
    return f"{count}, the latest {codes}" if count else "none"


def _places(spec: DeviceSpec) -> list[Entry]:
    """Return the places of the history that by every reading are read-only."""
    latest = _latest(spec)
    return [
        place
        for place in (spec.subs(latest.index)[1:] if latest is not None else ())
        if not place.optional and all(it.access in ("ro", "const") for it in place.readings)
    ]


def _read_only(spec: DeviceSpec) -> Iterable[Case]:
    """Return the first error, where places of errors are read-only."""
    places = _places(spec)
    for case in tuple(any_errors(spec))[:1] if places else ():
        yield replace(case, label=address(places[0].index), section=places[0].source_of("access"))


@requirement(
    "EMCY-32",
    level="manual",
    cases=("error", _read_only),
    source=HISTORY,
    effects=("reads", "writes"),
)
def test_history_is_not_written(
    node: Node, spec: DeviceSpec, emcy: EmcyPort, error: AnyProvocation, verdict: Verdict
) -> None:
    """Each place of an error in the history has the documented length and refuses a download."""
    if told(spec, emcy, error, verdict) is None:
        return

    for place in _places(spec):
        held = node.sdo.upload(*place.key)
        size = place.type.size or 0
        written = node.write(*place.key, held.data or bytes(size))
        if held.data is not None:
            verdict.equal(f"octets of {place.address}", len(held.data), size)
        verdict.holds(
            f"download of its own value to {place.address}",
            expected="an abort",
            actual=str(written),
            ok=written.refused,
        )
