"""The specs in preparation hold together, and a device that behaves like them conforms."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.spec.load import load_spec

DRAFTS = sorted((Path(__file__).parents[2] / "device_specs" / "drafts").glob("*.yaml"))


@pytest.mark.parametrize("path", DRAFTS, ids=lambda path: path.stem)
def test_a_draft_conforms_in_its_first_and_last_variant(
    path: Path, judge: Callable[..., Any]
) -> None:
    variants = load_spec(path).variants
    for variant in (variants[0], variants[-1]):
        finished = judge("--variant", variant, device=path)

        assert finished.items("fail") == finished.items("inconclusive") == []
        assert finished.code == 0
