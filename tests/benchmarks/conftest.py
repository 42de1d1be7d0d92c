"""Benchmarks print what they found as a table of ratios; they assert nothing about time."""

from __future__ import annotations

from collections.abc import Callable

import pytest

_LINES: list[str] = []


@pytest.fixture
def tell() -> Callable[[str], None]:
    """Return what adds a line to the summary at the end."""
    return _LINES.append


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the lines."""
    if _LINES:
        terminalreporter.section("figures and ratios")
        for line in _LINES:
            terminalreporter.write_line(line)
