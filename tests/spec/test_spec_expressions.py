from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from conformance.spec.expressions import ExpressionError, evaluate

NODE_ID = 10


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("7", 7),
        ("NODEID", 10),
        ("0x180 + NODEID", 0x18A),
        ("0X180+NODEID", 0x18A),
        ("0b101", 5),
        ("0o17", 15),
        ("1_000", 1000),
        ("2 + 3 * 4", 14),
        ("(2 + 3) * 4", 20),
        ("20 - 3 - 4", 13),
        ("1 | 2 + 4", 7),
        ("0xFF & 0x0F | 0x100", 0x10F),
        ("6 & 3 + 1", 4),
        ("-NODEID", -10),
        ("--5", 5),
        ("-2 * 3", -6),
    ],
)
def test_an_expression_has_its_value(text: str, value: int) -> None:
    assert evaluate(text, NODE_ID) == value


@pytest.mark.parametrize(
    "text",
    [
        "",
        " 1",
        "1 +",
        "1 / 2",
        "1 // 2",
        "1 % 2",
        "1 << 2",
        "2 ** 3",
        "1 ^ 2",
        "+1",
        "~1",
        "not 1",
        "1.0",
        "1e3",
        "True",
        "None",
        "'a'",
        "1, 2",
        "[1]",
        "1 if NODEID else 2",
        "1if NODEID else 2",
        "'\\d'",
        "NODEID()",
        "NODEID.real",
        "NODEID == 1",
        "a = 1",
        "1; 2",
        "1\n2",
        "1\0",
        "\ud800",
        "(" * 80,
        "0x",
        "017",
    ],
)
def test_anything_else_is_refused_with_its_text(text: str) -> None:
    with pytest.raises(ExpressionError) as caught:
        evaluate(text, NODE_ID)
    assert str(caught.value) == f"expected an integer expression, got {text!r}"


def test_another_name_is_refused_by_name() -> None:
    with pytest.raises(ExpressionError) as caught:
        evaluate("0x180 + NODE_ID", NODE_ID)
    assert str(caught.value) == "expected the name NODEID, got 'NODE_ID' in '0x180 + NODE_ID'"


def test_a_long_text_is_refused_unread() -> None:
    assert evaluate("1" + " + 1" * 19 + "+10", NODE_ID) == 30
    with pytest.raises(ExpressionError) as caught:
        evaluate("1" * 81, NODE_ID)
    assert str(caught.value) == "expected an expression of at most 80 characters, got 81"


@given(st.text(), st.integers(1, 127))
def test_an_arbitrary_text_is_evaluated_or_refused(text: str, node_id: int) -> None:
    try:
        assert isinstance(evaluate(text, node_id), int)
    except ExpressionError as error:
        assert str(error).startswith("expected ")


@given(st.text("0123456789abcdefxNODEI+-*|&()_ ", max_size=80), st.integers(1, 127))
def test_a_text_of_the_right_characters_is_evaluated_or_refused(text: str, node_id: int) -> None:
    try:
        assert isinstance(evaluate(text, node_id), int)
    except ExpressionError as error:
        assert str(error).startswith("expected ")
