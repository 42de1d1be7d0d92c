"""What is no spec at all, and keys and values that no spec has."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

Complains: TypeAlias = Callable[..., None]
Edited: TypeAlias = Callable[..., str]
Problems: TypeAlias = Callable[[str], list[str]]

HEARTBEAT = "ranges: [[0, 0], [10, 65535]]"
CUT_OFF = "    default: 50"
FILTER = '    values: {0: "Off", 1: Slow, 2: Fast}'


def test_the_good_spec_has_no_problem(complains: Complains) -> None:
    complains([])


@pytest.mark.parametrize("text", ["", "# only\n# comments\n", "---\n", "null\n"])
def test_an_empty_file_is_no_spec(problems: Problems, text: str) -> None:
    assert problems(text) == ["spec.yaml: expected a device spec, got an empty file"]


def test_yaml_that_is_not_yaml_is_refused_with_its_line(problems: Problems) -> None:
    text = "format: 1\ndevice: [\n"
    (problem,) = problems(text)
    assert problem.startswith("spec.yaml:3: expected YAML, got: ")


@pytest.mark.parametrize(("text", "got"), [("5", "5"), ("[a, b]", "['a', 'b']"), ("a", "'a'")])
def test_yaml_without_keys_is_no_spec(problems: Problems, text: str, got: str) -> None:
    assert problems(text) == [f"spec.yaml:1: expected a mapping, got {got}"]


def test_every_missing_block_is_named(problems: Problems) -> None:
    blocks = ("device", "manual", "factory", "variants", "services", "objects")
    expected = [f"spec.yaml:1: {block}: expected this key, got nothing" for block in blocks]
    assert problems("format: 1") == expected


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (
            ("format: 1\n", "format: 2  #1\n"),
            "L1: format: expected 1, got 2",
        ),
        (
            ("    default: 0\n", "    defualt: 0  #1\n"),
            "L1: objects.0x1017.defualt: expected a known key, got 'defualt' (did you mean 'default'?)",
        ),
        (
            ("    default: 0\n", "    default: 0\n    zzz: 0  #1\n"),
            "L1: objects.0x1017.zzz: expected a known key, got 'zzz'",
        ),
        (
            ("    default: 0\n", "    default: 0\n    5: 0  #1\n"),
            "L1: objects.0x1017.5: expected a text as key, got 5",
        ),
        (
            ("    default: 0\n", "    default: 0\n    subs_: {}  #1\n"),
            "L1: objects.0x1017.subs_: expected a known key, got 'subs_' (did you mean 'subs'?)",
        ),
        (
            (
                "subs:\n      0: {name: Count,",
                "type: UNSIGNED8  #1\n    subs:\n      0: {name: Count,",
            ),
            "L1: objects.0x1A00.type: expected a known key, got 'type', which belongs elsewhere",
        ),
        (
            ("profile: 410}", "profile: 410, source: x}  #1"),
            "L1: device.source: expected a known key, got 'source', which belongs elsewhere",
        ),
        (
            ("profile: 410}", 'profile: "410"}  #1'),
            "L1: device.profile: expected an integer, got '410'",
        ),
        (
            ("name: Tilt,", "name: [Tilt],  #1\n  "),
            "L1: device.name: expected a text, got ['Tilt']",
        ),
        (
            ('revision: "3"', "revision: 3"),
            "spec.yaml:3: manual.revision: expected a text, got 3",
        ),
        (
            ("date: 2025-05-15", "date: 15.05.2025"),
            "spec.yaml:3: manual.date: expected a date such as 2025-05-15, got '15.05.2025'",
        ),
        (
            ("date: 2025-05-15", "date: 2025-02-30"),
            "spec.yaml:3: manual.date: expected a date such as 2025-05-15, got '2025-02-30'",
        ),
        (
            ("date: 2025-05-15", "date: 5"),
            "spec.yaml:3: manual.date: expected a date such as 2025-05-15, got 5",
        ),
        (
            ("node_id: 0x0A", "node_id: 0"),
            "spec.yaml:4: factory.node_id: expected at least 1, got 0",
        ),
        (
            ("node_id: 0x0A", "node_id: 128"),
            "spec.yaml:4: factory.node_id: expected at most 127, got 128",
        ),
        (
            ("node_id: 0x0A", "node_id: 10.0"),
            "spec.yaml:4: factory.node_id: expected an integer, got 10.0",
        ),
        (
            ("node_id: 0x0A", "node_id: true"),
            "spec.yaml:4: factory.node_id: expected an integer, got true",
        ),
        (
            ("node_id: 0x0A, ", ""),
            "spec.yaml:4: factory.node_id: expected this key, got nothing",
        ),
        (
            ("bitrate: 125000", "bitrate: 125k"),
            "spec.yaml:4: factory.bitrate: expected an integer, got '125k'",
        ),
        (
            ("bitrate: 125000", "bitrate: 2000000"),
            "spec.yaml:4: factory.bitrate: expected at most 1000000, got 2000000",
        ),
        (
            ('  nmt: {source: "2"}\n', "  nmt:  #1\n"),
            "L1: services.nmt: expected a mapping, got nothing",
        ),
        (
            ('  nmt: {source: "2"}\n', '  nmt: {source: ""}  #1\n'),
            "L1: services.nmt.source: expected at least 1 characters, got ''",
        ),
        (
            ("states: [operational]", "states: [running]  #1"),
            (
                "L1: services.emcy_producer.states.0: "
                "expected 'pre-operational', 'operational' or 'stopped', got 'running'"
            ),
        ),
        (
            ("codes: {0x5010: ", "codes: {0x15010: "),
            "spec.yaml:20: services.emcy_producer.codes.0x15010: expected at most 65535 as key, got 86032",
        ),
        (
            ("    count: 1\n", "    count: 0  #1\n"),
            "L1: services.tpdo.count: expected at least 1, got 0",
        ),
        (
            ("transmission_types: [[1, 240], [254, 255]]", "transmission_types: []  #1"),
            "L1: services.tpdo.transmission_types: expected at least 1 of them, got 0",
        ),
        (
            (
                "transmission_types: [[1, 240], [254, 255]]",
                "transmission_types: [1, 240]  #1\n    #2",
            ),
            (
                "L1: services.tpdo.transmission_types.0: expected two values, lowest and highest, got 1\n"
                "L1: services.tpdo.transmission_types.1: expected two values, lowest and highest, got 240"
            ),
        ),
        (
            ("signature: save", "signature: saves  #1"),
            "L1: services.store.signature: expected four characters such as save, got 'saves'",
        ),
        (
            ("signature: save", "signature: sävé  #1"),
            "L1: services.store.signature: expected four characters such as save, got 'sävé'",
        ),
        (
            ("groups: {1: [[0x1000, 0x9FFF]]}", 'groups: {1: [["0x1000 + NODEID", 0x9FFF]]}  #1'),
            "L1: services.store.groups.1.0.0: expected an integer, got '0x1000 + NODEID'",
        ),
        (
            ("  0x1001: {name", '  "0x1001": {name'),
            "spec.yaml:42: objects.0x1001: expected an integer as key, got '0x1001'",
        ),
        (
            ("  0x1001: {name", "  0x11001: {name"),
            "spec.yaml:42: objects.0x11001: expected at most 65535 as key, got 69633",
        ),
        (
            ("      1: {name: All", "      256: {name: All"),
            "spec.yaml:56: objects.0x1010.subs.0x0100: expected at most 255 as key, got 256",
        ),
        (
            (
                "type: UNSIGNED16\n    access: rw\n    kind: config\n    default: 0\n",
                "type: UINT16  #1\n    access: rw\n    kind: config\n    default: 0\n",
            ),
            "L1: objects.0x1017.type: expected a CiA 301 data type such as UNSIGNED16, got 'UINT16'",
        ),
        (
            (
                "type: UNSIGNED16\n    access: rw\n    kind: config\n    default: 0\n",
                "type: UNSIGNED16\n    access: rx  #1\n    kind: config\n    default: 0\n",
            ),
            "L1: objects.0x1017.access: expected 'ro', 'rw', 'wo' or 'const', got 'rx'",
        ),
        (
            (
                "type: UNSIGNED16\n    access: rw\n    kind: config\n    default: 0\n",
                "type: UNSIGNED16\n    access: rw\n    kind: setting  #1\n    default: 0\n",
            ),
            (
                "L1: objects.0x1017.kind: "
                "expected 'identity', 'constant', 'config', 'live', 'counter' or 'command', got 'setting'"
            ),
        ),
        (
            ("    default: 0\n", "    default: 1.5  #1\n"),
            "L1: objects.0x1017.default: expected an integer or a text, got 1.5",
        ),
        (
            ("    default: 0\n", "    default: {}  #1\n"),
            "L1: objects.0x1017.default: expected an integer or a text, got a mapping",
        ),
        (
            ("default: {one: 0x0003019A, two: 0x0004019A}", "default: {one: true, two: 5}  #1"),
            "L1: objects.0x1000.default.one: expected an integer or a text, got true",
        ),
        (
            (HEARTBEAT, "ranges: [10, 65535]  #1"),
            (
                "L1: objects.0x1017.ranges.0: expected two values, lowest and highest, got 10\n"
                "L1: objects.0x1017.ranges.1: expected two values, lowest and highest, got 65535"
            ),
        ),
        (
            (HEARTBEAT, "ranges: [[1, 2, 3]]  #1"),
            "L1: objects.0x1017.ranges.0: expected two values, lowest and highest, got [1, 2, 3]",
        ),
        (
            (HEARTBEAT, "ranges: 10..65535  #1"),
            "L1: objects.0x1017.ranges: expected a list, got '10..65535'",
        ),
        (
            (HEARTBEAT, "ranges: {one: [[0, 1]], two: [[0, 1.5]]}  #1"),
            "L1: objects.0x1017.ranges.two.0.1: expected an integer or a text, got 1.5",
        ),
        (
            (FILTER, "    values: {}  #1"),
            "L1: objects.0x2000.values: expected at least 1 of them, got 0",
        ),
        (
            (FILTER, "    values: {0: 5}  #1"),
            "L1: objects.0x2000.values.0: expected a text, got 5",
        ),
        (
            (FILTER, '    values: {"0": Off}  #1'),
            "L1: objects.0x2000.values.0: expected a mapping, got 'Off'",
        ),
        (
            (FILTER, FILTER + "\n    scale: fine  #1"),
            "L1: objects.0x2000.scale: expected a number, got 'fine'",
        ),
        (
            (FILTER, FILTER + "\n    scale: true  #1"),
            "L1: objects.0x2000.scale: expected a number, got true",
        ),
        (
            (FILTER, FILTER + "\n    mappable: yes  #1"),
            "L1: objects.0x2000.mappable: expected true or false, got 'yes'",
        ),
        (
            (FILTER, FILTER + "\n    variants: one  #1"),
            "L1: objects.0x2000.variants: expected a list, got 'one'",
        ),
        (
            ("octets: [4, 8]", "octets: [8]  #1"),
            "L1: objects.0x1008.octets: expected two values, lowest and highest, got [8]",
        ),
        (
            ('      object: "0x2000"', "      object: 0x12000  #1"),
            (
                "L1: objects.0x2001.limits_by.object: "
                'expected an index or an address such as "0x3110:1", got 73728'
            ),
        ),
        (
            ("  - id: T-01", "  - id: t1  #1"),
            "L1: ambiguities.0.id: expected an id such as X-07, got 't1'",
        ),
        (
            ("judged_by: either", "judged_by: both  #1"),
            "L1: ambiguities.0.judged_by: expected 'either' or the number of a reading, got 'both'",
        ),
        (
            ("judged_by: either", "judged_by: true  #1"),
            "L1: ambiguities.0.judged_by: expected 'either' or the number of a reading, got true",
        ),
        (
            ("    judged_by: either\n", ""),
            "spec.yaml:116: ambiguities.0.judged_by: expected this key, got nothing",
        ),
        (
            ("        changes: {objects/0x2000/default: 2}", "        changes: [2]  #1"),
            "L1: ambiguities.0.readings.1.changes: expected a mapping, got [2]",
        ),
        (
            ("        changes: {objects/0x2000/default: 2}", "        changes: {0x2000: 2}  #1"),
            "L1: ambiguities.0.readings.1.changes.0x2000: expected a text as key, got 8192",
        ),
    ],
)
def test_one_mistake_gets_its_sentence(
    complains: Complains, edit: tuple[str, str], sentence: str
) -> None:
    complains(edit, *sentence.split("\n"))


def test_an_object_with_only_a_name_misses_the_rest(complains: Complains) -> None:
    line = '  0x6013: {name: Hidden, type: INTEGER16, access: ro, kind: live, mappable: false, source: "3"}'
    complains(
        (line, "  0x6013: {name: Hidden}  #1"),
        *(
            f"L1: objects.0x6013.{key}: expected this key, got nothing"
            for key in ("type", "access", "kind", "source")
        ),
    )


def test_every_problem_is_reported_in_the_order_of_the_lines(complains: Complains) -> None:
    complains(
        [
            ("format: 1\n", "format: 0  #1\n"),
            ("node_id: 0x0A", "node_id: 0, nod_id: 1"),
            ('  nmt: {source: "2"}\n', '  nmt: {source: "2"}\n  nmt: {}  #2\n'),
            ("    default: 50\n", "    default: 50\n    default: 60  #3\n"),
            ("      1: {name: All", "      0x01: {nam: X}  #4\n      1: {name: All"),
            ("judged_by: either", "judged_by: [1]  #6"),
        ],
        "L1: format: expected 1, got 0",
        "spec.yaml:4: factory.node_id: expected at least 1, got 0",
        "spec.yaml:4: factory.nod_id: expected a known key, got 'nod_id' (did you mean 'node_id'?)",
        "L2: services.nmt: expected each key once, got it again (first on line 9)",
        "L4: objects.0x1010.subs.1.name: expected this key, got nothing",
        "L4: objects.0x1010.subs.1.type: expected this key, got nothing",
        "L4: objects.0x1010.subs.1.access: expected this key, got nothing",
        "L4: objects.0x1010.subs.1.kind: expected this key, got nothing",
        "L4: objects.0x1010.subs.1.nam: expected a known key, got 'nam' (did you mean 'name'?)",
        "spec.yaml:58: objects.0x1010.subs.1: "
        "expected each key once, got it again (first on line 57)",
        "L3: objects.0x2001.default: expected each key once, got it again (first on line 96)",
        "L6: ambiguities.0.judged_by: expected 'either' or the number of a reading, got [1]",
    )


def test_a_duplicate_is_a_problem_even_of_a_spec_that_is_good_otherwise(
    complains: Complains,
) -> None:
    complains(
        ('  nmt: {source: "2"}\n', '  nmt: {source: "2"}\n  nmt: {source: "2"}  #1\n'),
        "L1: services.nmt: expected each key once, got it again (first on line 9)",
    )
