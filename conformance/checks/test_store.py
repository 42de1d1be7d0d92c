"""Store parameters, 1010h (CiA 301 v4.2.0, 7.5.2.13)."""

from __future__ import annotations

from conformance.bench.keeping import signature
from conformance.bench.node import Node
from conformance.bench.session import Bench
from conformance.bench.settings import Settings
from conformance.checks import kept
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, requirement
from conformance.spec.model import Entry
from conformance.verdict import Verdict
from conformance.wire.abort import AbortCode, describe

STORE = f"{CIA301}, 7.5.2.13"
POWER_ON_VALUES = f"{CIA301}, 7.3.2.2.1"
NOT_STORED = (
    AbortCode.DATA_NOT_STORED,
    AbortCode.LOCAL_CONTROL,
    AbortCode.DEVICE_STATE,
    AbortCode.NO_OBJECT_DICTIONARY,
    AbortCode.NO_DATA_AVAILABLE,
)
"""The codes 0800 002xh, which the standard has for a wrong signature."""


@requirement("STO-01", level="manual", cases=("entry", kept.stored_settings), effects=kept.STORES)
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
    cases=("entry", kept.stored_settings),
    effects=(*kept.STORES, "power"),
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
    cases=("entry", kept.stored_settings),
    source=POWER_ON_VALUES,
    effects=kept.STORES,
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
    cases=("entry", kept.stored_settings),
    source=POWER_ON_VALUES,
    effects=(*kept.STORES, "power"),
)
def test_setting_not_stored_is_lost_at_a_power_cycle(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that was not stored holds its former value after the supply was off."""
    outcome = kept.kept(bench, node, verdict, save=False, power=True)

    kept.require_changed(entry, outcome)

    kept.judge_value(verdict, entry, outcome.after, outcome.found)


@requirement("STO-05", level="manual", cases=("sub", kept.store_groups), effects=kept.STORES)
def test_signature_is_confirmed(node: Node, sub: int, verdict: Verdict) -> None:
    """The documented signature is confirmed."""
    store = node.spec.services.store
    if store is None:
        raise SetupRefused("the manual documents no store")
    Settings(node).begin()

    transfer = node.try_download(store.object, sub, signature(store).to_bytes(4, "little"))

    verdict.holds(
        "answer to the signature",
        expected="a confirmation",
        actual=str(transfer),
        ok=transfer.confirmed,
    )


@requirement(
    "STO-06",
    level="shall",
    cases=("sub", kept.store_groups),
    source=STORE,
    effects=kept.STORES,
)
def test_wrong_signature_is_refused(bench: Bench, node: Node, sub: int, verdict: Verdict) -> None:
    """Any other signature than the documented one is refused."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.store, sub)

    for wrong, answer in outcome.answers.items():
        verdict.holds(
            f"answer to {wrong!r}", expected="an abort", actual=str(answer), ok=answer.refused
        )


@requirement(
    "STO-07",
    level="shall",
    cases=("sub", kept.store_groups),
    source=STORE,
    effects=kept.STORES,
)
def test_wrong_signature_has_its_abort_code(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """The abort of a wrong signature says that the data cannot be stored: 0800 002xh."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.store, sub)

    codes = {wrong: answer.abort for wrong, answer in outcome.answers.items()}

    if not any(codes.values()):
        raise SetupRefused("no wrong signature is refused, see STO-06")
    for wrong, code in codes.items():
        if code is not None:
            verdict.one_of(f"abort of {wrong!r}", code, NOT_STORED, show=describe)


@requirement(
    "STO-08",
    level="shall",
    cases=("sub", kept.store_groups),
    source=STORE,
    effects=kept.STORES,
)
def test_wrong_signature_stores_nothing(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """A wrong signature stores nothing."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.store, sub).kept

    changed = [case.subject for case in kept.stored_settings(node.spec)]

    kept.judge_unchanged(verdict, "settings after a reset", changed, outcome.after, outcome.found)


@requirement(
    "STO-09", level="shall", cases=("entry", kept.readable_signatures("store")), source=STORE
)
def test_store_tells_that_it_stores_on_command(node: Node, entry: Entry, verdict: Verdict) -> None:
    """What can be stored by a signature says so when it is read: bit 0 is set."""
    value = node.number(*entry.key)

    verdict.holds(
        f"value of {entry.address}", expected="bit 0 set", actual=f"{value:08X}h", ok=value & 1 == 1
    )
