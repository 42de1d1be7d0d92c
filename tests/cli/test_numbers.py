"""Numbers as people read them."""

from __future__ import annotations

import pytest

from conformance.numbers import figure


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (65535, 4, "65535"),
        (9999.6, 4, "10000"),
        (298.46, 4, "298.5"),
        (100.0, 4, "100"),
        (12_345_678, 6, "12345678"),
        (-0.000012, 2, "-0.000012"),
        (0, 6, "0"),
        (float("inf"), 4, "inf"),
    ],
)
def test_a_figure_has_no_exponent(value: float, digits: int, text: str) -> None:
    assert figure(value, digits) == text
