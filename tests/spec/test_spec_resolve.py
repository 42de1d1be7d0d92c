"""A spec resolved for a variant, a node-ID and readings."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from typing import TypeAlias

import pytest

from conformance.errors import SpecError
from conformance.spec.fields import key_of
from conformance.spec.load import SpecFile
from conformance.spec.model import Alternative, Entry
from conformance.spec.resolve import chosen_readings
from conformance.wire.datatypes import DataType

Edited: TypeAlias = Callable[..., str]
Loaded: TypeAlias = Callable[[str], SpecFile]

EITHER = "        changes: {objects/0x2000/default: 2}"


@pytest.fixture
def file(good: str, loaded: Loaded) -> SpecFile:
    return loaded(good)


def entry_of(file: SpecFile, index: int, sub: int = 0, **readings: int) -> Entry:
    asked = {name.replace("_", "-"): number for name, number in readings.items()}
    found = file.resolve(readings=asked).entry(index, sub)
    assert found is not None
    return found


def test_the_first_variant_and_the_factory_node_id_are_the_default(
    file: SpecFile, good: str
) -> None:
    spec = file.resolve()
    assert (spec.name, spec.variant, spec.node_id, spec.bitrate) == ("spec", "one", 10, 125000)
    assert (spec.device.name, spec.manual.revision) == ("Tilt", "3")
    assert spec.sha256 == sha256(good.encode()).hexdigest()
    assert spec.cite("7.2") == "Tilt manual 3, 7.2"


def test_a_variant_has_its_own_values_and_entries(file: SpecFile) -> None:
    one, two = (file.resolve(variant) for variant in ("one", "two"))
    defaults = [spec.entries[0x1000, 0].default for spec in (one, two)]
    assert defaults == [0x0003019A, 0x0004019A]
    assert one.entry(0x2003) is None
    assert two.entry(0x2003) is not None


def test_an_object_and_a_sub_index_may_belong_to_one_variant(
    edited: Edited, loaded: Loaded
) -> None:
    text = edited(
        ("    name: TPDO1 mapping\n", "    name: TPDO1 mapping\n    variants: [one, two]\n"),
        ("      3: {name: Third,", "      3: {variants: [two], name: Third,"),
    )
    file = loaded(text)
    assert [len(file.resolve(variant).subs(0x1A00)) for variant in ("one", "two")] == [3, 4]


def test_ranges_and_values_may_differ_per_variant(edited: Edited, loaded: Loaded) -> None:
    text = edited(
        (
            '    values: {0: "Off", 1: Slow, 2: Fast}',
            "    values: {one: {2: B, 1: A}, two: {1: A, 2: C, 3: D}}",
        ),
        (
            "    sources: {kind:",
            "    ranges: {one: [[0, 1]], two: [[-NODEID, 5]]}\n    sources: {kind:",
        ),
    )
    file = loaded(text)
    values = [file.resolve(variant).entries[0x2000, 0].values for variant in ("one", "two")]
    assert values == [{1: "A", 2: "B"}, {1: "A", 2: "C", 3: "D"}]
    assert file.resolve("two").entries[0x2003, 0].ranges == ((-10, 5),)


@pytest.mark.parametrize("node_id", [1, 0x32, 127])
def test_expressions_follow_the_node_id(file: SpecFile, node_id: int) -> None:
    spec = file.resolve(node_id=node_id)
    assert spec.entries[0x1014, 0].default == 0x80 + node_id
    assert spec.entries[0x1800, 1].default == 0x180 + node_id


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"variant": "three"}, "--variant: expected one of one, two (spec), got 'three'"),
        ({"node_id": 0}, "--node-id: expected 1 to 127, got 0"),
        ({"node_id": 128}, "--node-id: expected 1 to 127, got 128"),
        (
            {"readings": {"T-03": 1}},
            "--reading: expected an ambiguity of spec, got 'T-03'",
        ),
        ({"readings": {"T-01": 0}}, "--reading: expected 1 to 2 for T-01, got 0"),
        ({"readings": {"T-01": 3}}, "--reading: expected 1 to 2 for T-01, got 3"),
    ],
)
def test_what_the_spec_does_not_have_cannot_be_asked_for(
    file: SpecFile, arguments: dict[str, str], sentence: str
) -> None:
    with pytest.raises(SpecError) as caught:
        file.resolve(**arguments)  # type: ignore[arg-type]  # one of several kinds of argument
    assert str(caught.value) == sentence


def test_entries_stand_in_ascending_order(edited: Edited, loaded: Loaded) -> None:
    moved = '  0x1001: {name: Error register, type: UNSIGNED8, access: ro, kind: live, default: 0, source: "3"}\n'
    swapped = (
        "      1: {name: COB-ID, type: UNSIGNED32, access: rw, kind: config, "
        'default: "0x180 + NODEID"}\n'
    )
    last = "      2: {name: Type, type: UNSIGNED8, access: rw, kind: config, default: 254}\n"
    text = edited((moved, ""), ("ambiguities:\n", f"{moved}ambiguities:\n"), (swapped, ""))
    spec = loaded(text.replace(last, last + swapped)).resolve()
    assert list(spec.entries) == sorted(spec.entries)
    assert spec.indices() == tuple(sorted({index for index, _ in spec.entries}))
    assert [entry.sub for entry in spec.subs(0x1800)] == [0, 1, 2]


def test_an_entry_carries_what_the_file_says(file: SpecFile) -> None:
    spec = file.resolve("two")
    assert spec.entries[0x2001, 0] == Entry(
        index=0x2001,
        sub=0,
        in_record=False,
        name="Cut-off",
        type=DataType.UNSIGNED16,
        access="rw",
        kind="config",
        default=50,
        limits_by=spec.entries[0x2001, 0].limits_by,
        source="3",
    )
    limits = spec.entries[0x2001, 0].limits_by
    assert limits is not None
    assert (limits.key, limits.source) == ((0x2000, 0), "3")
    assert limits.ranges == {1: ((10, 100),), 2: ((10, 1000),)}


def test_a_sub_index_inherits_the_source_of_its_object(edited: Edited, loaded: Loaded) -> None:
    spec = loaded(
        edited(
            (
                "      3: {name: Third,",
                "      3: {source: 9.9, name: Third,".replace("9.9", '"9.9"'),
            )
        )
    ).resolve("two")
    assert [entry.source for entry in spec.subs(0x1A00)] == ["3", "3", "3", "9.9"]
    entry = spec.entries[0x2003, 0]
    assert (entry.source_of("kind"), entry.source_of("type")) == ("4", "3")


def test_entries_know_how_they_are_addressed_and_accessed(edited: Edited, loaded: Loaded) -> None:
    spec = loaded(
        edited(("      3: {name: Third,", "      3: {reserved: true, name: Third,"))
    ).resolve()
    plain, command, reserved = (
        spec.entries[key] for key in ((0x1017, 0), (0x2002, 0), (0x1A00, 3))
    )
    assert (plain.address, reserved.address) == ("1017h", "1A00h:03")
    assert (plain.readable, plain.writable) == (True, True)
    assert (command.readable, command.writable) == (False, True)
    assert (reserved.readable, reserved.writable) == (False, False)
    assert [entry.index for entry in spec.by_kind("command", "identity")] == [
        *(0x1000, 0x1008, 0x1010, 0x2002)
    ]


def test_what_is_legal_are_ranges_else_values(file: SpecFile) -> None:
    spec = file.resolve()
    assert spec.entries[0x1017, 0].legal == ((0, 0), (10, 30000))
    assert spec.entries[0x2000, 0].legal == ((0, 0), (1, 1), (2, 2))
    assert spec.entries[0x1001, 0].legal is None


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("0x1017", (0x1017, 0)),
        ("0x3110:1", (0x3110, 1)),
        ("8192:0x0A", (0x2000, 10)),
        ("1:", (1, 0)),
    ],
)
def test_an_address_in_the_file_has_index_and_sub_index(text: str, key: tuple[int, int]) -> None:
    assert key_of(text) == key


def test_a_reading_is_the_one_asked_for_else_the_judged_else_the_first(file: SpecFile) -> None:
    ambiguities = file.document.ambiguities
    assert chosen_readings(ambiguities) == {"T-01": 1, "T-02": 2}
    assert chosen_readings(ambiguities, {"T-01": 2}) == {"T-01": 2, "T-02": 2}
    assert file.resolve().readings == {"T-01": 1, "T-02": 2}
    assert file.resolve(readings={"T-02": 1}).readings == {"T-01": 1, "T-02": 1}


def test_a_judged_reading_changes_objects_and_services(file: SpecFile) -> None:
    judged, asked = file.resolve(), file.resolve(readings={"T-02": 1})
    assert judged.entries[0x1017, 0].ranges == ((0, 0), (10, 30000))
    assert asked.entries[0x1017, 0].ranges == ((0, 0), (10, 65535))
    periods = [spec.services.heartbeat_producer for spec in (judged, asked)]
    assert [period.max_ms for period in periods if period] == [30000, 65535]
    assert judged.entries[0x1017, 0].alternatives == ()


def test_an_open_ambiguity_gives_alternatives(file: SpecFile) -> None:
    entry = entry_of(file, 0x2000)
    (alternative,) = entry.alternatives
    assert isinstance(alternative, Alternative)
    assert (alternative.ambiguity, alternative.reading) == ("T-01", 2)
    assert [reading.default for reading in entry.readings] == [1, 2]
    assert entry_of(file, 0x2001).alternatives == ()


def test_an_ambiguity_asked_for_is_open_no_more(file: SpecFile) -> None:
    entry = entry_of(file, 0x2000, T_01=2)
    assert (entry.default, entry.alternatives) == (2, ())


def test_alternatives_stand_on_what_else_is_asked_for(edited: Edited, loaded: Loaded) -> None:
    file = loaded(edited((EITHER, "        changes: {objects/0x1017/unit: s}")))
    for number, last in ((1, 65535), (2, 30000)):
        entry = entry_of(file, 0x1017, T_02=number)
        assert [(r.unit, r.ranges and r.ranges[1]) for r in entry.readings] == [
            (None, (10, last)),
            ("s", (10, last)),
        ]


def test_an_entry_that_one_open_reading_removes_is_optional(edited: Edited, loaded: Loaded) -> None:
    file = loaded(edited((EITHER, "        changes: {objects/0x6013/variants: [two]}")))
    assert file.resolve("one").entries[0x6013, 0].optional
    assert not file.resolve("two").entries[0x6013, 0].optional
    assert file.resolve("one", readings={"T-01": 2}).entry(0x6013) is None


def test_an_entry_that_one_open_reading_adds_is_optional(edited: Edited, loaded: Loaded) -> None:
    added = "{name: New, type: UNSIGNED8, access: ro, kind: live, source: x}"
    file = loaded(edited((EITHER, f"        changes: {{objects/0x1018: {added}}}")))
    assert entry_of(file, 0x1018).optional
    assert not entry_of(file, 0x1018, T_01=2).optional
    assert file.resolve(readings={"T-01": 1}).entry(0x1018) is None
    assert list(file.resolve().entries) == sorted(file.resolve().entries)


def test_an_open_reading_of_a_service_alone_gives_no_alternatives(
    edited: Edited, loaded: Loaded
) -> None:
    text = edited((EITHER, "        changes: {services/nmt/automatic_start: true}"))
    spec = loaded(text).resolve()
    assert not spec.services.nmt.automatic_start
    assert all(entry.alternatives == () for entry in spec.entries.values())


def test_readings_that_exclude_each_other_cannot_be_asked_for_together(
    edited: Edited, loaded: Loaded
) -> None:
    whole = "{name: X, type: UNSIGNED16, access: rw, kind: config, source: x, default: 0}"
    file = loaded(
        edited(
            (EITHER, f"        changes: {{objects/0x1017: {whole}}}"),
            (
                "          objects/0x1017/ranges: [[0, 0], [10, 30000]]",
                "          objects/0x1017/ranges/1/1: 30000",
            ),
            ("judged_by: 2", "judged_by: 1"),
        )
    )
    with pytest.raises(SpecError) as caught:
        file.resolve(readings={"T-01": 2, "T-02": 2})
    assert str(caught.value) == (
        "--reading: expected readings that do not exclude each other, got T-01=2, T-02=2 "
        "(objects.0x1017.ranges.1.1: expected a path such as objects/0x1017/default of this file, "
        "got 'objects/0x1017/ranges/1/1')"
    )
    assert entry_of(file, 0x1017, T_02=2).alternatives == ()
    assert len(entry_of(file, 0x1017).alternatives) == 1
