"""What a node told as its serial number, in the objects that its manual has for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from conformance.bench.services.identity import told_serial
from conformance.spec.load import load_spec

IMS = Path(__file__).parents[2] / "device_specs" / "siko_ims360.yaml"


@pytest.mark.parametrize(
    ("identity", "told"),
    [
        ({"1018h:04": "B5 9C 00 00"}, "40117"),
        ({"1018h:04": "abort 0602 0000h", "2000h:01": "0040117\0"}, "40117"),
        ({"2000h:01": "9" * 5000}, ""),
        ({"2000h:01": "no number"}, ""),
        ({"1018h:01": "B5 9C 00 00"}, ""),
        ({}, ""),
    ],
)
def test_a_serial_number_is_read_where_the_manual_has_it(
    identity: dict[str, str], told: str
) -> None:
    spec = load_spec(IMS).resolve(None, 5)
    assert told_serial(spec, identity) == told
