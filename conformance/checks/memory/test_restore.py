"""Restore default parameters, 1011h (CiA 301 v4.2.0, 7.5.2.14)."""

from __future__ import annotations

from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.checks.memory import kept, storable
from conformance.requirements import CIA301, requirement
from conformance.spec.model import Entry
from conformance.verdict import Verdict

RESTORE = f"{CIA301}, 7.5.2.14"
BY_POWER = (*storable.RESTORES, "power")


@requirement(
    "RST-01", level="manual", cases=("entry", storable.restored_settings), effects=storable.RESTORES
)
def test_restored_setting_has_its_default(
    bench: Bench, node: Node, entry: Entry, verdict: Verdict
) -> None:
    """A setting that was changed and stored holds its default after restore and reset."""
    sub = storable.widest_restore(node.spec)
    outcome = kept.restored(bench, node, verdict, sub, power=False)

    kept.require_confirmed(outcome)

    kept.judge_default(verdict, entry, outcome)


@requirement(
    "RST-02", level="manual", cases=("sub", storable.restore_groups), effects=storable.RESTORES
)
def test_group_is_restored(bench: Bench, node: Node, sub: int, verdict: Verdict) -> None:
    """Each sub-index of restore brings back the defaults of its objects."""
    outcome = kept.restored(bench, node, verdict, sub, power=False)

    kept.require_confirmed(outcome)

    kept.judge_defaults(verdict, "settings after the reset", node.spec, sub, outcome.final)


@requirement(
    "RST-03", level="manual", cases=("sub", storable.groups_with_rest), effects=storable.RESTORES
)
def test_other_groups_are_left_alone(bench: Bench, node: Node, sub: int, verdict: Verdict) -> None:
    """A sub-index of restore leaves the objects alone that belong to others."""
    others = kept.that_last(bench, node, verdict, storable.settings_beside(node.spec, sub))

    outcome = kept.restored(bench, node, verdict, sub, power=False)

    kept.judge_unchanged(
        verdict, "other settings after the reset", others, outcome.final, outcome.chosen
    )


@requirement(
    "RST-04", level="manual", cases=("sub", storable.later_restores), effects=storable.RESTORES
)
def test_restore_waits_for_the_restart(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """Restored values are not in force before the restart, or all at once where a reading has it so."""
    outcome = kept.restored(bench, node, verdict, sub, power=False)

    kept.require_confirmed(outcome)

    kept.judge_waits(verdict, node.spec, sub, outcome)


@requirement(
    "RST-05", level="manual", cases=("sub", storable.restore_groups), effects=storable.RESTORES
)
def test_signature_is_confirmed(bench: Bench, node: Node, sub: int, verdict: Verdict) -> None:
    """The documented signature is confirmed."""
    outcome = kept.restored(bench, node, verdict, sub, power=False)

    kept.judge_confirmed(verdict, outcome.answer)


@requirement(
    "RST-06",
    level="shall",
    cases=("sub", storable.restore_groups),
    source=RESTORE,
    effects=storable.RESTORES,
)
def test_wrong_signature_is_refused(bench: Bench, node: Node, sub: int, verdict: Verdict) -> None:
    """Any other signature than the documented one is refused."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.restore, sub)

    kept.judge_refused(verdict, outcome, sub)


@requirement(
    "RST-07",
    level="shall",
    cases=("sub", storable.restore_groups),
    source=RESTORE,
    effects=storable.RESTORES,
)
def test_wrong_signature_has_its_abort_code(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """The abort of a wrong signature says that the data cannot be stored: 0800 002xh."""
    outcome = kept.wrong_signatures(bench, node, verdict, node.spec.services.restore, sub)

    kept.judge_abort_codes(verdict, outcome, sub, "RST-06")


@requirement(
    "RST-08",
    level="shall",
    cases=("sub", storable.restore_groups),
    source=RESTORE,
    effects=storable.RESTORES,
)
def test_wrong_signature_restores_nothing(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """A wrong signature restores nothing."""
    restore = node.spec.services.restore
    settings = [case.subject for case in storable.stored_settings(node.spec)]
    stored = kept.that_last(bench, node, verdict, settings)

    outcome = kept.wrong_signatures(bench, node, verdict, restore, sub).kept

    kept.judge_unchanged(verdict, "settings after a reset", stored, outcome.after, outcome.chosen)


@requirement(
    "RST-09",
    level="shall",
    cases=("entry", storable.readable_signatures("restore")),
    source=RESTORE,
)
def test_restore_tells_that_it_restores(node: Node, entry: Entry, verdict: Verdict) -> None:
    """What restores defaults by a signature says so when it is read: bit 0 is set."""
    kept.judge_on_command(verdict, node, entry)


@requirement(
    "RST-10",
    level="shall",
    cases=("sub", storable.restore_groups),
    source=RESTORE,
    effects=BY_POWER,
)
def test_group_is_restored_by_a_power_cycle(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """Restored defaults are in force once the supply was off, as after a reset."""
    outcome = kept.restored(bench, node, verdict, sub, power=True)

    kept.require_confirmed(outcome)

    kept.judge_defaults(verdict, "settings after a power cycle", node.spec, sub, outcome.final)


@requirement(
    "RST-11",
    level="shall",
    cases=("sub", storable.restore_groups),
    source=RESTORE,
    effects=BY_POWER,
)
def test_restored_defaults_that_are_stored_last(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """Restored defaults that were stored hold after a further power cycle."""
    outcome = kept.restored(bench, node, verdict, sub, power=True)

    kept.require_confirmed(outcome)

    kept.judge_defaults(
        verdict, "settings after another power cycle", node.spec, sub, outcome.lasting or {}
    )


@requirement("RST-13", level="manual", cases=("sub", storable.passing_restores), effects=BY_POWER)
def test_restored_defaults_that_are_not_stored_pass(
    bench: Bench, node: Node, sub: int, verdict: Verdict
) -> None:
    """Restored defaults that were not stored are gone after a second start; what was stored is back."""
    group = [entry.key for entry in storable.settings_in(node.spec, sub)]
    settings = (case.subject for case in storable.stored_settings(node.spec))
    in_group = [entry for entry in settings if entry.key in group]
    stored = kept.that_last(bench, node, verdict, in_group)

    outcome = kept.unsaved(bench, node, verdict, sub)

    kept.require_confirmed(outcome)
    kept.judge_unchanged(verdict, "settings", stored, outcome.after, outcome.chosen)


@requirement("RST-12", level="manual", cases=("entry", storable.documented_signatures("restore")))
def test_restore_reads_as_documented(node: Node, entry: Entry, verdict: Verdict) -> None:
    """What restores defaults reads as the manual has it."""
    value = node.number(*entry.key)

    verdict.one_of(f"value of {entry.address}", value, storable.answers(entry))


@requirement(
    "RST-15",
    level="manual",
    cases=("entry", storable.late_restored_settings),
    effects=storable.RESTORES,
)
def test_setting_that_may_act_late_is_restored(node: Node, entry: Entry, verdict: Verdict) -> None:
    """A setting that may read as before until it is stored holds its default after restore and reset."""
    outcome = kept.late_restored(node, entry)

    kept.require_confirmed(outcome)
    kept.judge_default(verdict, entry, outcome)
