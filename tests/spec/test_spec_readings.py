"""Readings that do not fit the file, or make a spec that does not hold together."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

from conformance.spec.readings import ChangeError, parse_path

Complains: TypeAlias = Callable[..., None]

EITHER = "        changes: {objects/0x2000/default: 2}"
JUDGED = "          objects/0x1017/ranges: [[0, 0], [10, 30000]]"
SAYS = 121
HERE = "L1: ambiguities.0.readings.1.changes"


def changes(*pairs: str) -> tuple[str, str]:
    lines = "".join(f"\n          {pair}  #{n}" for n, pair in enumerate(pairs, 1))
    return EITHER, f"        changes:{lines}"


def test_a_path_is_keys_and_numbers() -> None:
    assert parse_path("objects/0x1003/subs/0/default") == ("objects", 0x1003, "subs", 0, "default")


def test_a_change_error_says_what_is_wrong() -> None:
    assert str(ChangeError(((), "expected a, got b"), (("x",), "c"))) == "expected a, got b; c"


@pytest.mark.parametrize(
    "path",
    [
        "''",
        "objects",
        "objects/",
        "objects/0x10000",
        "objects/-1",
        "objects/name/default",
        "objects/0x1099/default",
        "objects/0x1017/name/text",
        "objects/0x1017/ranges/5",
        "objects/0x1017/ranges/first",
        "services",
        "services/5",
        "services/nmt/source/text",
        "services/lss/source",
        "device/name",
        "format",
        "ambiguities/0/judged_by",
        "objects.0x2000.default",
    ],
)
@pytest.mark.parametrize("judged", ["either", "1", "2"])
def test_a_path_that_cannot_be_changed_is_refused(
    complains: Complains, path: str, judged: str
) -> None:
    got = "" if path == "''" else path
    key = f"{HERE}.{got}"
    sentence = f"expected a path such as objects/0x1017/default of this file, got {got!r}"
    complains(
        [changes(f"{path}: 2"), ("judged_by: either", f"judged_by: {judged}")],
        f"{key}: {sentence}",
    )


FOUND = [
    (
        ["objects/0x2000/default: [2]"],
        ["L1.objects/0x2000/default: expected an integer or a text, got [2]"],
    ),
    (
        ["objects/0x2000/defualt: 2"],
        [
            (
                "L1.objects/0x2000/defualt: "
                "expected a known key, got 'defualt' (did you mean 'default'?)"
            )
        ],
    ),
    (
        ["objects/0x2000: {name: X, type: UNSIGNED8, access: ro, source: x}"],
        ["L1.objects/0x2000: expected this key, got nothing (objects.0x2000.kind)"],
    ),
    (
        ["objects/0x1010/subs/1/access: r", "services/nmt/automatic_start: 1"],
        [
            "L1.objects/0x1010/subs/1/access: expected 'ro', 'rw', 'wo' or 'const', got 'r'",
            "L2.services/nmt/automatic_start: expected true or false, got 1",
        ],
    ),
    (
        ["objects/0x2000/default: 9"],
        ["L1.objects/0x2000/default: expected a value in its range (0, 1, 2), got 9"],
    ),
    (
        ["objects/0x2000/default: 256"],
        ["L1.objects/0x2000/default: expected 0 to 255 for UNSIGNED8, got 256"],
    ),
    (
        ["objects/0x2000/default: NODE"],
        ["L1.objects/0x2000/default: expected the name NODEID, got 'NODE' in 'NODE'"],
    ),
    (
        ["services/emcy_producer/object: 0x1015"],
        ["L1.services/emcy_producer/object: expected a documented object, got 1015h"],
    ),
    # on top of what T-02 is judged by
    (
        ["services/heartbeat_producer/min_ms: 30001"],
        [
            "L1.services/heartbeat_producer/min_ms: expected at most max_ms (30000), got 30001",
        ],
    ),
    # what shows elsewhere
    (
        ["objects/0x2000/variants: [three]"],
        [
            "expected a documented object, got 2000h:00 (objects.0x2001.limits_by.object)",
            "L1.objects/0x2000/variants: expected a variant of this file (one, two), got 'three'",
        ],
    ),
    (
        ["objects/0x2000/values: {0: 'Off', 2: Fast}"],
        [
            "expected a value of 2000h (0, 2), got 1 (objects.0x2001.limits_by.ranges.1)",
            (
                "L1.objects/0x2000/values: "
                "expected a value in its range (0, 2), got 1 (objects.0x2000.default)"
            ),
        ],
    ),
    (
        ["objects/0x6010/type: INTEGER32"],
        [
            (
                "expected 32 bits for INTEGER32, got 16 for 6010h:00 in mapping word 60100010h "
                "(objects.0x1A00.subs.1.default)"
            )
        ],
    ),
    (
        ["objects/0x1010/subs/2: {name: X, type: UNSIGNED8, access: ro, kind: live}"],
        [
            (
                "L1.objects/0x1010/subs/2: expected 2, the highest sub-index listed, got 1 "
                "(objects.0x1010.subs.0.default)"
            )
        ],
    ),
    (
        ["objects/0x1014/variants: [one]"],
        ["expected a documented object, got 1014h (services.emcy_producer.object)"],
    ),
    (
        ["services/tpdo/count: 2"],
        [
            (
                "L1.services/tpdo/count: expected 2 documented objects, got none for 1801h "
                "(services.tpdo.communication)"
            ),
            (
                "L1.services/tpdo/count: expected 2 documented objects, got none for 1A01h "
                "(services.tpdo.mapping)"
            ),
        ],
    ),
]


@pytest.mark.parametrize(("pairs", "sentences"), FOUND)
def test_a_reading_is_linted_where_it_stands(
    complains: Complains, pairs: list[str], sentences: list[str]
) -> None:
    def whole(text: str) -> str:
        if text.startswith("L"):
            return f"{text[:2]}: ambiguities.0.readings.1.changes{text[2:]}"
        return f"spec.yaml:{SAYS}: ambiguities.0.readings.1: {text}"

    complains(changes(*pairs), *map(whole, sentences))


def test_a_judged_reading_is_linted_where_it_stands(complains: Complains) -> None:
    complains(
        (JUDGED, "          objects/0x1017/ranges: [[0, 70000]]  #1"),
        "L1: ambiguities.1.readings.1.changes.objects/0x1017/ranges: "
        "expected 0 to 65535 for UNSIGNED16, got 0 to 70000",
    )


def test_what_a_judged_reading_does_to_its_neighbours_shows_there(complains: Complains) -> None:
    complains(
        [
            (JUDGED, "          objects/0x1017/ranges: [[10, 30000]]"),
            ("    default: 0\n", "    default: 0  #1\n"),
        ],
        "L1: objects.0x1017.default: expected a value in its range (10 to 30000), got 0",
    )


def test_a_reading_not_judged_is_linted_though_it_changes_nothing(complains: Complains) -> None:
    """Reading 1 of T-02 is the file as it stands; reading 2 is the judged one."""
    complains(
        ("ranges: [[0, 0], [10, 65535]]", "ranges: [[0, 0], [10, 70000]]  #1"),
        "L1: objects.0x1017.ranges: expected 0 to 65535 for UNSIGNED16, got 10 to 70000",
    )


def test_readings_that_do_not_go_together_as_judged_are_a_problem(complains: Complains) -> None:
    whole = "{name: X, type: UNSIGNED16, access: rw, kind: config, source: x, default: 0}"
    complains(
        [
            (EITHER, f"        changes: {{objects/0x1017: {whole}}}"),
            ("judged_by: either", "judged_by: 2"),
            (JUDGED, "          objects/0x1017/ranges/1/1: 30000  #1"),
        ],
        "L1: ambiguities.1.readings.1.changes.objects/0x1017/ranges/1/1: expected a path such as "
        "objects/0x1017/default of this file, got 'objects/0x1017/ranges/1/1'",
    )


def test_a_reading_that_does_not_go_with_the_judged_ones_is_a_problem(complains: Complains) -> None:
    whole = "{name: X, type: UNSIGNED16, access: rw, kind: config, source: x, default: 0}"
    complains(
        [
            (EITHER, f"        changes: {{objects/0x1017: {whole}}}  #1"),
            (JUDGED, "          objects/0x1017/ranges/1/1: 30000  #2"),
        ],
        "L1: ambiguities.0.readings.1.changes.objects/0x1017: expected a path such as "
        "objects/0x1017/default of this file, got 'objects/0x1017/ranges/1/1' "
        "(objects.0x1017.ranges.1.1)",
    )


def test_the_other_readings_are_linted_although_a_judged_one_does_not_fit(
    complains: Complains,
) -> None:
    complains(
        [
            changes("objects/0x2000/default: 9"),
            (JUDGED, "          objects/0x1017/rangs: [[0, 0]]  #2"),
        ],
        "L1: ambiguities.0.readings.1.changes.objects/0x2000/default: "
        "expected a value in its range (0, 1, 2), got 9",
        "L2: ambiguities.1.readings.1.changes.objects/0x1017/rangs: "
        "expected a known key, got 'rangs' (did you mean 'ranges'?)",
    )


@pytest.mark.parametrize(
    "pairs",
    [
        ["objects/0x1017/unit: ms"],
        ["objects/0x2009: {name: New, type: UNSIGNED8, access: ro, kind: live, source: x}"],
        ["objects/0x2001/limits_by/ranges/0: [[1, 1000]]"],
        ["objects/0x6013/variants: []"],
        ["services/lss: {waiting: [], configuration: [inquire-node-id], source: x}"],
        ["services/nmt: {automatic_start: true, source: x}"],
    ],
)
@pytest.mark.parametrize("judged", ["either", "1", "2"])
def test_a_reading_may_change_add_and_remove(
    complains: Complains, pairs: list[str], judged: str
) -> None:
    complains([changes(*pairs), ("judged_by: either", f"judged_by: {judged}")])
