"""Mistakes in the rules between objects, and in what services and entries say of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

Complains: TypeAlias = Callable[..., None]

PLACE = "ambiguities:\n  - id: T-01"
NMT = '  nmt: {source: "2"}'
REGISTER = "    register_bits: {0: Any error}\n"
MAPPING = "    map_only_while: [disabled]\n"
FILTER = '    values: {0: "Off", 1: Slow, 2: Fast}\n'
EITHER = "        changes: {objects/0x2000/default: 2}"
STATES = "'pre-operational', 'operational' or 'stopped'"


def rule(*rules: str) -> tuple[str, str]:
    """Put rules into the good spec, numbered from 1."""
    lines = "".join(f'  x{n}: {{{it}, source: "3"}}  #{n}\n' for n, it in enumerate(rules, 1))
    return PLACE, f"behaviours:\n{lines}{PLACE}"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "rule: same-values, objects: [0x2000, 0x2001]",
            (
                ": expected 'same-value', 'paired', 'slope', 'zeroing', 'reset-command', "
                "'status-bits', 'low-pass-filter' as 'rule', got 'same-values'"
            ),
        ),
        ("objects: [0x2000, 0x2001]", ": expected the key 'rule', got none"),
        (
            "rule: same-value, objects: [0x2000, 0x2099]",
            ".objects.1: expected a documented object, got 2099h",
        ),
        (
            'rule: same-value, objects: [0x2000, "0x1800:9"]',
            ".objects.1: expected a documented object, got 1800h:09",
        ),
        (
            "rule: same-value, objects: [0x2000, 2001h]",
            ".objects.1: expected an index or an address such as \"0x3110:1\", got '2001h'",
        ),
        (
            'rule: same-value, objects: [0x2000, "0x1800:256"]',
            ".objects.1: expected an index or an address such as \"0x3110:1\", got '0x1800:256'",
        ),
        (
            "rule: same-value, objects: [0x2000, 0x10000]",
            '.objects.1: expected an index or an address such as "0x3110:1", got 65536',
        ),
        ("rule: same-value, objects: [0x2000]", ".objects: expected at least 2 of them, got 1"),
        (
            "rule: paired, objects: [0x2000, 0x2001, 0x2003]",
            ".objects: expected at most 2 of them, got 3",
        ),
        (
            "rule: paired, objects: [0x2000, 0x1008]",
            ".objects.1: expected an integer object, got VISIBLE_STRING at 1008h",
        ),
        (
            "rule: paired, objects: [0x2000, 0x2001], reads: old",
            ".reads: expected 'written' or 'in-force', got 'old'",
        ),
        ("rule: slope, value: 0x6099", ".value: expected a documented object, got 6099h"),
        (
            "rule: slope, value: 0x6010, preset: 0x6012",
            ".preset: expected an integer object, got VISIBLE_STRING at 6012h",
        ),
        (
            "rule: slope, value: 0x6010, resolution: 0x6098, offset: 0x6013",
            ".resolution: expected a documented object, got 6098h",
        ),
        ("rule: slope, value: 0x6010, inversion: 32", ".inversion: expected at most 31, got 32"),
        (
            "rule: slope, value: 0x6010, ofset: 0x6013",
            ".ofset: expected a known key, got 'ofset' (did you mean 'offset'?)",
        ),
        ("rule: zeroing, command: 0x2099, slopes: {0: x2}", None),
        (
            "rule: zeroing, command: 0x2002, slopes: {0: y}",
            ".slopes.0: expected the name of a slope behaviour, got 'y'",
        ),
        (
            "rule: zeroing, command: 0x2002, slopes: {1: x1}",
            ".slopes.1: expected the name of a slope behaviour, got 'x1'",
        ),
        (
            "rule: zeroing, command: 0x2002, slopes: {}",
            ".slopes: expected at least 1 of them, got 0",
        ),
        ("rule: reset-command, command: 0x2002", ".value: expected this key, got nothing"),
        (
            "rule: reset-command, command: 0x2097, value: 1",
            ".command: expected a documented object, got 2097h",
        ),
        (
            "rule: status-bits, object: 0x2096, bits: {0: {errors: [1]}}",
            ".object: expected a documented object, got 2096h",
        ),
        (
            "rule: status-bits, object: 0x6010, bits: {3: {object: 0x2095, value: 1}}",
            ".bits.3.object: expected a documented object, got 2095h",
        ),
    ],
)
def test_a_mistake_in_a_rule_is_told_at_its_line(
    complains: Complains, text: str, sentence: str | None
) -> None:
    if sentence is None:
        sentence = (
            ".command: expected a documented object, got 2099h\n"
            "L1: behaviours.x1.slopes.0: expected the name of a slope behaviour, got 'x2'"
        )
    complains(rule(text), *f"L1: behaviours.x1{sentence}".split("\n"))


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (
            (NMT, f'{NMT}\n  supply: {{min_v: 30, max_v: 10, source: "1"}}  #1'),
            "L1: services.supply: expected min_v up to max_v (10), got 30",
        ),
        (
            (
                NMT,
                '  nmt: {start_by: {object: 0x2099, mask: 4, value: 0, source: "2"}, source: "2"} #1',
            ),
            "L1: services.nmt.start_by.object: expected a documented object, got 2099h",
        ),
        (
            (
                NMT,
                '  nmt: {start_by: {object: "0x1010:5", mask: 4, value: 0, source: "2"}, source: "2"} #1',
            ),
            "L1: services.nmt.start_by.object: expected a documented object, got 1010h:05",
        ),
        (
            (
                NMT,
                '  nmt: {start_by: {object: 0x2000, mask: 0, value: 0, source: "2"}, source: "2"} #1',
            ),
            "L1: services.nmt.start_by.mask: expected at least 1, got 0",
        ),
        (
            (REGISTER, f"{REGISTER}    manufacturer_code: {{object: 0x2099, octet: 1}} #1\n"),
            (
                "L1: services.emcy_producer.manufacturer_code.object: "
                "expected a documented object, got 2099h"
            ),
        ),
        (
            (REGISTER, f"{REGISTER}    manufacturer_code: {{object: 0x2000, octet: 5}} #1\n"),
            "L1: services.emcy_producer.manufacturer_code.octet: expected at most 4, got 5",
        ),
        (
            (REGISTER, f'{REGISTER}    on_error: {{object: 0x2099, source: "2"}} #1\n'),
            "L1: services.emcy_producer.on_error.object: expected a documented object, got 2099h",
        ),
        (
            (REGISTER, f'{REGISTER}    on_error: {{state: halted, source: "2"}} #1\n'),
            f"L1: services.emcy_producer.on_error.state: expected {STATES}, got 'halted'",
        ),
        (
            (
                REGISTER,
                f'{REGISTER}    causes: [{{cause: tilt-z, code: 1, source: "2"}}] #1\n',
            ),
            "L1: services.emcy_producer.causes.0.cause: expected 'tilt-x' or 'tilt-y', got 'tilt-z'",
        ),
        (
            (
                REGISTER,
                f'{REGISTER}    causes: [{{cause: tilt-x, code: 1, limits: [5, -5], source: "2"}}] #1\n',
            ),
            (
                "L1: services.emcy_producer.causes.0.limits: "
                "expected lowest and highest angle, got 5 to -5"
            ),
        ),
        (
            (
                REGISTER,
                (
                    f"{REGISTER}    causes: [{{cause: tilt-x, code: 1, "
                    'limits: {two: [1, 0.5], three: [-5, 5]}, source: "2"}] #1\n'
                ),
            ),
            (
                "L1: services.emcy_producer.causes.0.limits: "
                "expected a variant of this file (one, two), got 'three'\n"
                "L1: services.emcy_producer.causes.0.limits.two: "
                "expected lowest and highest angle, got 1 to 0.5"
            ),
        ),
        (
            (
                MAPPING,
                f'{MAPPING}    byte_order: {{object: 0x2099, big_endian: 0, source: "2"}} #1\n',
            ),
            "L1: services.tpdo.byte_order.object: expected a documented object, got 2099h",
        ),
        (
            (MAPPING, f"{MAPPING}    octets: 9 #1\n"),
            "L1: services.tpdo.octets: expected at most 8, got 9",
        ),
        (
            ("    signature: save\n", "    signature: save\n    settle_ms: -1 #1\n"),
            "L1: services.store.settle_ms: expected at least 0, got -1",
        ),
    ],
)
def test_a_mistake_in_a_service_is_told_at_its_line(
    complains: Complains, edit: tuple[str, str], sentence: str
) -> None:
    complains(edit, *sentence.split("\n"))


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (
            "writable_while: [{object: 0x2099, mask: 1, value: 1}]",
            ".writable_while.0.object: expected a documented object, got 2099h",
        ),
        (
            'writable_while: [{object: 0x2001, mask: 1, value: 1}, {object: "0x1010:7", mask: 1, value: 1}]',
            ".writable_while.1.object: expected a documented object, got 1010h:07",
        ),
        (
            "writable_while: [{object: 0x1008, mask: 1, value: 1}]",
            ".writable_while.0.object: expected an integer object, got VISIBLE_STRING at 1008h",
        ),
        (
            "writable_while: [{object: 0x2001, value: 1}]",
            ".writable_while.0.mask: expected this key, got nothing",
        ),
        ("otherwise: dropped", ".otherwise: expected 'refused' or 'ignored', got 'dropped'"),
        (
            "effective: after-power-cycle",
            (
                ".effective: expected 'at-once', 'after-store' or 'after-store-and-reset', "
                "got 'after-power-cycle'"
            ),
        ),
        (
            "after_node_id_change: moved",
            ".after_node_id_change: expected 'kept', 'difference-kept' or 'default', got 'moved'",
        ),
        (
            "follows: {one: tilt-x, three: tilt-y}",
            ".follows.three: expected a variant of this file (one, two), got 'three'",
        ),
    ],
)
def test_a_mistake_in_an_entry_is_told_at_its_line(
    complains: Complains, line: str, sentence: str
) -> None:
    complains((FILTER, f"{FILTER}    {line}  #1\n"), f"L1: objects.0x2000{sentence}")


def test_a_conflict_that_cannot_be_settled_so_is_told(complains: Complains) -> None:
    edit = ("        2: [[10, 1000]]\n", "        2: [[10, 1000]]\n      conflict: raised #1\n")
    sentence = "expected 'kept', 'lowered' or 'refused', got 'raised'"
    complains(edit, f"L1: objects.0x2001.limits_by.conflict: {sentence}")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            "behaviours/x1/objects/1: 0x2099",
            "behaviours/x1/objects/1: expected a documented object, got 2099h",
        ),
        (
            "behaviours/x2/holds: false",
            (
                "behaviours/x2/holds: expected a path such as objects/0x1017/default of this file, "
                "got 'behaviours/x2/holds'"
            ),
        ),
        (
            "behaviours/x1/holds: 2",
            "behaviours/x1/holds: expected true or false, got 2",
        ),
    ],
)
def test_a_reading_that_makes_no_rule_is_told_at_its_line(
    complains: Complains, change: str, sentence: str
) -> None:
    edits = [
        rule("rule: same-value, objects: [0x2000, 0x2001]"),
        (EITHER, f"        changes:\n          {change}  #2"),
    ]
    complains(edits, f"L2: ambiguities.0.readings.1.changes.{sentence}")
