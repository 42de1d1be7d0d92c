"""Node-ID by object dictionary: when a new one takes effect, what it needs and what follows it.

CiA 301 v4.2.0, 7.2.8.3.3 (boot-up), 7.3.3 (predefined connection set).
"""

from __future__ import annotations

from collections.abc import Iterable

from conformance.bench.node.node import Node
from conformance.bench.session import Bench
from conformance.bench.settings.moves import Move, observe_move
from conformance.bench.settings.settings import Settings
from conformance.checks.place import moved, moving
from conformance.checks.place.moving import Change
from conformance.errors import SetupRefused
from conformance.requirements import CIA301, Case, requirement
from conformance.spec.model import DeviceSpec, Entry
from conformance.verdict import Verdict
from conformance.wire import cob_id

EFFECTS = moving.effects("node_id")
OWN = 3
"""How far a COB-ID of its own is from its default."""


def _of_followers(spec: DeviceSpec) -> Iterable[Case]:
    for case in moving.node_ids(spec):
        for entry in moving.followers(spec):
            yield Case(
                entry.address, (entry, case.subject), entry.source_of("default"), case.effects
            )


def _of_own_values(spec: DeviceSpec) -> Iterable[Case]:
    for case in moving.node_ids(spec):
        for entry in moving.own_values(spec):
            section = entry.source_of("after_node_id_change")
            yield Case(entry.address, (entry, case.subject), section, case.effects)


@requirement("NID-01", level="manual", cases=("change", moving.node_ids), effects=EFFECTS)
def test_new_node_id_takes_effect(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A new node-ID is in force once all is done that the manual asks for."""
    moved.judge_move(bench, node, verdict, change, save=True, count=slice(-1, None))
    moved.judge_way_back(bench, node, verdict, change, save=True)


@requirement("NID-02", level="manual", cases=("change", moving.node_ids), effects=EFFECTS)
def test_new_node_id_waits_for_its_moment(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A new node-ID is not in force before all is done that the manual asks for."""
    moved.judge_move(bench, node, verdict, change, save=True, count=slice(None, -1))


@requirement("NID-03", level="manual", cases=("change", moving.node_ids), effects=EFFECTS)
def test_node_id_not_stored_is_lost(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A new node-ID that was not stored takes effect only where the manual asks for no store."""
    moved.judge_move(bench, node, verdict, change, save=False, count=slice(None))


@requirement("NID-04", level="manual", cases=("change", moving.halves("node_id")), effects=EFFECTS)
def test_one_of_a_pair_changes_no_node_id(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A node-ID written to one object of a pair alone does not take effect."""
    moved.judge_stays(bench, node, verdict, change, [change.value])


@requirement("NID-05", level="manual", cases=("change", moving.node_ids), effects=EFFECTS)
def test_no_node_id_outside_the_range(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A value outside the documented node-IDs leaves the node where it is."""
    moved.judge_stays(bench, node, verdict, change, moving.useless(change, node.spec))


@requirement("NID-06", level="manual", cases=("alias", moving.aliases("node_id")), effects=EFFECTS)
def test_objects_show_the_same_node_id(
    bench: Bench, node: Node, alias: tuple[str, Change], verdict: Verdict
) -> None:
    """A node-ID written to one of its objects is read from the others."""
    name, change = alias

    moved.judge_aliases(bench, node, verdict, name, change)


@requirement("NID-07", level="manual", cases=("follower", _of_followers), effects=EFFECTS)
def test_cob_id_follows_the_node_id(
    bench: Bench, node: Node, follower: tuple[Entry, Change], verdict: Verdict
) -> None:
    """A COB-ID with the node-ID in its default has the default of the new node-ID."""
    entry, change = follower

    outcome = moved.moved(bench, node, verdict, change, save=True)

    moved.judge_follower(verdict, entry, outcome)


@requirement("NID-08", level="manual", cases=("follower", _of_own_values), effects=EFFECTS)
def test_own_cob_id_follows_as_documented(
    bench: Bench, node: Node, follower: tuple[Entry, Change], verdict: Verdict
) -> None:
    """A stored COB-ID of its own becomes what the manual says with a new node-ID."""
    entry, change = follower
    settings = Settings(node)
    steps = moving.steps(node.spec, "node_id", save=True)
    to = change.place(bench.reach.home)
    value = node.spec.entries[change.keys[0]].type.encode(change.value)

    try:
        settings.begin()
        own = node.number(*entry.key) + OWN
        settings.write({entry.key: entry.type.encode(own)})
        settings.save()
        move = Move(change.keys, value, to, steps, (entry.key,))
        outcome = observe_move(bench.reach, node, move)
    finally:
        settings.put_back()

    if outcome.before[entry.key] != entry.type.encode(own):
        raise SetupRefused(f"{entry.address} does not keep {own:08X}h, see STO-01")
    moved.judge_follower(verdict, entry, outcome)


@requirement(
    "NID-09",
    level="shall",
    cases=("change", moving.node_ids),
    source=f"{CIA301}, 7.2.8.3.3",
    effects=EFFECTS,
)
def test_boot_up_has_the_new_node_id(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """The boot-up message has the identifier of the node-ID at which the node answers."""
    outcome = moved.moved(bench, node, verdict, change, save=True)

    here = outcome.places[-1]

    if here is None or not outcome.boot_ups:
        raise SetupRefused("the node is not found, or sends no boot-up message, see NMT-03")
    expected = (cob_id.heartbeat(here.node_id),)
    verdict.equal("identifiers of boot-up messages", outcome.boot_ups, expected, show=_list)


@requirement("NID-10", level="manual", cases=("change", moving.node_ids), effects=EFFECTS)
def test_object_keeps_its_node_id(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """A value outside the documented node-IDs leaves the object as it was."""
    moved.judge_object_stays(bench, node, verdict, change, moving.useless(change, node.spec))


@requirement(
    "NID-11",
    level="manual",
    cases=("change", moving.restored(moving.node_ids)),
    effects=(*EFFECTS, "restores"),
)
def test_restored_node_id_is_the_default(
    bench: Bench, node: Node, change: Change, verdict: Verdict
) -> None:
    """After a restore the node-ID is the documented default, or, where the manual has it so, the one stored."""
    moved.judge_restored(bench, node, verdict, change)


@requirement(
    "NID-12", level="manual", cases=("held", moving.held(moving.node_ids)), effects=EFFECTS
)
def test_object_holds_the_node_id_in_force(
    bench: Bench, node: Node, held: tuple[Entry, Change], verdict: Verdict
) -> None:
    """Each object of the node-ID reads the one at which the node is after it was stored and put in force."""
    entry, change = held

    moved.judge_held(bench, node, verdict, entry, change)


def _list(can_ids: tuple[int, ...]) -> str:
    return ", ".join(f"{can_id:03X}h" for can_id in can_ids)
