"""What store and restore did to settings, and what is judged by it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.node.sdo import Transfer
from conformance.bench.session import Bench
from conformance.bench.settings.trials import (
    Kept,
    Refused,
    Restored,
    Unsaved,
    observe_defaults,
    observe_defaults_stored,
    observe_kept,
    observe_late_restored,
    observe_restored,
    observe_unsaved,
    observe_wrong_signatures,
)
from conformance.checks.memory import storable
from conformance.checks.steps import of_documented_length, own_value
from conformance.errors import ConformanceError, SetupRefused
from conformance.spec.document import Store
from conformance.spec.model import DeviceSpec, Entry, Key, address
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode, describe
from conformance.wire.errors import WireError

NOT_STORED = (
    AbortCode.DATA_NOT_STORED,
    AbortCode.LOCAL_CONTROL,
    AbortCode.DEVICE_STATE,
    AbortCode.NO_OBJECT_DICTIONARY,
    AbortCode.NO_DATA_AVAILABLE,
)
"""The codes 0800 002xh, which the standard has for a wrong signature."""


# Observations, each made once in a run


def kept(bench: Bench, node: Node, verdict: Verdict, *, save: bool, power: bool) -> Kept:
    """Return what became of changed settings over a restart."""
    observe = partial(observe_kept, node, save=save, power=power)
    seen = bench.observations.once(f"kept, saved {save}, power {power}", Kept, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def stored_defaults(bench: Bench, node: Node, verdict: Verdict) -> Kept:
    """Return what became of defaults that were stored in the place of other values."""
    observe = partial(observe_defaults_stored, node)
    seen = bench.observations.once("defaults stored again", Kept, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def wrong_signatures(
    bench: Bench, node: Node, verdict: Verdict, service: Store | None, sub: int
) -> Refused:
    """Return what became of wrong signatures; those of restore are tried on stored settings.

    All sub-indices are tried together, and each by itself only where a setting did not stay.
    """
    if service is None:
        raise SetupRefused("the manual documents no such service")
    save = service == node.spec.services.restore
    keys = [case.subject.key for case in storable.stored_settings(node.spec)]
    for subs in (tuple(service.groups), (sub,)):
        observe = partial(observe_wrong_signatures, node, service, subs, save=save)
        name = f"wrong signatures at {address(service.object)}, {subs}"
        seen = bench.observations.once(name, Refused, observe)
        outcome = seen.outcome.kept
        held = outcome.chosen if save else outcome.found
        if all(outcome.after[key] == held[key] for key in keys if key in held):
            break
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def restored(bench: Bench, node: Node, verdict: Verdict, sub: int, *, power: bool) -> Restored:
    """Return what a restore of one group did."""
    observe = partial(observe_restored, node, storable.restore_of(node.spec), sub, power=power)
    seen = bench.observations.once(f"restore {sub}, power {power}", Restored, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def late_restored(node: Node, entry: Entry) -> Restored:
    """Return what became of a setting that may act late when the widest group was restored."""
    sub, service = storable.widest_restore(node.spec), storable.restore_of(node.spec)
    return observe_late_restored(node, service, sub, entry.key, storable.late_values(entry)[0])


def unsaved(bench: Bench, node: Node, verdict: Verdict, sub: int) -> Unsaved:
    """Return what became of a restore of one group that was not stored."""
    observe = partial(observe_unsaved, node, storable.restore_of(node.spec), sub)
    seen = bench.observations.once(f"restore {sub}, not stored", Unsaved, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def told(bench: Bench, node: Node, verdict: Verdict, entry: Entry) -> Transfer:
    """Return what an entry that stores or restores answers once it did and the node restarted."""
    store = node.spec.services.store
    if store is not None and store.object == entry.index:
        return kept(bench, node, verdict, save=True, power=False).told[entry.key]
    outcome = restored(bench, node, verdict, entry.sub, power=False)
    require_confirmed(outcome)
    return outcome.told[entry.key]


def default_of(bench: Bench, node: Node, verdict: Verdict, entry: Entry) -> bytes:
    """Return what a setting holds once the factory settings are restored.

    Raises:
        SetupRefused: The node does not hold it as documented; another requirement judges that.
    """
    service = node.spec.services.restore
    if service is None:
        return own_value(node, entry)
    observe = partial(observe_defaults, node, service, storable.widest_restore(node.spec))
    seen = bench.observations.once("defaults", dict, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    data = seen.outcome[entry.key]
    if isinstance(data, ConformanceError):
        raise data
    return of_documented_length(entry, data)


def that_last(bench: Bench, node: Node, verdict: Verdict, entries: Iterable[Entry]) -> list[Entry]:
    """Return those of some settings that a store, if there is one, keeps over a reset, see STO-01.

    Raises:
        SetupRefused: There are some, and none does.
    """
    settings = list(entries)
    if node.spec.services.store is None:
        return settings
    seen = kept(bench, node, verdict, save=True, power=False)
    lasting = [it for it in settings if seen.after.get(it.key) == seen.chosen.get(it.key)]
    if settings and not lasting:
        raise SetupRefused("no setting is kept by a store, see STO-01")
    return lasting


# Judgements


def require_changed(entry: Entry, outcome: Kept) -> None:
    """Make sure that a setting took the second value that a check tells it by.

    Raises:
        SetupRefused: It kept the one it had; OD-11 and OD-12 judge that.
    """
    if outcome.chosen.get(entry.key) == outcome.found.get(entry.key):
        raise SetupRefused(f"{entry.address} takes no second value, see OD-11")


def require_told(entry: Entry, answer: Transfer) -> None:
    """Make sure that an entry was read.

    Raises:
        SetupRefused: It was not; OD-02 judges that.
    """
    if answer.data is None:
        raise SetupRefused(f"upload of {entry.address}: {answer}, see OD-02")


def require_confirmed(outcome: Restored | Unsaved) -> None:
    """Make sure that the restore to be judged was not refused.

    Raises:
        SetupRefused: It was; RST-05 judges that.
    """
    if not outcome.answer.confirmed:
        raise SetupRefused(f"restore is not confirmed ({outcome.answer}), see RST-05")


def judge_refused(verdict: Verdict, outcome: Refused, sub: int) -> None:
    """Judge that each wrong signature was refused."""
    for wrong, answer in outcome.answers[sub].items():
        verdict.holds(
            f"answer to {wrong!r}", expected="an abort", actual=str(answer), ok=answer.refused
        )


def judge_abort_codes(verdict: Verdict, outcome: Refused, sub: int, refusal: str) -> None:
    """Judge with which codes wrong signatures were refused; ``refusal`` judges that they were.

    Raises:
        SetupRefused: None was.
    """
    codes = {wrong: answer.abort for wrong, answer in outcome.answers[sub].items()}
    if not any(codes.values()):
        raise SetupRefused(f"no wrong signature is refused, see {refusal}")
    for wrong, code in codes.items():
        if code is not None:
            verdict.one_of(f"abort of {wrong!r}", code, NOT_STORED, show=describe)


def judge_confirmed(verdict: Verdict, answer: Transfer) -> None:
    """Judge that the documented signature was confirmed."""
    verdict.holds(
        "answer to the signature",
        expected="a confirmation",
        actual=str(answer),
        ok=answer.confirmed,
    )


def judge_on_command(verdict: Verdict, node: Node, entry: Entry) -> None:
    """Judge that an entry says that it acts on command: bit 0 is set."""
    value = node.number(*entry.key)
    verdict.holds(
        f"value of {entry.address}", expected="bit 0 set", actual=f"{value:08X}h", ok=value & 1 == 1
    )


def judge_value(
    verdict: Verdict, entry: Entry, actual: Mapping[Key, bytes], expected: Mapping[Key, bytes]
) -> None:
    """Judge that a setting holds what it is expected to."""
    show = partial(_show, entry)
    verdict.equal(f"value of {entry.address}", actual[entry.key], expected[entry.key], show=show)


def judge_unchanged(
    verdict: Verdict,
    what: str,
    entries: Iterable[Entry],
    actual: Mapping[Key, bytes],
    expected: Mapping[Key, bytes],
) -> None:
    """Judge that each of some settings holds what it is expected to."""
    known = [entry for entry in entries if entry.key in expected]
    wrong = [entry for entry in known if actual[entry.key] != expected[entry.key]]
    verdict.holds(
        what,
        expected=f"{len(known)} settings as they were",
        actual=_list(wrong, actual) or "all as they were",
        ok=not wrong,
    )


def judge_default(verdict: Verdict, entry: Entry, outcome: Restored) -> None:
    """Judge that a setting holds its documented default, by any reading."""
    defaults = _defaults(entry)
    if outcome.chosen[entry.key] in defaults:
        raise SetupRefused(f"{entry.address} takes no value beside its default, see OD-11")
    show = partial(_show, entry)
    verdict.one_of(f"value of {entry.address}", outcome.final[entry.key], defaults, show=show)


def judge_waits(verdict: Verdict, spec: DeviceSpec, sub: int, outcome: Restored) -> None:
    """Judge that a restore changed nothing before the restart, or everything where a reading has it so."""
    group = [entry for entry in storable.settings_in(spec, sub) if entry.key in outcome.chosen]
    kept_ones = [entry for entry in group if all(it.persistent for it in entry.readings)]
    before = outcome.before
    changed = [entry for entry in group if before[entry.key] != outcome.chosen[entry.key]]
    other = storable.restore_at_once(spec)
    at_once = other is not None and all(before[it.key] in _defaults(it) for it in kept_ones)
    wanted = "as they were" if other is None else "as they were, or all at their defaults"
    verdict.holds(
        "settings before the reset",
        expected=f"{len(group)} settings {wanted}",
        actual="all at their defaults" if at_once else _list(changed, before) or "all as they were",
        ok=at_once or not changed,
    )
    if at_once and other is not None:
        verdict.follows(other.ambiguity, other.reading)


def judge_defaults(
    verdict: Verdict, what: str, spec: DeviceSpec, sub: int, values: Mapping[Key, bytes]
) -> None:
    """Judge that all settings of a restore sub-index hold their defaults."""
    known = [entry for entry in storable.settings_in(spec, sub) if entry.key in values]
    wrong = [entry for entry in known if values[entry.key] not in _defaults(entry)]
    verdict.holds(
        what,
        expected=f"{len(known)} settings at their defaults",
        actual=_list(wrong, values) or "all at their defaults",
        ok=not wrong,
    )


def _defaults(entry: Entry) -> list[bytes]:
    values = [(reading.type, reading.default_value) for reading in entry.readings]
    return list(dict.fromkeys(kind.encode(value) for kind, value in values if value is not None))


def _list(entries: list[Entry], values: Mapping[Key, bytes]) -> str:
    shown = [f"{entry.address} = {_show(entry, values[entry.key])}" for entry in entries[:5]]
    more = f" and {len(entries) - 5} more" if len(entries) > 5 else ""
    return ", ".join(shown) + more


def _show(entry: Entry, data: bytes) -> str:
    try:
        value = entry.type.decode(data)
    except WireError:
        return data.hex(" ").upper()
    if isinstance(value, int) and entry.type.size == 4 and value > 0xFFFF:
        return f"{value:08X}h"
    return str(value)
