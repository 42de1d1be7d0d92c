"""A device that behaves as a built-in spec says conforms to it, in every variant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from conformance.resources import data, names
from conformance.spec.load import load_spec

VARIANTS = [
    (name, variant)
    for name in names("device_specs")
    for variant in load_spec(data("device_specs") / f"{name}.yaml").variants
]


@pytest.mark.parametrize(("device", "variant"), VARIANTS)
def test_a_simulated_device_conforms(device: str, variant: str, judge: Callable[..., Any]) -> None:
    finished = judge("--variant", variant, device=device)

    assert finished.items("fail") == finished.items("inconclusive") == []
    assert finished.code == 0
