"""Faults that change a figure of the simulated device's spec, given as `PATH=VALUE` or in a file."""

from __future__ import annotations

from pathlib import Path

import pytest

from conformance.errors import SpecError
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.fault_files import load_faults, read_fault
from conformance.spec.load import load_spec

SPEC = load_spec(Path(__file__).parents[2] / "device_specs" / "siko_ims360.yaml")


def default_of(*faults: str, readings: dict[str, int] | None = None) -> object:
    device = SimulatedDevice(SPEC, faults=load_faults(faults), readings=readings)
    return device.spec.entries[0x1017, 0].default


def test_a_figure_is_changed() -> None:
    assert default_of() == 0
    assert default_of("objects/0x1017/default=50") == 50
    assert default_of("objects/0x1017/default=0x64") == 100


def test_a_change_holds_under_every_reading() -> None:
    number = next(a.id for a in SPEC.document.ambiguities if len(a.readings) > 1)

    assert default_of("objects/0x1017/default=50", readings={number: 2}) == 50


def test_a_file_may_change_figures(tmp_path: Path) -> None:
    path = tmp_path / "late.yaml"
    path.write_text(
        "format: 1\nwhat: Its heartbeat runs as delivered.\nseen_by: [OD-10]\n"
        "inject: {changes: {objects/0x1017/default: 50}}\n",
        "utf-8",
    )

    assert default_of(str(path)) == 50
    assert read_fault(str(path)).seen_by == ["OD-10"]


@pytest.mark.parametrize(
    ("faults", "sentence"),
    [
        (["objects/0x1017/default=["], "expected PATH=VALUE"),
        (["objects/0x1017/default=1", "objects/0x1017/default=2"], "expected 1 as in"),
        (["no-such-fault"], "expected a path or one of"),
    ],
)
def test_a_wrong_change_gets_a_sentence(faults: list[str], sentence: str) -> None:
    with pytest.raises(SpecError, match=sentence.replace("[", r"\[")):
        load_faults(faults)


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (
            "objects/0x9017/default=50",
            "expected a path such as objects/0x1017/default of this file",
        ),
        ("objects/0x1017/default=[1]", "expected an integer or a text"),
        ("services/nmt/foo=1", "expected a known key, got 'foo'"),
    ],
)
def test_a_change_that_fits_no_spec_gets_a_sentence(fault: str, sentence: str) -> None:
    with pytest.raises(SpecError, match="--fault: ") as raised:
        default_of(fault)

    assert sentence in str(raised.value)


def test_a_file_with_a_wrong_path_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text("format: 1\nwhat: x\ninject:\n  changes: {factory/node_id: 5}\n", "utf-8")

    with pytest.raises(SpecError, match=r"wrong\.yaml:4: .*expected a path such as"):
        load_faults([str(path)])
