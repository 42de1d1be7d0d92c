"""The terminal: plain words, tables, errors in one sentence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

WIDE = 500


class Terminal:
    """Standard output and standard error."""

    def __init__(self) -> None:
        self.out = Console(highlight=False)
        self._wide = Console(highlight=False, width=WIDE, soft_wrap=True)
        self._err = Console(stderr=True, highlight=False, soft_wrap=True)

    def say(self, text: str = "", style: str | None = None) -> None:
        """Print a line as it is; text from a device is never taken for markup or control."""
        plain = escape(_printable(text))
        self.out.print(plain, style=style, soft_wrap=not self.out.is_terminal)

    def error(self, text: str) -> None:
        """Print an error to standard error."""
        self._err.print(f"[bold red]error:[/] {escape(_printable(text))}")

    def warn(self, text: str) -> None:
        """Print a warning to standard error."""
        self._err.print(f"[yellow]warning:[/] {escape(_printable(text))}")

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        """Print a table; a row stays on its line when the output is no terminal."""
        table = Table(box=None, pad_edge=False, header_style="bold")
        for head in heads:
            table.add_column(head, overflow="fold")
        for row in rows:
            table.add_row(*(escape(_printable(cell)) for cell in row))
        (self.out if self.out.is_terminal else self._wide).print(table)


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() or c == "\n" else f"\\x{ord(c):02x}" for c in text)


console = Terminal()
