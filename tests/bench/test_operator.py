"""The operator: the simulated one tells patterns apart, the one at the terminal is understood."""

from __future__ import annotations

from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from unittest.mock import Mock

import pytest

from conformance.bench.definition import BenchDefinition, load_bench
from conformance.bench.services.lights import ELSE, LightsPort, Pattern
from conformance.bench.session import Bench
from conformance.bench.surroundings import operator
from conformance.bench.surroundings.operator import (
    OFF,
    ON,
    SimulatedOperator,
    TerminalOperator,
    operator_of,
)
from conformance.errors import SetupRefused
from conformance.resources import data
from conformance.spec.load import load_spec

CHOICES = {
    "flash": [200, 200],
    "once": [200, 1000],
    "twice": [200, 200, 200, 1000],
    "flicker": [50, 50],
}


class Clock:
    """A link whose time passes while it listens, and a rig with one light."""

    def __init__(self, times_ms: list[int]) -> None:
        self._times_ms = times_ms
        self._now_s = 0.123

    def now(self) -> float:
        return self._now_s

    def listen(self, duration_s: float, _match: object) -> None:
        self._now_s += duration_s

    def drain(self) -> None:
        pass

    def lit(self, light: str) -> bool:
        assert light == "red"
        left_ms = 1000 * self._now_s % sum(self._times_ms)
        for nth, time_ms in enumerate(self._times_ms):
            if left_ms < time_ms:
                return nth % 2 == 0
            left_ms -= time_ms
        return False


@pytest.mark.parametrize(
    ("times_ms", "words"),
    [
        ([200, 200], "flash"),
        ([230, 180], "flash"),
        ([200, 1000], "once"),
        ([200, 200, 200, 1000], "twice"),
        ([50, 50], "flicker"),
        ([10_000_000, 1], ON),
        ([1, 10_000_000], OFF),
        ([300, 300], None),
        ([200, 200, 200, 200, 200, 1000], None),
        ([1000, 200], None),
        ([600, 10_000_000], None),
    ],
)
def test_the_simulated_operator_tells_patterns_apart(
    times_ms: list[int], words: str | None
) -> None:
    clock = Clock(times_ms)
    assert SimulatedOperator(clock, clock).look_at("red", CHOICES) == words  # type: ignore[arg-type]  # a clock is all it uses


@pytest.mark.parametrize(
    ("typed", "words"),
    [("1\n", ON), ("2\n", OFF), (" 3 \n", "flash"), ("yes\n0\n8\n4\n", "once"), ("7\n", None)],
)
def test_a_person_answers_by_number(typed: str, words: str | None) -> None:
    asked = StringIO()

    answer = TerminalOperator(Mock(), StringIO(typed), asked).look_at("red", CHOICES)

    assert answer == words
    assert "Which of these does the red light show?\n  1  steadily on\n" in asked.getvalue()
    assert "  7  something else\n" in asked.getvalue()


@pytest.mark.parametrize(("typed", "same"), [("1\n", True), ("2\n", False), ("3\n2\n", False)])
def test_a_person_reads_the_label(typed: str, same: bool) -> None:
    asked = StringIO()

    assert TerminalOperator(Mock(), StringIO(typed), asked).is_on_label(26) == same

    assert (
        "Is 26 (1Ah) the serial number on the label of the device?\n  1  yes\n" in asked.getvalue()
    )


def test_the_simulated_operator_reads_the_simulated_label() -> None:
    person = SimulatedOperator(Mock(), Mock(label=lambda: "26"))
    assert [person.is_on_label(number) for number in (26, 27)] == [True, False]


def test_no_answer_blames_nobody() -> None:
    with pytest.raises(SetupRefused, match="did not answer"):
        TerminalOperator(Mock(), StringIO(""), StringIO()).look_at("red", CHOICES)


def test_a_late_answer_is_not_that_of_the_next_question(monkeypatch: pytest.MonkeyPatch) -> None:
    person = TerminalOperator(Mock(), StringIO("1\n2\n"), StringIO())
    with monkeypatch.context() as patch:
        patch.setattr(operator, "ANSWER_S", 0.0)
        with pytest.raises(SetupRefused):
            person.look_at("red", CHOICES)
    person._reader.join()
    assert person.look_at("red", CHOICES) == OFF


def test_only_a_simulated_device_is_seen_by_the_simulated_operator() -> None:
    definition = BenchDefinition(
        format=1, what="A bench.", interface="virtual", operator="simulator"
    )
    with pytest.raises(SetupRefused, match="simulated devices only"):
        operator_of(definition, Mock(rig=None))


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    path = data("device_specs") / "siko_ims360.yaml"
    spec = load_spec(path).resolve()
    definition = load_bench(data("fixtures/benches") / "simulator.yaml")
    bench = Bench.open(definition, spec, {"channel": str(path)}, tmp_path / "trace.log")
    bench.find_node()
    yield bench
    bench.close()


def test_a_pattern_is_seen_as_the_manual_names_it(bench: Bench) -> None:
    lights = LightsPort(bench.spec, bench.operator)
    assert lights.seen("green") == Pattern("flashing", (200, 200))
    assert lights.seen("red") == Pattern("off")
    assert [str(lights.seen("green")), str(lights.seen("red")), str(ELSE)] == [
        "flashing: 200 ms on, 200 ms off",
        "steadily off",
        "something else",
    ]


def test_a_node_comes_back_after_a_time_without_supply(bench: Bench) -> None:
    node = bench.node()
    with node.without_supply():
        assert not node.answers()
    assert node.answers()
