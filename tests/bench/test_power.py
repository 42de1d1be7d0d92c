"""Who switches the supply: a person, a command line, an SCPI supply, other people's Python; or nobody."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint
from io import StringIO
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
import pyvisa

from conformance.bench.definition import BenchDefinition, load_bench
from conformance.bench.session import Bench
from conformance.bench.surroundings import entry_points, operator, power
from conformance.bench.surroundings.operator import TerminalOperator
from conformance.bench.surroundings.power import Supply, supply_of
from conformance.errors import BenchError, SetupRefused, SpecError
from conformance.resources import data
from conformance.spec.load import load_spec

SIMULATED_SUPPLY = """
spec: "1.1"
devices:
  supply:
    eom:
      TCPIP INSTR: {q: "\\n", r: "\\n"}
    error: ERROR
    channels: {}
    dialogues:
      - {q: "OUTP?", r: "1"}
      - {q: "OUTP OFF"}
      - {q: "OUTP ON"}
resources:
  TCPIP::192.168.0.7::INSTR:
    device: supply
"""
BENCH = """format: 1
what: The simulated device, whose supply is switched by others.
interface: canopen_simulator
options: {clock: virtual}
allow: [reads, writes, resets, power]
"""


def definition(**changes: Any) -> BenchDefinition:
    return BenchDefinition.model_validate(
        {
            "format": 1,
            "what": "A bench.",
            "interface": "virtual",
            "operator": "terminal",
            "allow": ["reads", "power"],
            **changes,
        }
    )


def supply(link: Mock | None = None, **changes: Any) -> Supply:
    made = supply_of(definition(**changes), link or Mock(), Mock())
    assert made is not None
    return made


# A command line


def command(tmp_path: Path, **more: Any) -> dict[str, Any]:
    script = tmp_path / "relay board.py"
    script.write_text(
        "import pathlib, sys, time\n"
        "with pathlib.Path(sys.argv[1]).open('a') as file: file.write(sys.argv[2])\n"
        "if sys.argv[2] == 'slow': time.sleep(60)\n"
        "sys.exit(3 if sys.argv[2] == 'broken' else 0)\n"
    )
    line = f"'{sys.executable}' '{script}' '{tmp_path / 'said'}'"
    given = {"off": f"{line} '0 ;&'", "on": f"{line} 1", **more}
    for name in ("off", "on"):
        given[name] = given[name].replace("LINE", line)
    return {"command": given, "off_s": 0.5}


def test_a_command_line_switches_without_a_shell(tmp_path: Path) -> None:
    link = Mock()
    switch = supply(link, power=command(tmp_path))

    switch.off()
    assert (tmp_path / "said").read_text() == "0 ;&"
    assert link.listen.call_args.args[0] == 0.5, "the supply stays off for a while"
    assert link.drain.called, "the bus is heard meanwhile"
    switch.on()
    assert (tmp_path / "said").read_text() == "0 ;&1"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("LINE broken", 'broken" ended with exit code 3'),
        ("LINE slow", 'slow" did not end within 0.2 s'),
        ("no-such-relay 1 off", "cannot run 'no-such-relay 1 off'"),
        ("relay 'unfinished", 'cannot run "relay \'unfinished": No closing quotation'),
    ],
)
def test_a_command_line_that_fails_is_the_bench_that_failed(
    tmp_path: Path, line: str, said: str
) -> None:
    timeout_s = 0.2 if "slow" in line else 10.0
    switch = supply(power=command(tmp_path, off=line, timeout_s=timeout_s))

    with pytest.raises(BenchError) as failed:
        switch.off()

    assert said in str(failed.value)
    assert str(failed.value).startswith("power: ")


# A supply that takes SCPI


@pytest.fixture
def visa(tmp_path: Path) -> str:
    path = tmp_path / "visa.yaml"
    path.write_text(SIMULATED_SUPPLY)
    return f"{path}@sim"


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    found: list[str] = []
    write = pyvisa.resources.MessageBasedResource.write

    def note(self: Any, message: str, *arguments: Any) -> int:
        found.append(message)
        return write(self, message, *arguments)

    monkeypatch.setattr(pyvisa.resources.MessageBasedResource, "write", note)
    return found


def test_an_scpi_supply_switches(visa: str, written: list[str]) -> None:
    scpi = {"resource": "TCPIP::192.168.0.7::INSTR", "backend": visa}
    switch = supply(power={"scpi": scpi, "off_s": 0.0})
    assert written == [], "nothing is switched before a check asks for it"

    switch.off()
    switch.on()

    assert written == ["OUTP OFF", "OUTP ON"]


@pytest.mark.parametrize(
    "changes", [{"resource": "TCPIP::192.168.0.8::INSTR"}, {"backend": "nothing.yaml@sim"}]
)
def test_an_scpi_supply_that_is_not_there_is_told_before_anything_is_sent(
    visa: str, changes: dict[str, str]
) -> None:
    scpi = {"resource": "TCPIP::192.168.0.7::INSTR", "backend": visa, **changes}
    with pytest.raises(BenchError, match=r"power: TCPIP::192\.168\.0\.\d::INSTR \("):
        supply(power={"scpi": scpi})


def test_without_pyvisa_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyvisa", None)
    with pytest.raises(BenchError, match=r"pip install 'canopen-conformance\[scpi\]'"):
        supply(power={"scpi": {"resource": "x"}})


# Other people's Python


class Relay:
    calls: list[str]

    def __init__(self) -> None:
        Relay.calls = []

    def off(self) -> None:
        self.calls.append("off")

    def on(self) -> None:
        raise RuntimeError("relay board unplugged\nand more")


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    def found(*, group: str, name: str = "") -> list[EntryPoint]:
        known = [
            EntryPoint("relay", f"{__name__}:Relay", power.GROUP),
            EntryPoint("hollow", "builtins:object", power.GROUP),
            EntryPoint("gone", "no_such_module:Relay", power.GROUP),
        ]
        return [it for it in known if it.group == group and name in ("", it.name)]

    monkeypatch.setitem(sys.modules, __name__, sys.modules.get(__name__, Mock(Relay=Relay)))
    monkeypatch.setattr(entry_points, "entry_points", found)


@pytest.mark.usefixtures("installed")
def test_an_entry_point_switches() -> None:
    switch = supply(power={"entry_point": "relay", "off_s": 0.0})
    switch.off()
    assert Relay.calls == ["off"]
    with pytest.raises(BenchError) as failed:
        switch.on()
    assert str(failed.value) == f"{power.GROUP}: 'relay' failed: relay board unplugged"


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("plug", "no entry point 'plug' is installed (there are: gone, hollow, relay)"),
        ("hollow", "'hollow' makes what has no off and no on"),
        ("gone", "'gone' failed: No module named 'no_such_module'"),
    ],
)
def test_an_entry_point_that_is_none_is_the_bench_that_failed(name: str, said: str) -> None:
    with pytest.raises(BenchError) as failed:
        supply(power={"entry_point": name})
    assert str(failed.value) == f"{power.GROUP}: {said}"


# A person


def test_a_person_is_asked_in_plain_words() -> None:
    asked, link = StringIO(), Mock()
    person = TerminalOperator(link, StringIO("\n\n"), asked)
    switch = supply_of(definition(power="operator"), link, lambda: person)
    assert switch is not None

    switch.off()
    switch.on()

    assert asked.getvalue() == (
        "Switch the supply of the sensor OFF, then press Enter: "
        "Switch the supply of the sensor ON, then press Enter: "
    )


def test_a_person_who_is_not_there_blames_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(operator, "ANSWER_S", 0.0)
    person = TerminalOperator(Mock(), StringIO("\n"), StringIO())
    switch = supply_of(definition(power="operator"), Mock(), lambda: person)
    assert switch is not None
    with pytest.raises(SetupRefused, match="did not answer"):
        switch.off()


# The bench


def test_a_supply_that_checks_may_not_switch_is_not_switched() -> None:
    nobody = definition(power="operator", allow=["reads"])
    assert supply_of(nobody, Mock(), Mock()) is None
    assert supply_of(definition(power="none"), Mock(), Mock()) is None
    assert supply_of(definition(power="simulator"), Mock(rig=None), Mock()) is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("power: on", "power: expected 'none', 'simulator' or 'operator', got"),
        ("power: operator", "expected an operator for power, got none"),
        ("power: {command: {off: relay 0}}", "power.command.on: expected this key, got nothing"),
        ("power: {off_s: 2}", "power: expected exactly one of command, scpi and entry_point"),
        (
            "power: {command: {off: a, on: b}, entry_point: c}",
            "power: expected exactly one of command, scpi and entry_point",
        ),
        ("power: {scpi: {off: OUTP OFF}}", "power.scpi.resource: expected this key, got nothing"),
    ],
)
def test_a_power_that_is_none_is_told_in_a_sentence(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bench.yaml"
    path.write_text(BENCH + text + "\n")
    with pytest.raises(SpecError) as wrong:
        load_bench(path)
    assert said in str(wrong.value)


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Callable[[str], Bench]]:
    benches: list[Bench] = []

    def make(more: str) -> Bench:
        path = tmp_path / "bench.yaml"
        path.write_text(BENCH + more)
        device = data("device_specs") / "siko_ims360.yaml"
        spec = load_spec(device).resolve()
        benches.append(Bench.open(load_bench(path), spec, {"channel": str(device)}, None))
        return benches[-1]

    yield make
    for bench in benches:
        bench.close()


def test_a_node_is_switched_by_the_person_of_the_bench(opened: Callable[[str], Bench]) -> None:
    bench = opened("power: operator\noperator: simulator\n")
    bench.find_node()
    node = bench.node()
    with node.without_supply():
        assert not node.answers()
    assert node.answers()
    node.power_cycle()
    assert node.answers()


def test_a_bench_with_nobody_does_not_switch(opened: Callable[[str], Bench]) -> None:
    bench = opened("power: none\n")
    bench.find_node()
    with pytest.raises(SetupRefused, match="cannot switch the supply"):
        bench.node().power_cycle()


def test_a_supply_that_is_not_there_closes_the_bus_again(
    opened: Callable[[str], Bench], tmp_path: Path
) -> None:
    with pytest.raises(BenchError, match="no entry point 'nobody'"):
        opened("power: {entry_point: nobody}\n")
    (tmp_path / "bench.yaml").unlink()
    opened("power: none\n").find_node()


def test_a_relay_that_fails_stops_the_run(judge: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "bench.yaml"
    allowed = BENCH.replace("power]", "power, non-volatile]")
    path.write_text(f"{allowed}power: {{command: {{off: no-such-relay 0, on: no-such-relay 1}}}}\n")

    done = judge("--bench", path, "--select", "STO-02 or OD-02")

    assert done.code == 2
    assert "The run ended early: power: cannot run 'no-such-relay 0'" in done.out
    assert not done.items("fail")


def test_a_switch_that_switches_nothing_is_not_the_sensors(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    path = tmp_path / "bench.yaml"
    stuck = '{command: {off: "true", on: "true"}}'
    path.write_text(f"{BENCH}power: {stuck}\n", encoding="utf-8")

    done = judge("--bench", path, "--select", "BOOT-01")

    assert done.code == 2
    assert not done.items("fail")
    reasons = {it["id"].rpartition("/")[2]: it["reason"] for it in done.record["items"]}
    assert "node 50 still answers: look at what switches it" in reasons["power-on"]
