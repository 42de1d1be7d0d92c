"""Each figure of a spec becomes a defect, and what is no defect does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from conformance.mutants.collection import all_defects, real_defects
from conformance.mutants.defect import Defect
from conformance.simulator.device import SimulatedDevice
from conformance.simulator.fault_files import load_faults
from conformance.spec.load import SpecFile, load_spec
from conformance.spec.model import DeviceSpec

INVENTED = Path(__file__).parents[1] / "simulator" / "invented.yaml"
SPECS = Path(__file__).parents[2] / "device_specs"


@pytest.fixture(scope="module")
def file() -> SpecFile:
    return load_spec(INVENTED)


@pytest.fixture(scope="module")
def spec(file: SpecFile) -> DeviceSpec:
    return file.resolve("two")


@pytest.fixture(scope="module")
def defects(file: SpecFile, spec: DeviceSpec) -> dict[str, Defect]:
    return {it.id: it for it in real_defects(file, spec, all_defects(file, spec))}


@pytest.mark.parametrize(
    ("defect", "fault"),
    {
        "1017h/missing": "objects/0x1017/variants=[]",
        "1017h/default=10": "objects/0x1017/default=10",
        "1017h/access=ro": "objects/0x1017/access=ro",
        "1017h/type=UNSIGNED32": "objects/0x1017/type=UNSIGNED32",
        "1017h/ranges=9 accepted": "objects/0x1017/ranges=[[0, 0], [9, 65535]]",
        "1017h/ranges=10 refused": "objects/0x1017/ranges=[[0, 0], [11, 65535]]",
        "1017h/ranges=65535 refused": "objects/0x1017/ranges=[[0, 0], [10, 65534]]",
        "heartbeat_producer/states=without stopped": (
            "services/heartbeat_producer/states=[pre-operational, operational]"
        ),
        "tpdo/other_types=accepted": "services/tpdo/other_types=accepted",
    }.items(),
)
def test_a_figure_is_a_little_different(
    defects: dict[str, Defect], defect: str, fault: str
) -> None:
    assert defects[defect].faults == (fault,)


def test_what_the_file_says_twice_changes_twice(defects: dict[str, Defect]) -> None:
    assert defects["heartbeat_producer/min_ms=11"].faults == (
        "services/heartbeat_producer/min_ms=11",
        "objects/0x1017/ranges=[[0, 0], [11, 65535]]",
    )


def test_every_entry_has_defects(defects: dict[str, Defect], spec: DeviceSpec) -> None:
    touched = {defect.key for defect in defects.values()}

    assert [entry.address for entry in spec.entries.values() if entry.key not in touched] == []


def test_the_simulated_device_can_have_every_defect(
    defects: dict[str, Defect], file: SpecFile, spec: DeviceSpec
) -> None:
    for defect in defects.values():
        device = SimulatedDevice(file, variant="two", faults=load_faults(defect.faults))
        differs = device.spec.entries != spec.entries or device.spec.services != spec.services
        assert differs or device.spec.behaviours != spec.behaviours or defect.area == "faults"


def test_each_id_stands_for_one_defect(file: SpecFile, spec: DeviceSpec) -> None:
    ids = [defect.id for defect in all_defects(file, spec)]

    assert len(ids) == len(set(ids))


def test_another_reading_of_the_manual_is_no_defect() -> None:
    file = load_spec(SPECS / "siko_ims360.yaml")
    spec = file.resolve("two-axis")
    every = all_defects(file, spec)
    reading = next(
        reading
        for ambiguity in file.document.ambiguities
        if ambiguity.judged_by == "either"
        for reading in ambiguity.readings
        if len(reading.changes) == 1 and next(iter(reading.changes)).endswith("/access")
    )
    ((path, value),) = reading.changes.items()
    fault = f"{path}={value}"

    conforming = [it for it in every if it.faults == (fault,)]

    assert conforming
    assert list(real_defects(file, spec, conforming)) == []
