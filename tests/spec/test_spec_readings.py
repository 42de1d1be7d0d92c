"""Readings that do not fit the file, or make a spec that does not hold together."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import pytest

from conformance.spec.readings import ChangeError, parse_path

Complains: TypeAlias = Callable[..., None]

EITHER = "        changes: {objects/0x2000/default: 2}"
JUDGED = "          objects/0x1017/ranges: [[0, 0], [10, 30000]]"
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


@pytest.mark.parametrize(
    ("pairs", "sentences"),
    [
        (
            ["objects/0x2000/default: [2]"],
            [".objects/0x2000/default: expected an integer or a text, got [2]"],
        ),
        (
            ["objects/0x2000/defualt: 2"],
            [
                ".objects/0x2000/defualt: expected a known key, got 'defualt' "
                "(did you mean 'default'?)"
            ],
        ),
        (
            ["objects/0x2000: {name: X, type: UNSIGNED8, access: ro, source: x}"],
            [".objects/0x2000: expected this key, got nothing (objects.0x2000.kind)"],
        ),
        (
            ["objects/0x1010/subs/1/access: r", "services/nmt/automatic_start: 1"],
            [
                ".objects/0x1010/subs/1/access: expected 'ro', 'rw', 'wo' or 'const', got 'r'",
                ".services/nmt/automatic_start: expected true or false, got 1",
            ],
        ),
        (
            ["objects/0x2000/default: 9"],
            [".objects/0x2000/default: expected a value in its range (0, 1, 2), got 9"],
        ),
        (
            ["objects/0x2000/default: 256"],
            [".objects/0x2000/default: expected 0 to 255 for UNSIGNED8, got 256"],
        ),
        (
            ["objects/0x2000/default: NODE"],
            [".objects/0x2000/default: expected the name NODEID, got 'NODE' in 'NODE'"],
        ),
        (
            ["objects/0x2000/variants: [three]"],
            [
                ".objects/0x2000/variants: expected a variant of this file (one, two), got 'three' "
                "(objects.0x2000.variants)",
                ".objects/0x2000/variants: expected a documented object, got 2000h:00 "
                "(objects.0x2001.limits_by.object)",
            ],
        ),
        # what shows elsewhere is put down to the reading
        (
            ["objects/0x2000/values: {0: 'Off', 2: Fast}"],
            [
                ".objects/0x2000/values: expected a value in its range (0, 2), got 1 "
                "(objects.0x2000.default)",
                ": expected a value of 2000h (0, 2), got 1 (objects.0x2001.limits_by.ranges.1)",
            ],
        ),
        (
            ["objects/0x6010/type: INTEGER32"],
            [
                ": expected 32 bits for INTEGER32, got 16 for 6010h:00 in mapping word 60100010h "
                "(objects.0x1A00.subs.1.default)"
            ],
        ),
        (
            ["objects/0x1010/subs/2: {name: X, type: UNSIGNED8, access: ro, kind: live}"],
            [
                ".objects/0x1010/subs/2: expected 2, the highest sub-index listed, got 1 "
                "(objects.0x1010.subs.0.default)"
            ],
        ),
        (
            ["objects/0x1014/variants: [one]"],
            [": expected a documented object, got 1014h (services.emcy_producer.object)"],
        ),
        (
            ["services/emcy_producer/object: 0x1015"],
            [".services/emcy_producer/object: expected a documented object, got 1015h"],
        ),
        (
            ["services/heartbeat_producer/min_ms: 30001"],
            [
                ".services/heartbeat_producer/min_ms: expected at most max_ms (30000), got 30001",
            ],
        ),
        (
            ["services/tpdo/count: 2"],
            [
                ".services/tpdo/count: expected 2 documented objects, got none for 1801h "
                "(services.tpdo.communication)",
                ".services/tpdo/count: expected 2 documented objects, got none for 1A01h "
                "(services.tpdo.mapping)",
            ],
        ),
    ],
)
def test_a_reading_is_linted_where_it_stands(
    complains: Complains, pairs: list[str], sentences: list[str]
) -> None:
    complains(
        changes(*pairs),
        *(f"L{n}: ambiguities.0.readings.1.changes{text}" for n, text in enumerate(sentences, 1)),
    )
