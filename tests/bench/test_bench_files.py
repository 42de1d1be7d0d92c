"""Bench files: those that come with the suite, what a mistake in one is told, and what options override."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from conformance import resources
from conformance.bench.definition import load_bench
from conformance.bench.overriding import overridden
from conformance.errors import SpecError
from conformance.options import RunOptions

FOLDER = "fixtures/benches"
NAMES = resources.names(FOLDER)
REAL = [name for name in NAMES if not name.startswith("simulator")]


@pytest.mark.parametrize("name", NAMES)
def test_every_file_is_valid_and_says_what_it_needs(name: str) -> None:
    path = resources.find(FOLDER, name, "--bench")
    assert load_bench(path).interface in can.VALID_INTERFACES
    assert path.read_text("utf-8").startswith("# ")


@pytest.mark.parametrize("name", REAL)
def test_a_real_bench_changes_nothing_for_good(name: str) -> None:
    path = resources.find(FOLDER, name, "--bench")
    assert load_bench(path).allow == ["reads", "writes", "resets"]
    assert "Needs" in path.read_text("utf-8")
    assert "Channel: " in path.read_text("utf-8")


def test_there_is_one_for_each_usual_adapter() -> None:
    interfaces = {load_bench(resources.find(FOLDER, name, "")).interface for name in REAL}
    usual = {"socketcan", "slcan", "socketcand", "pcan", "kvaser", "ixxat", "vector", "gs_usb"}
    assert interfaces == usual


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("interfaze: pcan", ":3: interfaze: "),
        ("control: nowhere", ":3: control: expected"),
        ("timestamp_jitter_ms: -1", ":3: timestamp_jitter_ms: expected"),
        ("node_id: 128", ":3: node_id: expected"),
        ("bitrate: fast", ":3: bitrate: expected"),
        ("allow: [reads, explodes]", ":3: allow"),
    ],
)
def test_a_mistake_is_told_with_its_place(line: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "b.yaml"
    path.write_text(f"format: 1\nwhat: x\n{line}\ninterface: virtual\n", "utf-8")
    with pytest.raises(SpecError) as refused:
        load_bench(path)
    assert told in str(refused.value)
    assert "got" in str(refused.value)


def test_channel_and_bit_rate_are_overridden() -> None:
    bench = load_bench(resources.find(FOLDER, "kvaser", "--bench"))
    assert overridden(bench) == bench
    other = overridden(bench, "1", 250_000)
    assert (other.channel, other.bitrate) == (1, 250_000)
    assert overridden(bench, "can1").channel == "can1"


@pytest.mark.parametrize("bitrate", [0, -1, 4_999, 1_000_001])
def test_a_bit_rate_that_no_bus_has_is_refused(bitrate: int) -> None:
    bench = load_bench(resources.find(FOLDER, "kvaser", "--bench"))
    with pytest.raises(SpecError, match="--bitrate: expected 5000 to 1000000"):
        overridden(bench, bitrate=bitrate)


def test_the_simulator_has_no_channel() -> None:
    bench = load_bench(resources.find(FOLDER, "simulator", "--bench"))
    with pytest.raises(SpecError, match="--channel: expected a bench with an adapter"):
        overridden(bench, "can0")


def test_a_run_that_is_repeated_has_them_again() -> None:
    options = RunOptions("x", bench="socketcan", channel="can1", bitrate=250_000)
    text = " ".join(options.arguments("v"))
    assert "--bench socketcan --channel can1 --bitrate 250000 --variant v" in text
