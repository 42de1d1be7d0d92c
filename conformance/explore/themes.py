"""Themes: objects that belong together, and the steps of a sequence that is about them.

A sequence writes its objects as a user would, time and again, each time with something left out, done twice
or put in between, and has a few other steps come in many orders between one time and the next.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import fields
from itertools import chain
from typing import Final

from conformance.explore.choices import Choices, Group
from conformance.explore.steps import Download, Nmt, PowerCycle, Step, Sync, Upload, Wait
from conformance.wire.nmt import NmtCommand

WIDE: Final = 0.15
"""Share of the sequences that are about nothing."""

KINDS: Final = 0.6
"""Share of the kinds of steps that such a sequence has."""

SHARES: Final = (0.0, 0.2, 0.6)
"""Of the steps of a series so many are left out, done twice, or followed by another: one of these each."""

ALONE: Final = 0.5
"""Share of the series that write objects without what comes before and after."""

SERIES: Final = 0.5
"""Share of the series that are one of those of the group, where it has some."""

WORKS: Final = 0.75
"""Share of the starts after which the service of the objects is made to do something."""

CUT: Final = 0.1
"""Share of the steps of a series that are its last."""

BACK: Final = 0.1
"""Share of the other steps that look at something written before."""

LOOKS: Final = 0.4
"""Share of what was written last that is looked at after the other steps, and of the waits after them."""

OTHERS: Final = 4
"""Other steps between one series and the next, at most."""

RECENT: Final = 3
"""Downloads that are looked at again."""


def course(choices: Choices, chance: random.Random) -> Iterator[Step]:
    """Return the steps of a sequence, without end."""
    recent: list[Download] = []
    steps = _wide(choices, chance, recent)
    if choices.groups and chance.random() >= WIDE:
        group = chance.choice(chance.choice(choices.groups))
        steps = _about(group, _few(group, choices, chance), chance, recent)
    for step in steps:
        if isinstance(step, Download):
            recent[:] = [*recent, step][-RECENT:]
        yield step


def _about(
    group: Group, few: list[Step], chance: random.Random, recent: list[Download]
) -> Iterator[Step]:
    """Return series, each in its own way, and other steps between them."""
    while True:
        if group.works and chance.random() < WORKS:
            yield from chance.choice(group.works)
            yield Nmt(NmtCommand.START)
        restarted = False
        while not restarted:
            shares = [chance.choice(SHARES) for _ in range(3)]
            others = (_other(few, chance, recent) for _ in range(chance.randint(1, OTHERS)))
            for step in chain(_changed(group, few, shares, chance), others, _looks(chance, recent)):
                yield step
                restarted = isinstance(step, PowerCycle | Nmt) and step.restarts
                if restarted:
                    break


def _other(few: list[Step], chance: random.Random, recent: list[Download]) -> Step:
    """Return a step that is not about the objects, or looks at one."""
    if recent and chance.random() < BACK:
        return Upload(chance.choice(recent).key)
    return chance.choice(few)


def _looks(chance: random.Random, recent: list[Download]) -> Iterator[Step]:
    """Return steps that show what has come of those before."""
    for key in {step.key: None for step in recent}:
        if chance.random() < LOOKS:
            yield Upload(key)
    if chance.random() < LOOKS:
        yield Wait(100)


def _changed(
    group: Group, few: list[Step], shares: list[float], chance: random.Random
) -> Iterator[Step]:
    """Return a series with something left out, done twice or put in between, up to where it is cut."""
    left_out, twice, between = shares
    for step in _series(group, chance):
        if chance.random() >= left_out:
            yield step
        if chance.random() < twice:
            yield step
        if chance.random() < between:
            yield chance.choice(chance.choice((few, group.around or few)))
        if chance.random() < CUT:
            return


def _series(group: Group, chance: random.Random) -> Iterator[Step]:
    """Return one way to write a group of objects."""
    alone = chance.random() < ALONE
    if group.before and not alone:
        yield chance.choice(group.before)
    if group.series and chance.random() < SERIES:
        yield from chance.choice(group.series)
    else:
        most = min(len(group.objects), 3)
        for downloads in chance.sample(group.objects, chance.randint(1, most)):
            yield chance.choice(downloads)
    if not alone:
        yield from (chance.choice(it) for it in (group.after,) if it)
        yield Nmt(NmtCommand.START)


def _few(group: Group, choices: Choices, chance: random.Random) -> list[Step]:
    """Return the other steps of a sequence: what matters to its objects, and some that may."""
    kinds = (choices.commands, choices.requests, choices.restarts, choices.tilts, choices.uploads)
    others = [Sync(), Wait(100), *(chance.choice(it) for it in kinds if it)]
    around = chance.sample(group.around, min(len(group.around), 2))
    some = chance.sample(others, chance.randint(0, 3))
    return [Nmt(NmtCommand.START), Nmt(NmtCommand.STOP), *around, *some]


def _wide(choices: Choices, chance: random.Random, recent: list[Download]) -> Iterator[Step]:
    """Return steps of some kinds, in any order."""
    kinds = [getattr(choices, it.name) for it in fields(choices) if it.name != "groups"]
    every = [kind for kind in kinds if kind]
    some = [kind for kind in every if chance.random() < KINDS] or every
    while True:
        yield _other(list(chance.choice(some)), chance, recent)
