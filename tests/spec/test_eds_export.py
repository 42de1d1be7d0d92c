"""From a spec to an EDS: another library reads it, and it comes back with every fact it can hold."""

from __future__ import annotations

from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable

from conformance.resources import data, names
from conformance.spec.eds.compare import compare
from conformance.spec.eds.reader import read_eds
from conformance.spec.eds.to_spec import import_eds
from conformance.spec.eds.writer import to_eds
from conformance.spec.load import SpecFile, find_problems, load_spec
from conformance.spec.model import DeviceSpec, Entry

NODE_ID = 5
CREATED = datetime(2025, 5, 15, 13, 30, tzinfo=UTC)


@cache
def built_in(name: str) -> SpecFile:
    return load_spec(data("device_specs") / f"{name}.yaml")


VARIANTS = [(n, v) for n in names("device_specs") for v in built_in(n).variants]


def export(folder: Path, name: str, variant: str, node_id: int | None = None) -> Path:
    path = folder / f"{name}.eds"
    text = to_eds(built_in(name), variant, node_id, path.name, CREATED)
    path.write_bytes(text.encode())
    return path


def listed(spec: DeviceSpec) -> list[Entry]:
    return [entry for entry in spec.entries.values() if not entry.reserved]


def hull(entry: Entry) -> tuple[int, int] | None:
    legal = entry.legal
    return None if not legal else (min(low for low, _ in legal), max(high for _, high in legal))


@pytest.mark.parametrize(("name", "variant"), VARIANTS)
def test_python_canopen_reads_every_entry_as_the_spec_has_it(
    name: str, variant: str, tmp_path: Path
) -> None:
    dictionary = canopen.import_od(str(export(tmp_path, name, variant)), NODE_ID)

    found: dict[tuple[int, int], ODVariable] = {}
    for item in dictionary.values():
        members = [item] if isinstance(item, ODVariable) else item.values()
        found |= {(v.index, v.subindex): v for v in members}
    expected = listed(built_in(name).resolve(variant, NODE_ID))
    assert found.keys() == {entry.key for entry in expected}
    for entry in expected:
        read = found[entry.key]
        limits = None if read.min is None and read.max is None else (read.min, read.max)
        assert (read.name, read.data_type, read.access_type) == (
            entry.name,
            entry.type,
            entry.access,
        )
        assert read.default == entry.default or (entry.default is None and not read.default)
        assert limits == hull(entry), entry.address
        assert read.pdo_mappable is bool(entry.mappable)


@pytest.mark.parametrize(("name", "variant"), VARIANTS)
def test_it_comes_back_with_every_fact_an_eds_can_hold(
    name: str, variant: str, tmp_path: Path
) -> None:
    imported = import_eds(export(tmp_path, name, variant))
    yaml = tmp_path / "back.yaml"
    yaml.write_text(imported.text, encoding="utf-8")

    back, problems = find_problems(yaml)
    assert back is not None, problems
    for node_id in (1, 127):
        ours, theirs = built_in(name).resolve(variant, node_id), back.resolve(None, node_id)
        assert [facts(entry) for entry in listed(ours)] == [
            facts(entry) for entry in theirs.entries.values()
        ]
    assert (theirs.device.vendor, theirs.device.name) == (ours.device.vendor, ours.device.name)
    assert (theirs.services.lss is None) == (ours.services.lss is None)
    titles = {index: doc.name for index, doc in built_in(name).document.objects.items()}
    for index, doc in back.document.objects.items():
        assert doc.name == titles.get(index, f"Object {index:04X}h")


def facts(entry: Entry) -> tuple[object, ...]:
    return (
        entry.address,
        entry.name,
        entry.type,
        entry.access,
        entry.default,
        hull(entry),
        entry.mappable,
    )


@pytest.mark.parametrize(("name", "variant"), VARIANTS)
def test_a_spec_and_its_own_eds_do_not_differ(name: str, variant: str, tmp_path: Path) -> None:
    eds = read_eds(export(tmp_path, name, variant))

    rows = compare(built_in(name).resolve(variant, NODE_ID), eds)

    assert [row for row in rows if row.differs] == []


def test_what_counts_from_the_node_id_stays_a_formula_unless_one_is_given(tmp_path: Path) -> None:
    name = names("device_specs")[-1]
    variant = built_in(name).variants[0]

    formula = export(tmp_path, name, variant).read_text("utf-8")
    fixed = export(tmp_path, name, variant, node_id=NODE_ID).read_text("utf-8")

    assert "DefaultValue=$NODEID+0x180\n" in formula
    assert "$NODEID" not in fixed
    assert "DefaultValue=0x185\n" in fixed


def test_an_eds_is_laid_out_as_cia_306_has_it(tmp_path: Path) -> None:
    name = names("device_specs")[-1]
    content = export(tmp_path, name, built_in(name).variants[0]).read_bytes()

    lines = content.decode("ascii").split("\r\n")
    sections = [line for line in lines if line.startswith("[")]
    assert sections[:5] == [
        "[FileInfo]",
        "[DeviceInfo]",
        "[DummyUsage]",
        "[Comments]",
        "[MandatoryObjects]",
    ]
    assert {"CreationDate=05-15-2025", "CreationTime=01:30PM", "EDSVersion=4.0"} <= set(lines)
    assert {"BaudRate_125=1", "BaudRate_10=0", "LSS_Supported=1", "NrOfTXPDO=4"} <= set(lines)
    assert max(map(len, lines)) <= 255
    assert "\n" not in content.decode("ascii").replace("\r\n", "")
