"""Who brings the device to a temperature or a supply voltage, as exactly as the bench says, and back."""

from __future__ import annotations

import re
import subprocess
import threading
from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoint
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from simulated_process import COMMAND, Process, simulating

from conformance.bench.definition import BenchDefinition, Exposed, load_bench
from conformance.bench.surroundings import entry_points
from conformance.bench.surroundings.exposing import Exposing, exposings_of
from conformance.bench.surroundings.operator import TerminalOperator
from conformance.errors import BenchError, SpecError

ROTA = Path(__file__).parents[1] / "checks" / "fourth_device.yaml"
EXPOSED = "DEV-05 or DEV-06 or DEV-41"
BENCH = """format: 1
what: The simulated device, exposed by a person.
interface: canopen_simulator
options: {{clock: virtual}}
stimulus: {{temperature: operator, supply: operator}}
tolerance_k: {tolerance_k}
tolerance_v: {tolerance_v}
operator: simulator
allow: [reads, writes, resets]
"""
LINE = """format: 1
what: A device behind an slcan adapter, and a person.
interface: slcan
channel: {link}
options: {{sleep_after_open: 0.01}}
stimulus: {{temperature: operator, supply: operator}}
operator: terminal
allow: [reads, writes, resets]
"""


def made(operator: Any = None, **changes: Any) -> Mapping[Exposed, Exposing]:
    definition = BenchDefinition.model_validate(
        {
            "format": 1,
            "what": "A bench.",
            "interface": "virtual",
            "operator": "terminal",
            "stimulus": {"temperature": "operator", "supply": "operator"},
            **changes,
        }
    )
    return exposings_of(definition, lambda: operator)


def test_a_person_is_asked_in_plain_words() -> None:
    asked = StringIO()
    person = TerminalOperator(Mock(), StringIO("\n" * 8), asked)
    by = made(person, tolerance_v=0.5)

    by["temperature"].set(-20.0)
    by["supply"].set(18.5)
    by["supply"].set(18.5)
    for _ in range(2):
        by["temperature"].rest()
        by["supply"].rest()

    assert asked.getvalue().split(", then press Enter: ") == [
        "Bring the sensor to -20 degC (within 1 K), and wait until all of it has that",
        "Set the supply of the sensor to 18.5 V (within 0.5 V)",
        "Bring the sensor to room temperature, and wait until all of it has that",
        "Set the supply of the sensor to what is usual",
        "",
    ]


class Machine:
    def __init__(self) -> None:
        MACHINES.append(self)
        self.did: list[float | str] = []

    def set_supply_voltage(self, volt: float) -> None:
        if volt > 60:
            raise RuntimeError("over-voltage protection")
        self.did.append(volt)

    def rest(self) -> None:
        self.did.append("rest")


MACHINES: list[Machine] = []


def test_a_machine_is_other_peoples_python(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = Mock(spec=EntryPoint, load=lambda: Machine)
    monkeypatch.setattr(entry_points, "entry_points", lambda **_: [entry])
    by = made(stimulus={"supply": {"entry_point": "lab"}})

    assert list(by) == ["supply"]
    by["supply"].rest()
    by["supply"].set(18.0)
    by["supply"].set(24.0)
    by["supply"].rest()
    assert MACHINES[-1].did == [18.0, 24.0, "rest"]

    with pytest.raises(BenchError) as failed:
        by["supply"].set(61.0)
    assert str(failed.value) == (
        "canopen_conformance.supply: 'lab' failed: over-voltage protection"
    )
    by["supply"].rest()
    assert MACHINES[-1].did[-1] == "rest", "after a failure nobody knows where it is"
    with pytest.raises(BenchError, match="'lab' makes what has no set_temperature"):
        made(stimulus={"temperature": {"entry_point": "lab"}})


def test_what_takes_its_time_is_waited_for() -> None:
    for stimulus, waits in (
        ({"temperature": "operator"}, True),
        ({"temperature": {"entry_point": "chamber"}}, True),
        ({"supply": {"entry_point": "lab"}}, False),
        ({"supply": "operator"}, True),
        ({"temperature": "simulator"}, False),
    ):
        definition = BenchDefinition.model_validate(
            {"format": 1, "what": "-", "interface": "virtual", "operator": "terminal"}
            | {"stimulus": stimulus}
        )
        assert definition.waits_long == waits, stimulus


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stimulus: {supply: 24}", "stimulus.supply: expected 'simulator' or 'operator', got 24"),
        ("stimulus: {temperature: operator}", "expected an operator for stimulus.temperature"),
        ("tolerance_k: -1", "tolerance_k: expected at least 0.0, got -1"),
        (
            "stimulus: {supply: {entry_point: lab, sudden: true}}",
            "expected sudden for stimulus.tilt alone, got it for supply",
        ),
    ],
)
def test_what_is_none_is_told_in_a_sentence(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bench.yaml"
    path.write_text(f"format: 1\nwhat: A bench.\ninterface: virtual\n{text}\n")
    with pytest.raises(SpecError) as wrong:
        load_bench(path)
    assert said in str(wrong.value)


@pytest.fixture
def judged(judge: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    def run(tolerance_k: float, tolerance_v: float, *arguments: str, device: str | Path) -> Any:
        path = tmp_path / "bench.yaml"
        path.write_text(BENCH.format(tolerance_k=tolerance_k, tolerance_v=tolerance_v))
        return judge("--bench", path, "--select", EXPOSED, *arguments, device=device)

    return run


@pytest.mark.parametrize("device", ["siko_ims360", "baumer_gim140r", ROTA])
def test_a_good_sensor_passes_where_it_is_done_with_care(
    judged: Callable[..., Any], device: str | Path
) -> None:
    done = judged(0.5, 0.2, device=device)
    assert done.code == 0, done.out
    assert done.requirements("pass")
    assert done.items("skipped") == []


@pytest.mark.parametrize("device", ["siko_ims360", "baumer_gim140r", ROTA])
def test_a_good_sensor_does_not_fail_where_it_is_not(
    judged: Callable[..., Any], device: str | Path
) -> None:
    done = judged(4.0, 3.0, device=device)
    assert done.items("fail") == []


def test_what_the_bench_cannot_tell_is_told(judged: Callable[..., Any]) -> None:
    done = judged(4.0, 3.0, device="siko_ims360")
    assert done.code == 2
    assert done.requirements("inconclusive") == {"DEV-05", "DEV-06"}
    assert "nearer to the limit than this bench can tell" in done.out


def test_what_is_grossly_wrong_fails_all_the_same(judged: Callable[..., Any]) -> None:
    done = judged(1.0, 0.5, "--fault", "frozen-values", device="siko_ims360")
    assert done.requirements("fail") == {"DEV-05", "DEV-06"}


def obey(person: subprocess.Popen[str], device: Process) -> list[str]:
    """Do what a run asks a person for, and return what that was."""
    assert person.stdin is not None
    assert person.stdout is not None
    asked, said = [], ""
    while character := person.stdout.read(1):
        said += character
        if not said.endswith("press Enter: "):
            continue
        question, said = said.splitlines()[-1], ""
        asked.append(question)
        if found := re.search(r"to (\S+) (degC|V) ", question):
            call = "set_temperature" if found[2] == "degC" else "set_supply_voltage"
            device.call(call, float(found[1]))
        else:
            device.call("at_rest")
        person.stdin.write("\n")
        person.stdin.flush()
    return asked


def test_a_person_at_a_terminal_does_what_is_asked(tmp_path: Path) -> None:
    link, bench = tmp_path / "tty", tmp_path / "bench.yaml"
    bench.write_text(LINE.format(link=link), encoding="utf-8")
    run = ["run", "siko_ims360", "--bench", str(bench), "--select", EXPOSED]
    with (
        simulating("siko_ims360", "--slcan-pty", str(link)) as device,
        subprocess.Popen(
            [*COMMAND, *run, "--report-dir", str(tmp_path / "record")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as person,
    ):
        limit = threading.Timer(120, person.kill)
        limit.start()
        asked = obey(person, device)
        limit.cancel()
        assert person.wait() == 0, asked
    assert any("degC (within 1 K)" in it for it in asked)
    assert any("V (within 0.2 V)" in it for it in asked)
    assert sum("room temperature" in it or "what is usual" in it for it in asked) == 2
