"""A node-ID or bit rate tried as a whole: written, stored, restarted, and found after each step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from conformance.bench.node.node import Node
from conformance.bench.node.reach import Astray, Place, Reach, is_any_boot_up
from conformance.bench.settings.settings import Settings
from conformance.errors import NodeTimeout, SetupRefused
from conformance.spec.document import Store
from conformance.spec.model import Key

Step: TypeAlias = Literal["write", "store", "reset", "power cycle"]


@dataclass(frozen=True, slots=True)
class Move:
    """What is tried.

    Args:
        keys: The objects written.
        data: The value.
        to: Where it leads.
        steps: What is done, in order.
        watched: Entries that are read before and after.
    """

    keys: tuple[Key, ...]
    data: bytes
    to: Place
    steps: tuple[Step, ...]
    watched: tuple[Key, ...] = ()


@dataclass(frozen=True, slots=True)
class Moved:
    """What came of it.

    Args:
        home: Where the node was.
        places: Where it was found after each step; None for nowhere.
        before: What the watched entries held.
        after: What they held at the end.
        boot_ups: Identifiers of boot-up messages seen after the last step.
        astray: Where the node answers once it was given its home back; None where it came home.
    """

    home: Place
    places: tuple[Place | None, ...]
    before: Mapping[Key, bytes]
    after: Mapping[Key, bytes]
    boot_ups: tuple[int, ...]
    astray: Place | None = None


def observe_move(reach: Reach, node: Node, move: Move) -> Moved:
    """Do the steps one after the other; node and bench are home again afterwards, if the node comes.

    Raises:
        SetupRefused: The node takes the value not at all, or the place is another node's.
    """
    reach.begin(node)
    with ExitStack() as way_back:
        way_back.callback(reach.bring_home, node)
        outcome = _follow(reach, node, move)
        way_back.pop_all()
    return replace(outcome, astray=_astray(reach, node))


def _follow(reach: Reach, node: Node, move: Move) -> Moved:
    _require_free(reach, node, move.to)
    before = {key: node.upload(*key) for key in move.watched}
    places: list[Place | None] = []
    mark = node.link.mark()
    for step in move.steps:
        mark = node.link.mark()
        places.append(_do(reach, node, move, step))
        if places[-1] is None:
            break
    boot_ups = tuple(f.frame.can_id for f in node.link.since(mark, is_any_boot_up))
    after = before if places[-1] is None else {key: node.upload(*key) for key in before}
    return Moved(reach.home, tuple(places), before, after, boot_ups)


def _astray(reach: Reach, node: Node) -> Place | None:
    """Bring the node home; return where it answers instead."""
    try:
        reach.bring_home(node)
    except Astray as error:
        return error.place
    return None


def _require_free(reach: Reach, node: Node, place: Place) -> None:
    """Make sure that the adapter can go there and that no other node is there."""
    if place == reach.home:
        return
    reach.go(place)
    taken = place.bitrate == reach.home.bitrate and node.answers()
    reach.go(reach.home)
    if taken:
        raise SetupRefused(f"there is another node already: {place}")


def _do(reach: Reach, node: Node, move: Move, step: Step) -> Place | None:
    places = (move.to, reach.home)
    match step:
        case "write":
            reach.write(node, move.keys, move.data, *places)
        case "store":
            node.save({index for index, _ in move.keys})
        case "reset":
            return reach.reset(node, *places)
        case "power cycle":
            return reach.power_cycle(node, *places)
    return reach.find(node, reach.here, *places)


@dataclass(frozen=True, slots=True)
class Restoring:
    """How a restore is tried that may bring back how the node is reached.

    Args:
        service: The restore service.
        sub: Its sub-index.
        defaults: Where it may lead, the likeliest first.
        save: By some reading the settings are stored before the restart.
    """

    service: Store
    sub: int
    defaults: tuple[Place, ...]
    save: bool


def observe_restored_place(reach: Reach, node: Node, move: Move, restoring: Restoring) -> Place:
    """Move the node, restore and restart it; return where it is then, before all is put back.

    Raises:
        SetupRefused: The node does not go there, or a place is another node's.
        NodeTimeout: It is found nowhere any more.
    """
    settings = Settings(node)
    try:
        settings.begin()
        reach.begin(node)
        try:
            for place in (move.to, *restoring.defaults):
                _require_free(reach, node, place)
            there = [_do(reach, node, move, step) for step in move.steps][-1]
            if there != move.to and there not in restoring.defaults:
                raise SetupRefused(f"the node does not go to {move.to}, see NID-01 and BIT-01")
            return _restored(reach, node, move, restoring)
        finally:
            reach.bring_home(node)
    finally:
        settings.put_back()


def _restored(reach: Reach, node: Node, move: Move, restoring: Restoring) -> Place:
    """Restore and restart; with a store before it where that may be needed and nothing happened."""
    places = *restoring.defaults, move.to, reach.home
    restart = reach.power_cycle if "power cycle" in move.steps else reach.reset
    found: Place | None = None
    for save in (False, True) if restoring.save else (False,):
        node.download(restoring.service.object, restoring.sub, restoring.service.word)
        if save:
            node.save({index for index, _ in move.keys})
        found = restart(node, *places) or reach.search(node, *places)
        if found != move.to:
            break
    if found is None:
        raise NodeTimeout("the node is found nowhere after a restore")
    return found


def observe_illegal(reach: Reach, node: Node, move: Move, values: Iterable[bytes]) -> list[bool]:
    """Write values that lead nowhere, store and restart; tell after each whether the node is home.

    Raises:
        NodeTimeout: It is found nowhere any more.
    """
    reach.begin(node)
    home: list[bool] = []
    try:
        for data in values:
            for key in move.keys:
                node.write(*key, data)
            found = [_restarted(reach, node, move, step) for step in move.steps]
            home.append(all(found))
            if not home[-1]:
                break
    finally:
        reach.bring_home(node)
    return home


def observe_refused(
    reach: Reach, node: Node, key: Key, values: Iterable[bytes]
) -> dict[bytes, tuple[bytes, bytes]]:
    """Write values that lead nowhere, and return what the object held before and after each."""
    reach.begin(node)
    seen: dict[bytes, tuple[bytes, bytes]] = {}
    try:
        for data in values:
            before = node.upload(*key)
            node.write(*key, data)
            seen[data] = before, node.upload(*key)
    finally:
        reach.bring_home(node)
    return seen


def _restarted(reach: Reach, node: Node, move: Move, step: Step) -> bool:
    if step == "store":
        try:
            node.save({index for index, _ in move.keys})
        except (SetupRefused, NodeTimeout):
            return reach.find(node, reach.home) is not None
        return True
    restart = reach.power_cycle if step == "power cycle" else reach.reset
    return restart(node, reach.home) == reach.home


def observe_aliases(
    reach: Reach, node: Node, keys: Sequence[Key], data: bytes
) -> dict[tuple[Key, Key], tuple[bytes, bytes]]:
    """Write each of some objects and return what the others held before and after."""
    reach.begin(node)
    seen: dict[tuple[Key, Key], tuple[bytes, bytes]] = {}
    try:
        for key in keys:
            before = {other: node.upload(*other) for other in keys if other != key}
            reach.write(node, (key,), data)
            seen |= {(key, it): (held, node.upload(*it)) for it, held in before.items()}
            node.reset()
    finally:
        reach.bring_home(node)
    return seen
