"""Who tilts the device: a person or a machine, as exactly as the bench says, and never at a sensor's expense."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import EntryPoint
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from conformance.bench.definition import BenchDefinition, load_bench
from conformance.bench.surroundings import entry_points, tilting
from conformance.bench.surroundings.operator import TerminalOperator
from conformance.bench.surroundings.tilting import Tilting, tilting_of
from conformance.errors import BenchError, SpecError

BENCH = """format: 1
what: The simulated device, tilted by a person.
interface: canopen_simulator
options: {{clock: virtual}}
power: simulator
stimulus: {{tilt: operator}}
tolerance_deg: {tolerance_deg}
operator: simulator
allow: [reads, writes, resets]
"""
TILTED = "DEV-01 or DEV-02 or DEV-03 or DEV-07 or DEV-32 or DEV-38 or EMCY-03 or TPDO-19 or EMCY-08 or DEV-27"


def definition(**changes: Any) -> BenchDefinition:
    return BenchDefinition.model_validate(
        {
            "format": 1,
            "what": "A bench.",
            "interface": "virtual",
            "operator": "terminal",
            "stimulus": {"tilt": "operator"},
            **changes,
        }
    )


def made(bench: BenchDefinition, operator: Any = None) -> Tilting:
    found = tilting_of(bench, lambda: operator)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("x_deg", "y_deg", "words"),
    [
        (
            30.0,
            0.0,
            "Tilt the sensor to +30 deg about the X axis (within 0.5 deg), keep the other axis level",
        ),
        (
            0.0,
            -4.5,
            "Tilt the sensor to -4.5 deg about the Y axis (within 0.5 deg), keep the other axis level",
        ),
        (
            3.0,
            -3.0,
            "Tilt the sensor to +3 deg about the X axis and -3 deg about the Y axis (within 0.5 deg)",
        ),
        (0.0, 0.0, "Level the sensor (within 0.5 deg)"),
    ],
)
def test_a_person_is_asked_in_plain_words(x_deg: float, y_deg: float, words: str) -> None:
    asked = StringIO()
    person = TerminalOperator(Mock(), StringIO("\n\n"), asked)
    tilt = made(definition(tolerance_deg=0.5), person)

    tilt.set_tilt(x_deg, y_deg)

    assert asked.getvalue() == f"{words}, and leave it at rest, then press Enter: "
    tilt.set_tilt(x_deg, y_deg)
    assert asked.getvalue().count("Enter") == 1, "nobody is asked for what is there already"
    tilt.forget()
    tilt.set_tilt(x_deg, y_deg)
    assert asked.getvalue().count("Enter") == 2


class Machine:
    def __init__(self) -> None:
        MACHINES.append(self)
        self.places: list[tuple[float, float]] = []

    def set_tilt(self, x_deg: float, y_deg: float) -> None:
        if x_deg > 90:
            raise RuntimeError("end switch")
        self.places.append((x_deg, y_deg))


MACHINES: list[Machine] = []


def test_a_machine_is_other_peoples_python(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = Mock(spec=EntryPoint, load=lambda: Machine)
    monkeypatch.setattr(entry_points, "entry_points", lambda **_: [entry])
    tilt = made(definition(stimulus={"tilt": {"entry_point": "hexapod"}}, tolerance_deg=0.1))

    tilt.set_tilt(3, 4)
    tilt.level()

    assert MACHINES[-1].places == [(3, 4), (0, 0)]
    with pytest.raises(BenchError) as failed:
        tilt.set_tilt(91, 0)
    assert str(failed.value) == f"{tilting.GROUP}: 'hexapod' failed: end switch"


def test_a_machine_tilts_at_once_where_the_bench_says_so() -> None:
    for by, sudden in (
        ("simulator", True),
        ("operator", False),
        ({"entry_point": "hexapod"}, False),
        ({"entry_point": "hexapod", "sudden": True}, True),
    ):
        bench = definition(stimulus={"tilt": by})
        assert (bench.has("tilt"), bench.has("sudden-tilt")) == (True, sudden)
    assert not definition(stimulus={}).has("sudden-tilt")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stimulus: {tilt: hand}", "stimulus.tilt: expected 'simulator' or 'operator', got 'hand'"),
        ("stimulus: {tilt: operator}\noperator: none", "expected an operator for stimulus.tilt"),
        ("tolerance_deg: -1", "tolerance_deg: expected at least 0.0, got -1"),
        ("stimulus: {tilt: {sudden: true}}", "stimulus.tilt.entry_point: expected this key"),
    ],
)
def test_a_tilt_that_is_none_is_told_in_a_sentence(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bench.yaml"
    operator = "" if "operator:" in text else "operator: terminal\n"
    path.write_text(f"format: 1\nwhat: A bench.\ninterface: virtual\n{operator}{text}\n")
    with pytest.raises(SpecError) as wrong:
        load_bench(path)
    assert said in str(wrong.value)


@pytest.fixture
def judged(judge: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    def run(tolerance_deg: float, *arguments: str, device: str = "danfoss_dst_x730") -> Any:
        path = tmp_path / "bench.yaml"
        path.write_text(BENCH.format(tolerance_deg=tolerance_deg))
        return judge("--bench", path, "--select", TILTED, *arguments, device=device)

    return run


@pytest.mark.parametrize("device", ["siko_ims360", "baumer_gim140r", "danfoss_dst_x730"])
def test_a_good_sensor_does_not_fail_by_an_unsteady_hand(
    judged: Callable[..., Any], device: str
) -> None:
    done = judged(2.0, device=device)
    assert done.code == 2
    assert done.items("fail") == []
    assert "nearer to the limit than this bench can tell" in done.out


def test_a_good_sensor_passes_in_a_careful_hand(judged: Callable[..., Any]) -> None:
    done = judged(0.1, "--variant", "xy-10")
    assert done.code == 0, done.out
    assert done.requirements("pass") >= {
        "DEV-01",
        "DEV-02",
        "DEV-03",
        "DEV-32",
        "DEV-38",
        "EMCY-03",
    }
    assert done.requirements("skipped") == {"DEV-27", "EMCY-08"}
    assert "skipped: the bench cannot tilt at once" in done.out


def test_what_is_grossly_wrong_fails_in_any_hand(judged: Callable[..., Any]) -> None:
    done = judged(2.0, "--variant", "xy-10", "--fault", "frozen-values")
    assert done.code == 1
    assert "DEV-01" in done.requirements("fail")
