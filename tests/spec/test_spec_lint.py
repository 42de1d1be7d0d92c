"""Specs whose parts do not hold together."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

Complains: TypeAlias = Callable[..., None]
Edited: TypeAlias = Callable[..., str]
Problems: TypeAlias = Callable[[str], list[str]]

HEARTBEAT = "ranges: [[0, 0], [10, 65535]]"
FILTER = '    values: {0: "Off", 1: Slow, 2: Fast}'
NAME = "    default: TILT\n    octets: [4, 8]"
LAST = '  0x6013: {name: Hidden, type: INTEGER16, access: ro, kind: live, mappable: false, source: "3"}'


def text_entry(kind: str, default: str) -> tuple[str, str]:
    entry = (
        f'{{name: X, type: {kind}, access: ro, kind: constant, source: "3", default: {default}}}'
    )
    return LAST, f"{LAST}\n  0x7000: {entry}  #1"


def mapping(word: str, name: str = "First") -> tuple[str, str]:
    words = {"First": "0x60100010", "Second": "0x60110020", "Third": "0"}
    start = f"{name}, type: UNSIGNED32, access: rw, kind: config, default: "
    return f"{start}{words[name]}}}", f"{start}{word}}}  #1"


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        # an entry by itself
        (
            ("    default: 0\n", "    default: 5  #1\n"),
            "L1: objects.0x1017.default: expected a value in its range (0, 10 to 30000), got 5",
        ),
        (
            ("    default: 0\n", "    default: 65536  #1\n"),
            "L1: objects.0x1017.default: expected 0 to 65535 for UNSIGNED16, got 65536",
        ),
        (
            ("    default: 0\n", "    default: -1  #1\n"),
            "L1: objects.0x1017.default: expected 0 to 65535 for UNSIGNED16, got -1",
        ),
        (
            ("    default: 0\n", '    default: "NODE_ID * 2"  #1\n'),
            "L1: objects.0x1017.default: expected the name NODEID, got 'NODE_ID' in 'NODE_ID * 2'",
        ),
        (
            ("    default: 0\n", "    default: ten  #1\n"),
            "L1: objects.0x1017.default: expected the name NODEID, got 'ten' in 'ten'",
        ),
        (
            ("    default: 0\n", '    default: "1 +"  #1\n'),
            "L1: objects.0x1017.default: expected an integer expression, got '1 +'",
        ),
        (
            ("kind: config\n    default: 1\n", "kind: config\n    default: 3  #1\n"),
            "L1: objects.0x2000.default: expected a value in its range (0, 1, 2), got 3",
        ),
        (
            (FILTER, "    values: {0: A, 1: B, 2: C, 256: D}  #1"),
            "L1: objects.0x2000.values.0x0100: expected 0 to 255 for UNSIGNED8, got 256",
        ),
        (
            (FILTER, FILTER + "\n    bits: {-1: A, 7: B, 8: C}  #1"),
            (
                "L1: objects.0x2000.bits.-1: expected bit 0 to 7, got -1\n"
                "L1: objects.0x2000.bits.8: expected bit 0 to 7, got 8"
            ),
        ),
        (
            (FILTER, FILTER + "\n    octets: [1, 1]  #1"),
            "L1: objects.0x2000.octets: expected no octets for UNSIGNED8, got some",
        ),
        (
            ("octets: [4, 8]", "octets: [5, 8]"),
            "spec.yaml:48: objects.0x1008.default: expected 5 to 8 octets, got 4",
        ),
        (
            ("octets: [4, 8]", "octets: [8, 4]  #1"),
            "L1: objects.0x1008.octets: expected least and greatest length in octets, got 8 to 4",
        ),
        (
            ("octets: [4, 8]", "octets: [-1, 4]  #1"),
            "L1: objects.0x1008.octets: expected least and greatest length in octets, got -1 to 4",
        ),
        (
            ("octets: [4, 8]", "ranges: [[1, 2]]  #1\n    values: {1: A}\n    bits: {0: A}"),
            (
                "L1: objects.0x1008.ranges: expected no ranges for VISIBLE_STRING, got some\n"
                "spec.yaml:50: objects.0x1008.values: expected no values for VISIBLE_STRING, got some\n"
                "spec.yaml:51: objects.0x1008.bits: expected no bits for VISIBLE_STRING, got some"
            ),
        ),
        (
            ("    default: TILT\n", "    default: 1000  #1\n"),
            "L1: objects.0x1008.default: expected a text (in quotes) for VISIBLE_STRING, got 1000",
        ),
        (
            ("    default: TILT\n", "    default: TILT°  #1\n"),
            "L1: objects.0x1008.default: expected printable ASCII characters for VISIBLE_STRING, got 'TILT°'",
        ),
        (
            text_entry("REAL32", '"1,5"'),
            "L1: objects.0x7000.default: expected a number for REAL32, got '1,5'",
        ),
        (
            text_entry("REAL64", "nan"),
            "L1: objects.0x7000.default: expected a number for REAL64, got 'nan'",
        ),
        (
            text_entry("BOOLEAN", "maybe"),
            'L1: objects.0x7000.default: expected "0" or "1" for BOOLEAN, got \'maybe\'',
        ),
        (
            text_entry("BOOLEAN", "1"),
            "L1: objects.0x7000.default: expected a text (in quotes) for BOOLEAN, got 1",
        ),
        (
            text_entry("DOMAIN", "€"),
            "L1: objects.0x7000.default: expected characters up to FFh for DOMAIN, got '€'",
        ),
        (
            text_entry("TIME_OF_DAY", "abc"),
            "L1: objects.0x7000.default: expected 6 octets, got 3",
        ),
        (
            (HEARTBEAT, "ranges: [[10, 0]]  #1"),
            "L1: objects.0x1017.ranges: expected the lower end first, got 10 to 0",
        ),
        (
            (HEARTBEAT, "ranges: [[0, 70000]]  #1"),
            "L1: objects.0x1017.ranges: expected 0 to 65535 for UNSIGNED16, got 0 to 70000",
        ),
        (
            (HEARTBEAT, 'ranges: [[0, 0], [10, "NODE"]]  #1'),
            (
                "L1: objects.0x1017.ranges: expected the name NODEID, got 'NODE' in 'NODE'\n"
                "L1: objects.0x1017.ranges: expected the lower end first, got 10 to 0"
            ),
        ),
        # variants
        (
            ("variants: [two]", "variants: [too]  #1"),
            "L1: objects.0x2003.variants: expected a variant of this file (one, two), got 'too'",
        ),
        (
            ("    name: Store\n", "    name: Store\n    variants: [one, three]  #1\n"),
            (
                "spec.yaml:30: services.store.object: expected a documented object, got 1010h\n"
                "L1: objects.0x1010.variants: expected a variant of this file (one, two), got 'three'"
            ),
        ),
        (
            ("default: {one: 0x0003019A, two: 0x0004019A}", "default: {one: 1, tow: 2}  #1"),
            (
                "L1: objects.0x1000.default.tow: expected a variant of this file (one, two), got 'tow'\n"
                "L1: objects.0x1000.default: expected a value for variant 'two', got nothing"
            ),
        ),
        # names of other things
        (
            ("affects: [0x6010]", "affects: [0x6010, 0x6020]"),
            "spec.yaml:102: objects.0x2002.affects: expected a documented object, got 6020h",
        ),
        (
            ("sources: {kind:", "sources: {kid:"),
            "spec.yaml:110: objects.0x2003.sources.kid: expected the name of an attribute, got 'kid'",
        ),
        # sub-index 0
        (
            ("kind: constant, default: 1}", "kind: constant, default: 2}  #1"),
            "L1: objects.0x1010.subs.0.default: expected 1, the highest sub-index listed, got 2",
        ),
        (
            (
                "type: UNSIGNED8, access: const, kind: constant, default: 1}",
                "type: VISIBLE_STRING, access: const, kind: constant, default: a}  #1",
            ),
            "L1: objects.0x1010.subs.0.default: expected 1, the highest sub-index listed, got 'a'",
        ),
        (
            ("      0: {name: Count, type: UNSIGNED8, access: rw, kind: config, default: 3}\n", ""),
            (
                "spec.yaml:23: services.tpdo.mapping: expected 1 documented objects, got none for 1A00h\n"
                "spec.yaml:76: objects.0x1A00.subs: expected sub-index 0, got none"
            ),
        ),
        # limits by another object
        (
            ('object: "0x2000"', 'object: "2000:x"  #1'),
            (
                "L1: objects.0x2001.limits_by.object: "
                "expected an index or an address such as \"0x3110:1\", got '2000:x'"
            ),
        ),
        (
            ('object: "0x2000"', 'object: "0x2000:1"  #1'),
            "L1: objects.0x2001.limits_by.object: expected a documented object, got 2000h:01",
        ),
        (
            ('object: "0x2000"', 'object: "0x1008"  #1'),
            "L1: objects.0x2001.limits_by.object: expected an integer object, got 1008h:00",
        ),
        (
            ("        1: [[10, 100]]\n", "        1: [[100, 10]]  #1\n"),
            "L1: objects.0x2001.limits_by.ranges.1: expected the lower end first, got 100 to 10",
        ),
        (
            ("        1: [[10, 100]]\n", "        1: [[10, 65536]]  #1\n"),
            (
                "L1: objects.0x2001.limits_by.ranges.1: "
                "expected 0 to 65535 for UNSIGNED16, got 10 to 65536"
            ),
        ),
        (
            ("        1: [[10, 100]]\n", "        1: [[NODE, 100]]  #1\n"),
            "L1: objects.0x2001.limits_by.ranges.1: expected the name NODEID, got 'NODE' in 'NODE'",
        ),
        (
            ("        1: [[10, 100]]\n", "        3: [[10, 100]]  #1\n"),
            "L1: objects.0x2001.limits_by.ranges.3: expected a value of 2000h (0, 1, 2), got 3",
        ),
        (
            ("    default: 50\n", "    default: 500  #1\n"),
            "L1: objects.0x2001.default: expected 10 to 100 while 2000h is 1, got 500",
        ),
        (
            (
                NAME,
                f"{NAME}\n    limits_by: {{object: '0x2000', ranges: {{1: [[1, 2]]}}, source: x}}  #1",
            ),
            "L1: objects.0x1008.limits_by: expected no limits_by for VISIBLE_STRING, got some",
        ),
        # services
        (
            ("    object: 0x1017\n", "    object: 0x1018  #1\n"),
            "L1: services.heartbeat_producer.object: expected a documented object, got 1018h",
        ),
        (
            (
                "    error_register: 0x1001\n",
                "    error_register: 0x1002  #1\n    history: 0x1003\n",
            ),
            (
                "L1: services.emcy_producer.error_register: expected a documented object, got 1002h\n"
                "spec.yaml:19: services.emcy_producer.history: expected a documented object, got 1003h"
            ),
        ),
        (
            ("    min_ms: 10\n", "    min_ms: 40000  #1\n"),
            "L1: services.heartbeat_producer.min_ms: expected at most max_ms (30000), got 40000",
        ),
        (
            ("{1: [[0x1000, 0x9FFF]]}", "{1: [[0x9FFF, 0x1000]], 2: [[0, 0x10000]]}"),
            (
                "spec.yaml:32: services.store.groups.1: "
                "expected the lower end first, got 40959 to 4096\n"
                "spec.yaml:32: services.store.groups.2: expected a documented sub-index, got 1010h:02\n"
                "spec.yaml:32: services.store.groups.2: expected 0 to 65535 for indices, got 0 to 65536"
            ),
        ),
        (
            ("[[1, 240], [254, 255]]", "[[1, 256], [255, 254]]  #1"),
            (
                "L1: services.tpdo.transmission_types: "
                "expected 0 to 255 for transmission types, got 1 to 256\n"
                "L1: services.tpdo.transmission_types: expected the lower end first, got 255 to 254"
            ),
        ),
        (
            ("    count: 1\n", "    count: 512\n    communication: 0xFFF0  #1\n"),
            (
                "spec.yaml:23: services.tpdo.mapping: "
                "expected 512 documented objects, got none for 1A01h to 1BFFh\n"
                "L1: services.tpdo.communication: "
                "expected 512 documented objects, got none for FFF0h to 101EFh"
            ),
        ),
        # mapping words
        (
            mapping("0x60200010"),
            (
                "L1: objects.0x1A00.subs.1.default: "
                "expected a documented object, got 6020h:00 in mapping word 60200010h"
            ),
        ),
        (
            mapping("0x60130010"),
            (
                "L1: objects.0x1A00.subs.1.default: "
                "expected a mappable object, got 6013h:00 in mapping word 60130010h"
            ),
        ),
        (
            mapping("0x60100020"),
            (
                "L1: objects.0x1A00.subs.1.default: "
                "expected 16 bits for INTEGER16, got 32 for 6010h:00 in mapping word 60100020h"
            ),
        ),
        (
            mapping("0x60120010"),
            (
                "L1: objects.0x1A00.subs.1.default: expected an object of fixed length, "
                "got VISIBLE_STRING at 6012h:00 in mapping word 60120010h"
            ),
        ),
        (
            mapping("0x160100010"),
            (
                "L1: objects.0x1A00.subs.1.default: "
                "expected 0 to 4294967295 for UNSIGNED32, got 5906628624"
            ),
        ),
        (
            mapping("-1"),
            "L1: objects.0x1A00.subs.1.default: expected 0 to 4294967295 for UNSIGNED32, got -1",
        ),
        (
            mapping("0x60110020", "Third"),
            "L1: objects.0x1A00.subs.3.default: expected at most 64 mapped bits, got 80",
        ),
        # ambiguities
        (
            ("- id: T-02", "- id: T-01  #1"),
            "L1: ambiguities.1.id: expected each id once, got T-01 again",
        ),
        (
            ("judged_by: 2", "judged_by: 3  #1"),
            "L1: ambiguities.1.judged_by: expected 'either' or 1 to 2, got 3",
        ),
        (
            ("judged_by: 2", "judged_by: 0  #1"),
            "L1: ambiguities.1.judged_by: expected 'either' or 1 to 2, got 0",
        ),
    ],
)
def test_one_mistake_gets_its_sentence(
    complains: Complains, edit: tuple[str, str], sentence: str
) -> None:
    complains(edit, *sentence.split("\n"))


def test_a_single_reading_is_judged_by_its_number(complains: Complains) -> None:
    readings = (
        "      - says: Slow.\n      - says: Fast.\n        changes: {objects/0x2000/default: 2}\n"
    )
    complains(
        (f"{readings}    judged_by: either", "      - says: Slow.\n    judged_by: 2  #1"),
        "L1: ambiguities.0.judged_by: expected 'either' or 1, got 2",
    )


@pytest.mark.parametrize(
    "edit",
    [
        # a default is judged only where it means something
        ("affects: [0x6010]", "default: 0, affects: [0x6010]"),
        # a record whose sub-index 0 counts something else, or is not printed
        ("kind: constant, default: 1}", "kind: counter, default: 0}"),
        ("access: const, kind: constant, default: 1}", "access: rw, kind: constant, default: 0}"),
        ("kind: constant, default: 1}", "kind: constant}"),
        # entries that may be absent need not be counted
        (
            "      1: {name: All,",
            (
                "      2: {name: Maybe, type: UNSIGNED8, access: ro, kind: live, optional: true}\n"
                "      1: {name: All,"
            ),
        ),
        (
            "kind: constant, default: 1}\n      1: {name: All,",
            (
                "kind: constant, default: 2}\n"
                "      2: {name: Maybe, type: UNSIGNED8, access: ro, kind: live, optional: true}\n"
                "      1: {name: All,"
            ),
        ),
        # a doubted sub-index 0
        (
            "changes: {objects/0x2000/default: 2}",
            "changes: {objects/0x1010/subs/0/default: 5}",
        ),
        # words beyond the count are not mapped
        (
            "default: 3}\n      1: {name: First, type: UNSIGNED32, access: rw, kind: config, default: 0x60100010}",
            "default: 0}\n      1: {name: First, type: UNSIGNED32, access: rw, kind: config, default: 1}",
        ),
        # without limits at the other entry's default, or without defaults
        ("        1: [[10, 100]]\n", "        0: [[10, 20]]\n"),
        ("    default: 50\n", ""),
        ("access: rw\n    kind: config\n    default: 1\n", "access: rw\n    kind: config\n"),
        ("    default: TILT\n", ""),
        ("    octets: [4, 8]\n", ""),
        ("  tpdo:\n    count: 1\n", "  tpdo:\n    count: 1\n    min_cycle_ms: 10\n"),
        text_entry("REAL32", '"0.5"'),
        text_entry("REAL64", '"1e3"'),
        text_entry("BOOLEAN", '"1"'),
        text_entry("BOOLEAN", '"true"'),
        text_entry("UNICODE_STRING", "°C"),
        text_entry("OCTET_STRING", "°C"),
        text_entry("TIME_OF_DAY", "abcdef"),
    ],
)
def test_what_holds_together_is_good(complains: Complains, edit: tuple[str, str]) -> None:
    complains(edit)


def test_a_device_without_tpdo_and_store_is_good(edited: Edited, problems: Problems) -> None:
    text = edited()
    start, end = text.index("  heartbeat_producer:"), text.index("objects:\n")
    changes = "          services/heartbeat_producer/max_ms: 30000\n"
    assert problems((text[:start] + text[end:]).replace(changes, "")) == []


def test_mistakes_of_all_parts_are_reported_together(complains: Complains) -> None:
    complains(
        [
            ("    min_ms: 10\n", "    min_ms: 40000  #1\n"),
            ("    default: 0\n", "    default: 5  #2\n"),
            mapping("0x60200010", "Third"),
            ("variants: [two]", "variants: [too]  #4"),
            ("judged_by: either", "judged_by: 7  #5"),
        ],
        "L1: services.heartbeat_producer.min_ms: expected at most max_ms (30000), got 40000",
        "L2: objects.0x1017.default: expected a value in its range (0, 10 to 30000), got 5",
        "spec.yaml:80: objects.0x1A00.subs.3.default: "
        "expected a documented object, got 6020h:00 in mapping word 60200010h",
        "L4: objects.0x2003.variants: expected a variant of this file (one, two), got 'too'",
        "L5: ambiguities.0.judged_by: expected 'either' or 1 to 2, got 7",
    )
