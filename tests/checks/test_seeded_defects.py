"""A device that differs in one thing from its manual fails in that thing, and in nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SPEC = Path(__file__).parents[2] / "device_specs" / "siko_ims360.yaml"


def replaced(*steps: tuple[str, str, str]) -> Callable[[str], str]:
    """Change a spec's text: (heading after which to look, old text, new text)."""

    def change(text: str) -> str:
        for heading, old, new in steps:
            start = text.index(f"\n  {heading}:\n")
            place = text.index(old, start)
            text = text[:place] + new + text[place + len(old) :]
        return text

    return change


def removed(heading: str) -> Callable[[str], str]:
    """Remove an object from a spec's text."""

    def change(text: str) -> str:
        start = text.index(f"\n  {heading}:\n")
        end = text.index("\n  0x", start + 1)
        return text[:start] + text[end:]

    return change


SPEC_CHANGES = {
    "a default": (replaced(("0x1017", "default: 0", "default: 50")), {"OD-10/1017h"}),
    "an access right, rw to ro": (
        replaced(("0x2001", "access: rw", "access: ro")),
        {"OD-04/2001h"},
    ),
    "an access right, rw to wo": (
        replaced(("0x2001", "access: rw", "access: wo")),
        {"OD-02/2001h"},
    ),
    "an access right, const to rw": (
        replaced(("0x6000", "access: const", "access: rw")),
        {"OD-05/6000h"},
    ),
    "the lower edge of a range": (
        replaced(("0x2002", "ranges: [[0x01, 0x7E]]", "ranges: [[0x02, 0x7E]]")),
        {"OD-11/2002h"},
    ),
    "the upper edge of a range": (
        replaced(("0x2002", "ranges: [[0x01, 0x7E]]", "ranges: [[0x01, 0x7D]]")),
        {"OD-11/2002h"},
    ),
    "a range that is too wide": (
        replaced(("0x3112", "ranges: [[1, 127]]", "ranges: [[0, 127]]")),
        {"OD-13/3112h:01"},
    ),
    "an enumeration value that is missing": (
        replaced(("0x2001", "      800000: 800 kbit/s\n", "")),
        {"OD-11/2001h"},
    ),
    "a type": (
        replaced(("0x20FF", "type: UNSIGNED16", "type: UNSIGNED32")),
        {"OD-03/20FFh"},
    ),
    "a mappable object that is not": (
        replaced(("0x3022", "mappable: true", "mappable: false")),
        {"TPDO-06/3022h"},
    ),
    "a missing object": (removed("0x20FF"), {"OD-01/20FFh"}),
    "an extra sub-index": (
        replaced(
            ("0x2020", "default: 1", "default: 2"),
            (
                "0x2020",
                "      1:\n",
                (
                    "      2:\n        name: Extra\n        type: UNSIGNED8\n"
                    "        access: ro\n        kind: live\n      1:\n"
                ),
            ),
        ),
        {"OD-09/2020h:00", "OD-16/2020h"},
    ),
    "the heartbeat minimum": (
        replaced(("heartbeat_producer", "min_ms: 10", "min_ms: 20")),
        {"OD-11/1017h"},
    ),
    "the heartbeat minimum, by its range": (
        replaced(("0x1017", "ranges: [[0, 0], [10, 65535]]", "ranges: [[0, 0], [20, 65535]]")),
        {"OD-11/1017h"},
    ),
}

DRAGGED_ALONG = {
    "a default": ("RST-",),
    "tpdo-in-pre-operational": ("TPDO-17/", "SYNC-02/"),
    "an access right, rw to ro": ("BIT-", "LSS-"),
    "an access right, rw to wo": (
        "BIT-",
        "LSS-",
        "NID-",
        "STO-",
        "RST-",
        "OD-11/2002h",
        "OD-23/2002h",
    ),
    "an enumeration value that is missing": ("LSS-19/13h/0/1", "BIT-"),
    "no-boot-up": ("DEV-22/2010h:01", "NID-09/2002h", "NMT-09/power-on"),
    "a mappable object that is not": ("TPDO-30/",),
    "mapped-objects-swapped": ("TPDO-30/",),
}
"""What may fail or stay open beside the change itself, because it rests on it: beginnings of ids."""

FAULTS = {
    "heartbeat-slow-10-percent": {
        "HB-01/1017h/10ms",
        "HB-01/1017h/100ms",
        "HB-07/1017h/2000ms",
    },
    "tpdo-in-pre-operational": {f"TPDO-01/180{n}h" for n in range(4)},
    "mapped-objects-swapped": {f"TPDO-05/180{n}h" for n in range(4)},
    "no-boot-up": {
        "BOOT-01/reset-node",
        "BOOT-01/reset-node/broadcast",
        "BOOT-01/reset-communication",
        "BOOT-01/reset-communication/broadcast",
        "BOOT-01/power-on",
    },
}


@pytest.mark.parametrize("what", SPEC_CHANGES)
def test_a_device_built_from_a_changed_spec_fails_in_the_change(
    what: str, judge: Callable[..., Any], tmp_path: Path
) -> None:
    change, expected = SPEC_CHANGES[what]
    text = SPEC.read_text(encoding="utf-8")
    changed = change(text)
    assert changed != text
    copy = tmp_path / "copy.yaml"
    copy.write_text(changed, encoding="utf-8")

    finished = judge("--variant", "two-axis", "--simulate-spec", copy)

    rest = DRAGGED_ALONG.get(what, ())
    failed = set(finished.items("fail"))
    assert expected <= failed
    assert [item for item in failed - expected if not item.startswith(rest)] == []
    assert finished.code == 1
    subject = next(iter(expected)).split("/")[1].partition(":")[0]
    open_ = [item for item in finished.items("inconclusive") if subject not in item]
    assert [item for item in open_ if not item.startswith(rest)] == []


@pytest.mark.parametrize("fault", FAULTS)
def test_a_device_with_a_fault_fails_in_the_fault(fault: str, judge: Callable[..., Any]) -> None:
    finished = judge("--variant", "two-axis", "--fault", fault)

    rest = DRAGGED_ALONG.get(fault, ())
    failed = set(finished.items("fail"))
    assert FAULTS[fault] <= failed
    assert [item for item in failed - FAULTS[fault] if not item.startswith(rest)] == []
    assert [item for item in finished.items("inconclusive") if not item.startswith(rest)] == []
    assert finished.code == 1


@pytest.mark.parametrize("variant", ["one-axis", "two-axis"])
def test_a_device_as_documented_conforms(variant: str, judge: Callable[..., Any]) -> None:
    finished = judge("--variant", variant)

    assert finished.code == 0
    summary = finished.record["summary"]
    assert summary["pass"] + summary["not_applicable"] == summary["items"]


INVENTED = Path(__file__).parents[1] / "simulator" / "invented.yaml"


def test_a_device_of_yaml_alone_conforms(judge: Callable[..., Any]) -> None:
    finished = judge(device=INVENTED)

    assert finished.items("fail") == finished.items("inconclusive") == []
    assert finished.code == 0


def test_a_device_with_fixed_tpdos_is_judged_as_it_is(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    text = INVENTED.read_text(encoding="utf-8")
    for heading in ("0x1800", "0x1801", "0x1A00", "0x1A01"):
        start = text.index(f"\n  {heading}:\n")
        end = text.index("\n  0x", start + 1)
        lines = text[start:end].splitlines(keepends=True)
        fixed = [
            line
            if "Type," in line or "imer" in line or "Count" in line
            else line.replace("access: rw", "access: ro")
            for line in lines
        ]
        text = text[:start] + "".join(fixed) + text[end:]
    copy = tmp_path / "fixed.yaml"
    copy.write_text(text, encoding="utf-8")

    finished = judge(device=copy)

    assert finished.items("fail") == finished.items("inconclusive") == []
    assert "TPDO-05/1800h" in finished.items("pass")
    assert not [item for item in finished.items("pass") if item.startswith("TPDO-04")]
