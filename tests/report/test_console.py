"""No text of a device controls the terminal that it is printed on."""

from __future__ import annotations

import re
from io import StringIO

import pytest
from meddled_uploads import NASTY
from rich.console import Console

from conformance.report.console import Terminal

OWN = {"\x1b[1m", "\x1b[0m"}
"""Bold, and an end to it."""


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
@pytest.mark.parametrize("data", NASTY, ids=range(len(NASTY)))
def test_a_text_is_printed_and_never_obeyed(data: bytes, encoding: str) -> None:
    text, printed = data.decode(encoding, "surrogateescape"), StringIO()
    terminal = Terminal()
    terminal.out = Console(file=printed, force_terminal=True, highlight=False, width=80)

    terminal.say(text, style="bold")
    terminal.table(("text",), [(text,)])

    out = printed.getvalue()
    assert set(re.findall(r"\x1b[^m]*m?", out)) <= OWN
    rest = re.sub(r"\x1b\[[01]m", "", out)
    assert all(it.isprintable() or it == "\n" for it in rest)
    assert ("[bold red]" in rest) == ("[bold red]" in text)
