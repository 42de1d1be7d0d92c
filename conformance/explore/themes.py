"""Themes: a service at work and a few steps, so that a sequence tries them in many orders."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Final

from conformance.explore.choices import Choices
from conformance.explore.steps import Download, Nmt, Step, Sync, Upload, Wait
from conformance.wire.nmt import NmtCommand

FEW: Final = 6
"""Steps of a theme."""

OWN: Final = 3
"""Downloads among them to what the theme is about, before some are left out."""


@dataclass(frozen=True, slots=True)
class Theme:
    """What a sequence is about.

    Args:
        prelude: Steps that make a service do something.
        steps: The few steps that are then tried in many orders.
    """

    prelude: tuple[Step, ...]
    steps: tuple[Step, ...]


def theme_of(choices: Choices, chance: random.Random) -> Theme:
    """Return a theme chosen at random."""
    about = [it for it in (choices.heartbeat, choices.emcy, choices.first_tpdo) if it]
    own = chance.choice(about or [choices.downloads or choices.uploads])
    prelude = [chance.choice(own)]
    if own is choices.first_tpdo and choices.phrases:
        prelude = [*chance.choice(choices.phrases), Nmt(NmtCommand.START)]
    few = [chance.choice(own) for _ in range(OWN)]
    written = [Upload(it.key) for it in (*few, *prelude) if isinstance(it, Download)]
    others = [
        Wait(100),
        Sync(),
        chance.choice([*written, *choices.uploads]),
        *(chance.choice(it) for it in (choices.restarts, choices.tilts, written) if it),
    ]
    always = [Nmt(NmtCommand.START), Nmt(NmtCommand.STOP)]
    more = chance.sample([*few, *others], FEW - len(always))
    return Theme(tuple(prelude), (*always, *more))
