"""From an EDS to a starting spec: nothing is lost, and the result is always a good spec."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import TypeAlias

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from conformance.errors import SpecError
from conformance.simulator.device import SimulatedDevice
from conformance.spec.eds.to_spec import Imported, import_eds
from conformance.spec.load import SpecFile, find_problems

Import: TypeAlias = Callable[[str], tuple[Imported, SpecFile]]

TIDY = """\
[FileInfo]
FileName=tidy.eds
FileVersion=1
FileRevision=2
CreationDate=05-15-2025

[DeviceInfo]
VendorName=Nobody: & Sons
ProductName=Tilt
BaudRate_125=0
BaudRate_500=1
NrOfTXPDO=1
LSS_Supported=1

[MandatoryObjects]
SupportedObjects=3
1=0x1000
2=0x1001
3=0x1018

[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x1019A
PDOMapping=0

[1001]
ParameterName=Error register
DataType=5
AccessType=ro

[1018]
ParameterName=Identity
ObjectType=9
SubNumber=2

[1018sub0]
ParameterName=Highest sub-index
DataType=5
AccessType=const
DefaultValue=4

[1018sub4]
ParameterName=Serial number
DataType=7
AccessType=ro
DefaultValue=77

[OptionalObjects]
SupportedObjects=7
1=0x1010
2=0x1014
3=0x1017
4=0x1800
5=0x1A00
6=0x6010
7=0x6200

[1010]
ParameterName=Store
ObjectType=8
CompactSubObj=2
DataType=7
AccessType=rw

[1010Name]
NrOfEntries=1
2=Store communication

[1014]
ParameterName=COB-ID EMCY
DataType=7
AccessType=rw
DefaultValue=$NODEID+0x80

[1017]
ParameterName=Heartbeat
DataType=6
AccessType=rw
DefaultValue=1000
LowLimit=10
HighLimit=0x7FFF

[1800]
ParameterName=TPDO 1
ObjectType=9
SubNumber=3

[1800sub0]
ParameterName=Count
DataType=5
AccessType=ro
DefaultValue=2

[1800sub1]
ParameterName=COB-ID
DataType=7
AccessType=rw
DefaultValue=$NODEID+0x180

[1800sub2]
ParameterName=Type
DataType=5
AccessType=rw
DefaultValue=254

[1A00]
ParameterName=Mapping 1
ObjectType=9
SubNumber=2

[1A00sub0]
ParameterName=Count
DataType=5
AccessType=rw
DefaultValue=1

[1A00sub1]
ParameterName=First
DataType=7
AccessType=rw
DefaultValue=0x60100010

[6010]
ParameterName=Slope
DataType=3
AccessType=ro
PDOMapping=1
Unit=deg

[6200]
ParameterName=Output
DataType=5
AccessType=rww
PDOMapping=1
ObjFlags=0x1

[ManufacturerObjects]
SupportedObjects=4
1=0x2000
2=0x2001
3=0x2002
4=0x2003

[2000]
ParameterName=Offset
DataType=3
AccessType=rw
DefaultValue=0xFFFF
LowLimit=-10

[2001]
ParameterName=A # name: "quoted"
DataType=9
AccessType=rw
DefaultValue=yes
ParameterValue=no

[2002]
ParameterName=Gain
DataType=8
AccessType=rw
DefaultValue=0.5
LowLimit=0.1

[2003]
ParameterName=Firmware
ObjectType=2
AccessType=wo
"""
REDUNDANT = re.compile(r"SupportedObjects=|SubNumber=|NrOfEntries=|ObjectType=(0x7|9)$|FileName=")
"""What only repeats what other lines say."""


@pytest.fixture
def imported(tmp_path: Path) -> Import:
    def read(text: str) -> tuple[Imported, SpecFile]:
        return convert(tmp_path, text.encode())

    return read


def convert(folder: Path, content: bytes) -> tuple[Imported, SpecFile]:
    """Import a file, and insist on a good spec."""
    eds, yaml = folder / "tilt.eds", folder / "tilt.yaml"
    eds.write_bytes(content)
    result = import_eds(eds)
    yaml.write_bytes(result.text.encode())
    file, problems = find_problems(yaml)
    assert [str(problem) for problem in problems] == []
    assert file is not None
    return result, file


def sentences(result: Imported) -> list[str]:
    return [str(problem).partition("tilt.eds:")[2] for problem in result.problems]


def test_a_tidy_eds_becomes_a_spec(imported: Import) -> None:
    result, file = imported(TIDY)

    document, spec = file.document, file.resolve(None, 5)
    assert sentences(result) == []
    assert (document.device.vendor, document.device.name) == ("Nobody: & Sons", "Tilt")
    assert document.device.profile == 410
    assert document.manual.name == "EDS tilt.eds 1.2"
    assert document.manual.date == date(2025, 5, 15)
    assert (document.factory.node_id, document.factory.bitrate) == (1, 500_000)
    entries = spec.entries
    assert {key: e.kind for key, e in entries.items() if key[1] == 0} == {
        (0x1000, 0): "identity",
        (0x1001, 0): "live",
        (0x1018, 0): "constant",
        (0x1010, 0): "constant",
        (0x1014, 0): "config",
        (0x1017, 0): "config",
        (0x1800, 0): "constant",
        (0x1A00, 0): "config",
        (0x2000, 0): "config",
        (0x2001, 0): "config",
        (0x2002, 0): "config",
        (0x2003, 0): "command",
        (0x6010, 0): "live",
        (0x6200, 0): "live",
    }
    assert entries[0x1010, 1].kind == "command"
    assert [entries[0x1010, sub].name for sub in (1, 2)] == ["Store 1", "Store communication"]
    assert entries[0x1014, 0].default == 0x85
    assert entries[0x1017, 0].ranges == ((10, 0x7FFF),)
    assert (entries[0x2000, 0].default, entries[0x2000, 0].ranges) == (-1, ((-10, 32767),))
    assert (entries[0x2001, 0].name, entries[0x2001, 0].default) == ('A # name: "quoted"', "yes")
    assert entries[0x2002, 0].default == "0.5"
    assert (entries[0x6010, 0].mappable, entries[0x6010, 0].unit) == (True, "deg")
    assert entries[0x1000, 0].source == f"line {TIDY[: TIDY.index('[1000]')].count(chr(10)) + 1}"


def test_services_follow_from_the_objects(imported: Import) -> None:
    services = imported(TIDY)[1].document.services

    assert services.heartbeat_producer is not None
    assert (services.heartbeat_producer.min_ms, services.heartbeat_producer.max_ms) == (10, 0x7FFF)
    assert services.emcy_producer is not None
    assert services.emcy_producer.error_register == 0x1001
    assert services.emcy_producer.history is None
    assert services.tpdo is not None
    assert (services.tpdo.count, services.tpdo.max_mapped) == (1, 1)
    assert services.tpdo.map_only_while == []
    assert services.store is not None
    assert list(services.store.groups) == [1, 2]
    assert services.lss is not None
    assert "store-configuration" not in services.lss.configuration
    assert services.restore is None
    assert services.sync_consumer is None


def test_no_line_is_without_trace(imported: Import) -> None:
    whole = imported(TIDY)[0].text
    lines = TIDY.split("\n")
    for number, line in enumerate(lines):
        if "=" not in line or REDUNDANT.match(line):
            continue
        text = "\n".join([*lines[:number], "", *lines[number + 1 :]])
        result = imported(text)[0]

        assert result.text != whole or "in the list" in str(result.problems), line


@pytest.mark.parametrize(
    ("line", "kept"),
    [
        ("ObjFlags=0x1", "ObjFlags=0x1"),
        ("AccessType=rww", "AccessType=rww"),
        ("ParameterValue=no", "ParameterValue=no"),
        ("LowLimit=0.1", "LowLimit=0.1"),
        ("DefaultValue=77", "DefaultValue=77"),
        ("BaudRate_500=1", "BaudRate_500=1"),
        ("CreationDate=05-15-2025", "CreationDate=05-15-2025"),
    ],
)
def test_what_a_spec_has_no_place_for_is_a_comment_with_its_line(
    line: str, kept: str, imported: Import
) -> None:
    number = TIDY.split("\n").index(line) + 1

    assert f"# line {number}: {kept}\n" in imported(TIDY)[0].text + "\n"


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("DefaultValue=254", "DefaultValue=300", "expected 0 to 255 for UNSIGNED8, got '300'"),
        ("DefaultValue=254", "DefaultValue=0254", "(read as octal, 172)"),
        ("DefaultValue=0x60100010", "DefaultValue=0x60100020", "(default left out)"),
        ("DefaultValue=0x60100010", "DefaultValue=0x60110010", "expected a documented object"),
        ("HighLimit=0x7FFF", "HighLimit=-1", "expected 0 to 65535 for UNSIGNED16, got '-1'"),
        ("DefaultValue=0xFFFF", "DefaultValue=-11", "(ranges left out)"),
        ("LowLimit=-10", "LowLimit=10\nHighLimit=5", "expected at most HighLimit (5), got 10"),
        ("PDOMapping=1\nUnit", "PDOMapping=0\nUnit", "expected 1, for 1A00h:01 maps it, got 0"),
        ("DataType=3\nAccessType=rw", "DataType=0x20\nAccessType=rw", "got 0x0020"),
        ("DataType=9\n", "\n", "expected DataType, got none"),
        ("AccessType=rww", "AccessType=UNKNOWN", "got 'UNKNOWN'"),
        ("AccessType=wo\n", "\n", "expected AccessType, got none"),
        ("4=0x2003", "4=0x2004", "expected the section [2004], got none"),
        ("[1A00sub0]", "[1A00sub7]", "expected sub-index 0, got none"),
        ("CompactSubObj=2", "CompactSubObj=255", "expected 0 to 254, got '255'"),
        ("[6010]", "[1000]\nDefaultValue=1\n[6010]", "expected each section once"),
        ("Unit=deg", "Unit=deg\nUnit=rad", "expected each key once, got it again"),
        ("ParameterName=Slope\n", "\n", "expected ParameterName, got none"),
        ("SubNumber=3", "SubNumber=9", "expected 3, the number of its sub-indices, got 9"),
        ("[1017]", "[1017", "expected ] after the name of a section"),
        ("[2003]", "[2003sub1]", "expected [2003] beside its sub-indices, got none"),
    ],
)
def test_what_does_not_hold_together_is_told_and_left_out(
    old: str, new: str, sentence: str, imported: Import
) -> None:
    assert TIDY.count(old) >= 1
    text = TIDY.replace(old, new, 1)

    result, file = imported(text)

    found = [s for s in sentences(result) if sentence in s]
    assert found, sentences(result)
    told = int(found[0].split(":")[0])
    assert abs(told - TIDY[: TIDY.index(old)].count("\n") - 1) <= 60
    SimulatedDevice(file).power_on(0)


@pytest.mark.parametrize("attribute", ["DataType=0x20", "AccessType=UNKNOWN"])
def test_an_entry_that_is_not_understood_is_there_but_not_judged(
    attribute: str, imported: Import
) -> None:
    key = attribute.partition("=")[0]
    text = TIDY.replace("[2000]\n", f"[2000]\n{attribute}\n").replace(f"{key}=3", "", 1)

    entry = imported(text)[1].resolve().entries[0x2000, 0]

    assert entry.optional
    assert entry.kind == "live"


def test_sub_indices_beyond_the_count_are_left_open(imported: Import) -> None:
    spec = imported(TIDY.replace("DefaultValue=2\n", "DefaultValue=1\n"))[1].resolve()

    assert not spec.entries[0x1800, 1].optional
    assert spec.entries[0x1800, 2].optional


def test_a_dcf_gives_node_id_and_bit_rate(imported: Import) -> None:
    file = imported(TIDY + "[DeviceComissioning]\nNodeID=0x20\nBaudrate=250\n")[1]

    assert (file.document.factory.node_id, file.document.factory.bitrate) == (32, 250_000)


def test_a_type_of_the_files_own_is_read_as_what_it_is_built_on(imported: Import) -> None:
    own = "[A0]\nParameterName=Own\n[A0sub1]\nDefaultValue=0x3\n"
    text = TIDY.replace("DataType=3\nAccessType=rw", "DataType=0xA0\nAccessType=rw")

    result, file = imported(text + own)

    assert file.resolve().entries[0x2000, 0].type.name == "INTEGER16"
    assert any("(read as INTEGER16" in sentence for sentence in sentences(result))


@pytest.mark.parametrize("text", ["[DeviceInfo]\nVendorName=X\n", "[Foo]\n1=2\n", "[A0]\n"])
def test_a_file_without_objects_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"tilt.eds:1: expected an object such as \[1000\]"):
        convert(tmp_path, text.encode())


def test_an_eds_too_large_for_a_spec_is_refused(tmp_path: Path) -> None:
    objects = "".join(
        f"[{index:04X}]\nParameterName={'x' * 240}\nObjectType=8\nCompactSubObj=254\nDataType=5\nAccessType=rw\n"
        for index in range(0x2000, 0x2014)
    )

    with pytest.raises(SpecError, match=r"tilt\.eds: expected an EDS whose spec has at most 1 MB"):
        convert(tmp_path, objects.encode())


LINES = TIDY.encode().split(b"\n")
EDITS = st.lists(
    st.tuples(
        st.integers(0, len(LINES) - 1),
        st.sampled_from(["delete", "double", "value", "noise", "swap"]),
        st.one_of(
            st.binary(max_size=12),
            st.sampled_from([b"0xFF", b"-1", b"$NODEID", b"99999999999999999999", b"010", b" "]),
        ),
    ),
    min_size=1,
    max_size=8,
)


def mutated(edits: list[tuple[int, str, bytes]]) -> bytes:
    lines = list(LINES)
    for number, how, noise in edits:
        line = lines[number]
        match how:
            case "delete":
                lines[number] = b""
            case "double":
                lines[number] = line + b"\n" + line
            case "value":
                lines[number] = line.partition(b"=")[0] + b"=" + noise
            case "noise":
                lines[number] = line[:3] + noise + line[3:]
            case _:
                lines[number], lines[-number] = lines[-number], lines[number]
    return b"\n".join(lines)


@given(edits=EDITS)
@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_damaged_eds_is_a_good_spec_or_refused(
    edits: list[tuple[int, str, bytes]], tmp_path: Path
) -> None:
    try:
        _, file = convert(tmp_path, mutated(edits))
    except SpecError as error:
        assert re.search(r"tilt.eds:\d+: .*expected .*, got ", str(error))
    else:
        SimulatedDevice(file).power_on(0)
