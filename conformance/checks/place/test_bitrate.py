"""Bit rate by object dictionary: when a new one takes effect and what it needs."""

from __future__ import annotations

from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.checks.place import moved, moving
from conformance.checks.place.moving import Change
from conformance.requirements import requirement
from conformance.spec.model import Entry
from conformance.verdict import Verdict

EFFECTS = moving.effects("bitrate")


@requirement("BIT-01", level="manual", cases=("change", moving.bit_rates), effects=EFFECTS)
def test_new_bit_rate_takes_effect(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A new bit rate is in force once all is done that the manual asks for."""
    moved.judge_move(bench, node, verdict, change, save=True, count=slice(-1, None))
    moved.judge_way_back(bench, node, verdict, change, save=True)


@requirement("BIT-02", level="manual", cases=("change", moving.bit_rates), effects=EFFECTS)
def test_new_bit_rate_waits_for_its_moment(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A new bit rate is not in force before all is done that the manual asks for."""
    moved.judge_move(bench, node, verdict, change, save=True, count=slice(None, -1))


@requirement("BIT-03", level="manual", cases=("change", moving.one_bit_rate), effects=EFFECTS)
def test_bit_rate_not_stored_is_lost(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A new bit rate that was not stored takes effect only where the manual asks for no store."""
    moved.judge_move(bench, node, verdict, change, save=False, count=slice(None))


@requirement("BIT-04", level="manual", cases=("change", moving.halves("bitrate")), effects=EFFECTS)
def test_one_of_a_pair_changes_no_bit_rate(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A bit rate written to one object of a pair alone does not take effect."""
    moved.judge_stays(bench, node, verdict, change, [change.value])


@requirement("BIT-05", level="manual", cases=("change", moving.one_bit_rate), effects=EFFECTS)
def test_no_bit_rate_outside_the_table(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A value that stands for no documented bit rate leaves the node where it is."""
    moved.judge_stays(bench, node, verdict, change, moving.useless(change, node.spec))


@requirement("BIT-06", level="manual", cases=("alias", moving.aliases("bitrate")), effects=EFFECTS)
def test_objects_show_the_same_bit_rate(
    bench: Bench, node: Node, alias: tuple[str, Change], verdict: Verdict
) -> None:
    """A bit rate written to one of its objects is read from the others."""
    name, change = alias

    moved.judge_aliases(bench, node, verdict, name, change)


@requirement("BIT-07", level="manual", cases=("change", moving.one_bit_rate), effects=EFFECTS)
def test_object_keeps_its_bit_rate(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A value that stands for no documented bit rate leaves the object as it was."""
    values = [*moving.useless(change, node.spec), *moving.disputed(change, node.spec)]

    moved.judge_object_stays(bench, node, verdict, change, values)


@requirement(
    "BIT-08",
    level="manual",
    cases=("change", moving.restored(moving.one_bit_rate)),
    effects=(*EFFECTS, "restores"),
)
def test_restored_bit_rate_is_the_default(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """After a restore the bit rate is the documented default, or, where the manual has it so, the one stored."""
    moved.judge_restored(bench, node, verdict, change)


@requirement(
    "BIT-09", level="manual", cases=("held", moving.held(moving.one_bit_rate)), effects=EFFECTS
)
def test_object_holds_the_bit_rate_in_force(
    bench: Bench, node: Node, held: tuple[Entry, Change], verdict: Verdict
) -> None:
    """Each object of the bit rate reads the one at which the node is after it was stored and put in force."""
    entry, change = held

    moved.judge_held(bench, node, verdict, entry, change)
