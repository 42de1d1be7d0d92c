"""What came of a new node-ID or bit rate, and what is judged by it."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from conformance.bench.node.node import Node
from conformance.bench.node.reach import AT_ONCE_S, Astray, Place
from conformance.bench.node.sdo import Transfer
from conformance.bench.session import Bench
from conformance.bench.settings.moves import (
    Move,
    Moved,
    Restoring,
    observe_aliases,
    observe_illegal,
    observe_move,
    observe_refused,
    observe_restored_place,
)
from conformance.checks.place.moving import (
    Change,
    allowed,
    followed,
    followers,
    place_at_once,
    restored_places,
    restoring_sub,
    steps,
)
from conformance.errors import SetupRefused
from conformance.spec.bit_rates import documented_rates
from conformance.spec.model import Entry, OtherBehaviours, address, is_legal
from conformance.verdict import Verdict
from conformance.wire.errors import WireError


def moved(
    bench: Bench,
    node: Node,
    verdict: Verdict,
    change: Change,
    *,
    save: bool,
) -> Moved:
    """Return what came of a new node-ID or bit rate, tried once in a run."""
    made = steps(node.spec, change.setting, save=save)
    data = node.spec.entries[change.keys[0]].type.encode(change.value)
    watched = (*(entry.key for entry in followers(node.spec)), *change.keys)
    move = Move(change.keys, data, change.place(bench.reach.home), made, watched)
    observe = partial(observe_move, bench.reach, node, move)
    name = f"{change.setting} {change.figure}, saved {save}"
    seen = bench.observations.once(name, Moved, observe)
    verdict.shown_in(seen.first, seen.last, seen.late_ms)
    return seen.outcome


def tried(bench: Bench, node: Node, entry: Entry, value: int) -> Transfer:
    """Download a node-ID or bit rate and bring the node back from where it may have gone.

    Returns:
        What the node made of the download.
    """
    to = place_at_once(node.spec, entry, value, bench.reach.home)
    if to is None:
        transfer = node.try_download(*entry.key, entry.type.encode(value))
        if transfer.answered:
            node.restore()
        return transfer
    bench.reach.begin(node)
    try:
        transfer = node.write(*entry.key, entry.type.encode(value))
        node.link.listen(AT_ONCE_S, lambda _: False)
        bench.reach.find(node, to, bench.reach.home)
    finally:
        bench.reach.bring_home(node)
    return transfer


def judge_move(
    bench: Bench, node: Node, verdict: Verdict, change: Change, *, save: bool, count: slice
) -> None:
    """Judge where a new node-ID or bit rate leads after some of the steps, by any reading."""
    outcome = moved(bench, node, verdict, change, save=save)

    made = steps(node.spec, change.setting, save=save)
    expected = allowed(node.spec, change, made, outcome.home)
    actual, wanted = outcome.places, list(dict.fromkeys(places[count] for places in expected))

    verdict.holds(
        f"place after {', '.join(made[count])}",
        expected=" or ".join(_list(places) for places in wanted),
        actual=_list(actual[count]),
        ok=actual[count] in wanted,
    )
    other = next((it for places, it in expected.items() if places == actual), None)
    if other is not None:
        verdict.follows(other.ambiguity, other.reading)


def judge_way_back(
    bench: Bench, node: Node, verdict: Verdict, change: Change, *, save: bool
) -> None:
    """Judge that the node came home when its objects were given their values back.

    Raises:
        Astray: It did not, and by some reading need not take these values.
    """
    outcome = moved(bench, node, verdict, change, save=save)
    home, entry = outcome.home, node.spec.entries[change.keys[0]]
    rate = documented_rates(node.spec).get(home.bitrate)
    value = home.node_id if change.setting == "node_id" else rate
    if outcome.astray is not None and (value is None or not entry.always_legal(value)):
        raise Astray(home, outcome.astray)

    verdict.equal("place after the way back", str(outcome.astray or home), str(home))


def judge_held(bench: Bench, node: Node, verdict: Verdict, entry: Entry, change: Change) -> None:
    """Judge that an object holds the node-ID or bit rate at which the node is, if it moved as it must.

    Raises:
        SetupRefused: The node is where no reading of the manual has it.
    """
    outcome = moved(bench, node, verdict, change, save=True)
    made = steps(node.spec, change.setting, save=True)

    here = outcome.places[-1]
    if here not in {places[-1] for places in allowed(node.spec, change, made, outcome.home)}:
        raise SetupRefused("the node is not where it must be, see NID-01 and BIT-01")
    away = here == change.place(outcome.home)
    before, after = (_number(entry, it[entry.key]) for it in (outcome.before, outcome.after))
    verdict.equal(f"value of {entry.address}", after, change.value if away else before)


def judge_restored(bench: Bench, node: Node, verdict: Verdict, change: Change) -> None:
    """Judge where a node is that was moved and restored: at its default, or where it was moved to.

    Raises:
        SetupRefused: There is no restore.
    """
    spec, home = node.spec, bench.reach.home
    restore, sub = spec.services.restore, restoring_sub(spec, change)
    if restore is None or sub is None:
        raise SetupRefused("the manual documents no restore")
    data = spec.entries[change.keys[0]].type.encode(change.value)
    made = steps(spec, change.setting, save=True)
    every = [services.restore for services, _ in spec.services_readings]
    save = any(it is not None and it.effective != "after-reset" for it in every)
    places = restored_places(spec, change, sub, home)
    ends = {seen[-1]: other for seen, other in allowed(spec, change, made, home).items()}
    if home in ends:  # by a reading it has not moved
        places.setdefault(home, ends[home])

    move = Move(change.keys, data, change.place(home), made)
    restoring = Restoring(restore, sub, tuple(places), save)
    found = observe_restored_place(bench.reach, node, move, restoring)

    verdict.one_of("place after a restore", str(found), [str(it) for it in places])
    other = places.get(found)
    if other is not None:
        verdict.follows(other.ambiguity, other.reading)


def judge_follower(verdict: Verdict, entry: Entry, outcome: Moved) -> None:
    """Judge what an entry with the node-ID in it holds after the node-ID changed."""
    here = outcome.places[-1] or outcome.home
    before, after = (_number(entry, it[entry.key]) for it in (outcome.before, outcome.after))
    expected = followed(entry, before, here.node_id - outcome.home.node_id)
    verdict.one_of(
        f"value of {entry.address} as {here}",
        after,
        list(expected),
        show=lambda word: f"{word:08X}h",
    )
    other = expected.get(after)
    if other is not None:
        verdict.follows(other.ambiguity, other.reading)


def judge_stays(
    bench: Bench, node: Node, verdict: Verdict, change: Change, values: list[int]
) -> None:
    """Judge that values written to the objects, stored and followed by restarts change nothing."""
    made = steps(node.spec, change.setting, save=True)[1:]
    data = [node.spec.entries[change.keys[0]].type.encode(value) for value in values]
    move = Move(change.keys, data[0], bench.reach.home, made)

    stayed = observe_illegal(bench.reach, node, move, data)

    for value, stays in zip(values, stayed, strict=False):
        verdict.holds(
            f"place after {value} was written",
            expected=str(bench.reach.home),
            actual=str(bench.reach.home) if stays else "another",
            ok=stays,
        )


def judge_object_stays(
    bench: Bench, node: Node, verdict: Verdict, change: Change, values: list[int]
) -> None:
    """Judge that an object holds what it held after values were written that it must not take.

    What only some readings allow may be taken as well.
    """
    entry = node.spec.entries[change.keys[0]]

    seen = observe_refused(bench.reach, node, entry.key, map(entry.type.encode, values))

    for data, outcome in seen.items():
        value, before, after = (_number(entry, it) for it in (data, *outcome))
        legal = is_legal(value, entry.legal)
        expected = [before, value] if legal else [before]
        verdict.one_of(f"{entry.address} after {value} was written", after, expected)
        for other in entry.alternatives if legal and after == before else ():
            if not is_legal(value, other.entry.legal):
                verdict.follows(other.ambiguity, other.reading)


def judge_aliases(bench: Bench, node: Node, verdict: Verdict, name: str, change: Change) -> None:
    """Judge that all objects show one value, or, where a reading has it so, each its own."""
    spec = node.spec
    data = spec.entries[change.keys[0]].type.encode(change.value)
    seen = observe_aliases(bench.reach, node, change.keys, data)

    permitted: dict[bool, OtherBehaviours | None] = {}
    for rule, other in spec.behaviour_readings(name):
        permitted.setdefault(rule is not None, other)
    same = {
        pair: int.from_bytes(after, "little") == change.value for pair, (_, after) in seen.items()
    }
    words = ", ".join(
        f"{address(*other)} {'shows' if same[key, other] else 'does not show'} what is written to "
        f"{address(*key)}"
        for key, other in seen
    )
    ok = len(set(same.values())) == 1 and next(iter(same.values())) in permitted
    verdict.holds("objects", expected="one value at all of them", actual=words, ok=ok)
    if ok and (reading := permitted[next(iter(same.values()))]) is not None:
        verdict.follows(reading.ambiguity, reading.reading)


def _number(entry: Entry, data: bytes) -> int:
    try:
        return int(entry.type.decode(data))
    except WireError as error:
        raise SetupRefused(f"{entry.address}: {error}, see OD-03") from error


def _list(places: Iterable[Place | None]) -> str:
    return ", then ".join("nowhere" if place is None else str(place) for place in places)
