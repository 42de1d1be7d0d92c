"""A server that offers block transfer is held to all of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.spec.load import load_spec

SPEC = Path(__file__).with_name("fourth_device.yaml")
DEFECTS = {
    "sdo-wrong-crc": ["SDO-30/1008h/crc"],
    "sdo-takes-any-block-size": ["SDO-32/1000h/0", "SDO-32/1000h/128", "SDO-33/1000h"],
}


def test_the_device_offers_it() -> None:
    server = load_spec(SPEC).resolve().services.sdo_server
    assert server is not None
    assert server.block


@pytest.mark.parametrize("fault", DEFECTS)
def test_a_defect_fails_alone(fault: str, judge: Callable[..., Any]) -> None:
    finished = judge("--fault", fault, "--select", "SDO", device=SPEC)

    assert finished.items("fail") == DEFECTS[fault]
    assert finished.items("inconclusive") == []


def test_a_server_documented_to_have_blocks_may_not_refuse_them(
    judge: Callable[..., Any], tmp_path: Path
) -> None:
    model = tmp_path / "model.yaml"
    text = SPEC.read_text(encoding="utf-8")
    assert text.count("block: true") == 1
    model.write_text(text.replace("block: true", "block: false"), encoding="utf-8")

    finished = judge("--simulate-spec", model, "--select", "SDO-3", device=SPEC)

    assert finished.requirements("fail") == {"SDO-30", "SDO-31"}
