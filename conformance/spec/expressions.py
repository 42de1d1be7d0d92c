"""Integer expressions with NODEID, as manuals write COB-IDs (``0x180 + NODEID``)."""

from __future__ import annotations

import ast
import operator
import warnings
from collections.abc import Callable
from functools import lru_cache

_OPERATORS: dict[type[ast.operator], Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
}
_LONGEST = 80


class ExpressionError(ValueError):
    """The text is no integer expression; the message says ``expected …, got …``."""


def evaluate(text: str, node_id: int) -> int:
    """Return the value of ``text`` for one node-ID.

    Args:
        text: Integers (decimal, ``0x``, ``0b``, ``0o``), ``NODEID``, ``+ - * | &``, parentheses.
        node_id: 1..127.

    Raises:
        ExpressionError: The text is anything else.
    """
    return _value(_parse(text), text, node_id)


@lru_cache
def _parse(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise ExpressionError(
            f"expected an expression of at most {_LONGEST} characters, got {len(text)}"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # "1if" is no number
            return ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError):
        raise ExpressionError(f"expected an integer expression, got {text!r}") from None


def _value(node: ast.expr, text: str, node_id: int) -> int:
    match node:
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            return number
        case ast.Name(id="NODEID"):
            return node_id
        case ast.Name(id=name):
            raise ExpressionError(f"expected the name NODEID, got {name!r} in {text!r}")
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(left, text, node_id), _value(right, text, node_id))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, text, node_id)
        case _:
            raise ExpressionError(f"expected an integer expression, got {text!r}")
