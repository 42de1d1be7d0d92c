"""The search: random sequences of steps until one shows a difference.

Needs hypothesis.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Final

from hypothesis import HealthCheck, Phase, Verbosity, seed, settings
from hypothesis import strategies as st
from hypothesis.errors import Flaky
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)

from conformance.errors import BenchError
from conformance.explore.choices import Choices
from conformance.explore.laboratory import Laboratory
from conformance.explore.pair import Difference, Pair
from conformance.explore.shortest import Finding
from conformance.explore.steps import Step
from conformance.explore.themes import theme_of

LONGEST: Final = 40
"""Steps of one sequence at most."""

OFTEN: Final = ("commands", "waits", "phrases")
"""Kinds of steps that are chosen as often as two others."""


class _DifferenceFound(Exception):  # noqa: N818 - how a difference ends a sequence
    """The device and the model differ."""


@dataclass(slots=True)
class Searched:
    """How far a search has come.

    Attributes:
        steps: Taken until a difference was found, or all of them.
        sequences: As many were begun.
        finding: A sequence that shows a difference.
    """

    steps: int = 0
    sequences: int = 0
    finding: Finding | None = None


def search(
    laboratory: Laboratory,
    choices: Choices,
    readings: Mapping[str, int],
    budget: int,
    number: int,
) -> Searched:
    """Take a device and its model through random steps.

    Args:
        laboratory: Where they are.
        choices: What steps there are.
        readings: What the model follows, where not as judged.
        budget: How many steps to take, about.
        number: Seed of the choice.
    """
    here = _Here(laboratory, choices, readings)
    length = min(LONGEST, budget)
    try:
        run_state_machine_as_test(
            seed(number)(_machine(here)),
            settings=settings(
                max_examples=math.ceil(budget / length),
                stateful_step_count=length,
                database=None,
                deadline=None,
                phases=(Phase.generate,),
                report_multiple_bugs=False,
                suppress_health_check=list(HealthCheck),
                verbosity=Verbosity.quiet,
            ),
        )
    except _DifferenceFound:
        pass
    except Flaky as error:
        if here.searched.finding is None:
            raise BenchError(f"the bench failed once: {error}") from error
    return here.searched


@dataclass(frozen=True, slots=True)
class _Here:
    """What all sequences of a search share."""

    laboratory: Laboratory
    choices: Choices
    readings: Mapping[str, int]
    searched: Searched = field(default_factory=Searched)


class _Sequence(RuleBasedStateMachine):
    """One sequence: a device and its model from their start on."""

    here: ClassVar[_Here]

    def __init__(self) -> None:
        super().__init__()
        self._stack = ExitStack()
        pair = self.here.laboratory.pair(self.here.readings)
        self._pair: Pair = self._stack.enter_context(pair)
        self._steps: list[Step] = []
        self._few: tuple[Step, ...] = ()
        self._chance = random.Random()  # noqa: S311 - seeded by the search
        self._found = False
        self.wide = True
        self._counts = self.here.searched.finding is None
        self.here.searched.sequences += self._counts

    @initialize(wide=st.sampled_from((False, False, True)), number=st.integers(0, 0xFFFF_FFFF))
    def choose(self, wide: bool, number: int) -> None:
        """Choose a theme and begin with it; a sequence that is not wide has no other steps."""
        self._chance.seed(number)
        theme = theme_of(self.here.choices, self._chance)
        self.wide, self._few = wide, theme.steps
        for step in theme.prelude:
            self.take(step)

    @rule()
    def come_back(self) -> None:
        """Take a step of the theme."""
        self.take(self._chance.choice(self._few))

    def take(self, step: Step) -> None:
        """Take a step, unless both have parted."""
        if not self._pair.parted:
            self._steps.append(step)
            self.here.searched.steps += self._counts
            self._judge(self._pair.take(step))

    def teardown(self) -> None:
        """End the sequence; what is still to come counts."""
        with self._stack:
            if not self._found and not self._pair.parted:
                self._judge(self._pair.end())

    def _judge(self, difference: Difference | None) -> None:
        if difference is not None:
            self._found = True
            self.here.searched.finding = Finding(tuple(self._steps), difference)
            raise _DifferenceFound


def _machine(here: _Here) -> type[RuleBasedStateMachine]:
    """Return the state machine whose rules are the kinds of steps."""
    kinds = {it.name: getattr(here.choices, it.name) for it in fields(here.choices)}
    kinds |= {f"again_{name}": kinds[name] for name in OFTEN}
    rules = {name: _rule(name, steps) for name, steps in kinds.items() if steps}
    return type("Exploration", (_Sequence,), {"here": here, **rules})


def _rule(name: str, steps: tuple[Step | tuple[Step, ...], ...]) -> Callable[..., None]:
    def take(self: Any, step: Step | tuple[Step, ...]) -> None:
        for each in step if isinstance(step, tuple) else (step,):
            self.take(each)

    take.__name__ = name
    made: Callable[..., None] = precondition(lambda self: self.wide)(
        rule(step=st.sampled_from(steps))(take)
    )
    return made
