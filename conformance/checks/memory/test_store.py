"""Store parameters, 1010h (CiA 301 v4.2.0, 7.5.2.13)."""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.bench.settings.settings import Settings
from conformance.bench.settings.trials import observe_late
from conformance.checks.memory import kept, storable
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict

STORE = f"{CIA301}, 7.5.2.13"
POWER_ON_VALUES = f"{CIA301}, 7.3.2.2.1"


@requirement(
    "STO-01", level="manual", cases=("entry", storable.stored_settings), effects=storable.STORES
)
def test_stored_setting_survives_a_reset(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that was stored holds its value after NMT reset node."""
    outcome = kept.kept(bench, node, verdict, save=True, power=False)

    kept.require_changed(entry, outcome)

    kept.judge_value(verdict, entry, outcome.after, outcome.chosen)


@requirement(
    "STO-02",
    level="manual",
    cases=("entry", storable.stored_settings),
    effects=(*storable.STORES, "power"),
)
def test_stored_setting_survives_a_power_cycle(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that was stored holds its value after the supply was off."""
    outcome = kept.kept(bench, node, verdict, save=True, power=True)

    kept.require_changed(entry, outcome)

    kept.judge_value(verdict, entry, outcome.after, outcome.chosen)


@requirement(
    "STO-03",
    level="shall",
    cases=("entry", storable.stored_settings),
    source=POWER_ON_VALUES,
    effects=storable.STORES,
)
def test_setting_not_stored_is_lost_at_a_reset(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that was not stored holds its former value after NMT reset node."""
    outcome = kept.kept(bench, node, verdict, save=False, power=False)

    kept.require_changed(entry, outcome)

    kept.judge_value(verdict, entry, outcome.after, outcome.found)


@requirement(
    "STO-04",
    level="shall",
    cases=("entry", storable.stored_settings),
    source=POWER_ON_VALUES,
    effects=(*storable.STORES, "power"),
)
def test_setting_not_stored_is_lost_at_a_power_cycle(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that was not stored holds its former value after the supply was off."""
    outcome = kept.kept(bench, node, verdict, save=False, power=True)

    kept.require_changed(entry, outcome)

    kept.judge_value(verdict, entry, outcome.after, outcome.found)


@requirement(
    "STO-05", level="manual", cases=("sub", storable.store_groups), effects=storable.STORES
)
def test_signature_is_confirmed(node: Node, sub: int, verdict: Verdict) -> None:
    """The documented signature is confirmed."""
    store = node.spec.services.store
    if store is None:
        raise SetupRefused("the manual documents no store")
    Settings(node).begin()

    transfer = node.try_download(store.object, sub, store.word.to_bytes(4, "little"))

    kept.judge_confirmed(verdict, transfer)


@requirement(
    "STO-06",
    level="shall",
    cases=("sub", storable.store_groups),
    source=STORE,
    effects=storable.STORES,
)
def test_wrong_signature_is_refused(bench: Bench, node: Node, sub: int, verdict: Verdict) -> None:
    """Any other signature than the documented one is refused."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.store, sub)

    kept.judge_refused(verdict, outcome, sub)


@requirement(
    "STO-07",
    level="shall",
    cases=("sub", storable.store_groups),
    source=STORE,
    effects=storable.STORES,
)
def test_wrong_signature_has_its_abort_code(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """The abort of a wrong signature says that the data cannot be stored: 0800 002xh."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.store, sub)

    kept.judge_abort_codes(verdict, outcome, sub, "STO-06")


@requirement(
    "STO-08",
    level="shall",
    cases=("sub", storable.store_groups),
    source=STORE,
    effects=storable.STORES,
)
def test_wrong_signature_stores_nothing(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """A wrong signature stores nothing."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.store, sub).kept

    changed = [case.subject for case in storable.stored_settings(node.spec)]

    kept.judge_unchanged(verdict, "settings after a reset", changed, outcome.after, outcome.found)


@requirement(
    "STO-09", level="shall", cases=("entry", storable.readable_signatures("store")), source=STORE
)
def test_store_tells_that_it_stores_on_command(node: Node, entry: Entry, verdict: Verdict) -> None:
    """What can be stored by a signature says so when it is read: bit 0 is set."""
    kept.judge_on_command(verdict, node, entry)


@requirement("STO-10", level="manual", cases=("entry", storable.documented_signatures("store")))
def test_store_reads_as_documented(node: Node, entry: Entry, verdict: Verdict) -> None:
    """What stores parameters reads as the manual has it."""
    value = node.number(*entry.key)

    verdict.one_of(f"value of {entry.address}", value, storable.answers(entry))


def _signatures(spec: DeviceSpec) -> Iterable[Case]:
    """Return every sub-index of store and restore whose value every reading of the manual tells."""
    for name in ("store", "restore"):
        for case in storable.documented_signatures(name)(spec):
            effects = storable.STORES if name == "store" else storable.RESTORES
            yield Case(case.label, case.subject, case.section, effects)


@requirement("STO-11", level="manual", cases=("entry", _signatures))
def test_signature_is_not_kept(bench: Bench, node: Node, entry: Entry, verdict: Verdict) -> None:
    """What stores or restores reads as documented after it was done and the node has restarted."""
    told = kept.told(bench, node, verdict, entry)

    kept.require_told(entry, told)

    value = int.from_bytes(told.data or b"", "little")
    verdict.one_of(f"value of {entry.address}", value, storable.answers(entry))


@requirement(
    "STO-13", level="manual", cases=("entry", storable.disputed_settings), effects=storable.STORES
)
def test_setting_of_disputed_store_is_kept_or_not(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that a store keeps by some readings alone holds its value after a reset, or its former one."""
    outcome = kept.kept(bench, node, verdict, save=True, power=False)

    kept.require_changed(entry, outcome)

    after, chosen = outcome.after[entry.key], outcome.chosen[entry.key]
    verdict.one_of(
        f"value of {entry.address}", after, [chosen, outcome.found[entry.key]], show=bytes.hex
    )
    for kept_by_it, other in storable.keeping(node.spec, entry):
        if kept_by_it == (after == chosen):
            if other is not None:
                verdict.follows(other.ambiguity, other.reading)
            break


@requirement(
    "STO-14", level="manual", cases=("entry", storable.late_settings), effects=storable.STORES
)
def test_setting_that_may_act_late_survives_a_reset(
    node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that may read as before until it is stored holds its value after NMT reset node."""
    value = storable.late_values(entry)[0]

    after = observe_late(node, entry.key, value)

    kept.judge_value(verdict, entry, after, {entry.key: entry.type.encode(value)})


@requirement(
    "STO-15", level="manual", cases=("entry", storable.stored_defaults), effects=storable.STORES
)
def test_default_that_was_stored_again_survives_a_reset(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting of which another value was stored and then its default holds its default after NMT reset node."""
    outcome = kept.stored_defaults(bench, node, verdict)

    kept.require_changed(entry, outcome)

    kept.judge_value(verdict, entry, outcome.after, outcome.chosen)
